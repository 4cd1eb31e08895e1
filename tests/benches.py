"""What the tests of effects share: a muscle with every measurement, runs that show, runs that hurt."""

import functools
import itertools
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from mckibben_jax.effects import LIBRARY
from mckibben_jax.model import Model, model
from mckibben_jax.muscle import Muscle, quantities
from mckibben_jax.parameter import parameters
from mckibben_jax.state import State

MUSCLE = Muscle(
    length=0.3, radius=7e-3, braid_angle=np.radians(20.0), wall_thickness=5e-4, shear_modulus=0.5e6,
    mooney_c10=1.2e5, mooney_c01=1e4, strand_width=3e-4, strand_modulus=2e9, strand_poisson=0.35,
    breaking_stress=28e6, moving_mass=0.1,
)  # fmt: skip
ROWS, SAMPLES = 13, 48


# Runs ----------------------------------------------------------------------------------------------------------------


def run(time, contraction, pressure, rate=None) -> State:
    """A run (or, with another leading axis, several) from arrays; rates by differences unless given."""
    time, contraction, pressure = (np.asarray(a, dtype=float) for a in (time, contraction, pressure))
    rate = np.gradient(contraction, time) if rate is None else rate
    rate = np.where(np.abs(rate) > 1e-12, rate, 0.0)  # a held length is held
    pressure_rate = np.gradient(pressure, time) if time.ndim == 1 and np.all(np.diff(time) > 0) else 0 * pressure
    zero = jnp.zeros_like(contraction)
    return State(contraction, pressure, rate, pressure_rate, zero, zero, time)


def along(turns, speed: float, samples: int = SAMPLES) -> tuple[np.ndarray, np.ndarray]:
    """Time and value along straight lines through `turns` at a constant absolute slope."""
    corners = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(turns)) / speed)])
    time = np.linspace(0.0, corners[-1], samples)
    return time, np.interp(time, corners, turns)


def loop(pressure: float, speed: float, turns=(0.0, 0.3, 0.08, 0.18, 0.0), samples: int = SAMPLES) -> State:
    """Length imposed at a constant `pressure` (Pa) and `speed` (m/s)."""
    time, contraction = along(turns, speed / 0.3, samples)
    return run(time, contraction, np.full(samples, pressure))


def isometric(contraction: float, ramp: float, turns=(0.2e5, 5e5, 0.2e5)) -> State:
    """Pressure imposed at a held length, `ramp` in Pa/s."""
    time, pressure = along(turns, ramp)
    return run(time, np.full(SAMPLES, contraction), pressure)


def hold(pressure: float) -> State:
    """A quick shortening, and a long wait."""
    time = np.concatenate([np.linspace(0, 0.5, 8), 0.5 + np.geomspace(0.1, 60.0, SAMPLES - 8)])
    return run(time, np.minimum(time / 0.5, 1.0) * 0.21, np.full(SAMPLES, pressure))


def stacked(runs) -> State:
    """Several runs as one state with two leading axes: run, sample."""
    return jax.tree.map(lambda *leaves: jnp.stack(leaves), *runs)


def visible_runs() -> State:
    """Loops with a minor loop at several pressures and speeds, growing loops, isometric ramps, a hold."""
    loops = [loop(p, v) for p, v in itertools.product((0.0, 0.5e5, 2e5, 5e5), (0.01, 0.1))]
    growing = loop(1e5, 0.05, turns=(0.0, 0.11, 0.0, 0.22, 0.0, 0.11, 0.0))
    held = [isometric(0.0, 1e5), isometric(0.12, 2e6)]
    return stacked([*loops, growing, *held, hold(3e5), loop(3e5, 0.6)])


def hard_runs() -> State:
    """Every awkward place, in jumps: rest, no pressure, no motion, beyond the stroke, time that stands."""
    random = np.random.default_rng(1)
    contractions = (0.0, 0.0, -0.03, 1e-12, 0.1, 0.3, 0.3867, 0.5)
    pressures = (0.0, 0.0, 1e-6, 1.0, 1e5, 8e5, -2e3)
    rates = (0.0, 0.0, 1e-9, -1e-9, 0.1, -0.1, 10.0, -10.0)
    steps = (0.0, 0.0, 1e-9, 1e-3, 1.0, 1e4)
    every = np.array(list(itertools.product(contractions, pressures, rates)))
    chosen = random.permutation(every)[np.arange(ROWS * SAMPLES) % len(every)].reshape(ROWS, SAMPLES, 3)
    chosen[0] = 0.0  # one run that never leaves rest
    time = np.cumsum(random.choice(steps, (ROWS, SAMPLES)), axis=1) * (np.arange(ROWS) > 0)[:, None]
    return run(time, chosen[..., 0], chosen[..., 1], chosen[..., 2])


VISIBLE, HARD = visible_runs(), hard_runs()


# Models --------------------------------------------------------------------------------------------------------------


def hosts(kind) -> tuple:
    """The gas, and the first effects of the library that give what this one needs and the muscle cannot."""
    gas = next(other for other in LIBRARY if other.family == "gas")
    needed = [need for need in kind.needs if need not in quantities()]
    givers = [next(o for o in LIBRARY if need in o.gives and not o.rival and o is not kind) for need in needed]
    return tuple(other for other in dict.fromkeys((gas, *givers)) if other is not kind)


def _with_vector(given: Model, index: int, names: tuple[str, ...], vector: jax.Array) -> Model:
    effect = given.effects[index]
    if names:
        effect = eqx.tree_at(lambda e: [getattr(e, name) for name in names], effect, list(vector[:-1]))
    effects = (*given.effects[:index], effect, *given.effects[index + 1 :])
    switches = given.switches.at[index].set(vector[-1])
    return eqx.tree_at(lambda m: (m.effects, m.switches), given, (effects, switches))


class Bench(NamedTuple):
    """An effect in the smallest model that it can live in, compiled once.

    `evaluate(vector, model, runs)` gives the force and its derivatives with respect to the vector: the parameters of
    the effect in the order of declaration, then its switch.
    """

    model: Model
    index: int
    declared: tuple
    evaluate: object

    def vector(self, *values: float, switch: float = 1.0) -> jax.Array:
        """Parameters (defaults unless given) and switch."""
        return jnp.array([*(values or [p.default for p in self.declared]), switch])

    @property
    def away(self) -> list[float]:
        """Values of the parameters away from their defaults and from round numbers."""
        return [p.default * 1.307 if p.default * 1.307 < p.upper else p.default * 0.707 for p in self.declared]

    def force(self, vector, runs=VISIBLE, given: Model | None = None) -> np.ndarray:
        """Force along runs, N."""
        return np.asarray(self.evaluate(vector, given or self.model, runs)[0])

    def slopes(self, vector, runs=VISIBLE) -> np.ndarray:
        """Derivatives of the force, the last axis that of the vector."""
        return np.asarray(self.evaluate(vector, self.model, runs)[1])


@functools.cache
def bench(kind) -> Bench:
    """The bench of an effect."""
    given = model(MUSCLE, *(other() for other in hosts(kind)), kind())
    given = eqx.tree_at(lambda m: m.live, given, jnp.ones(len(given.effects), bool), is_leaf=lambda leaf: leaf is None)
    index = [type(effect) for effect in given.effects].index(kind)
    declared = parameters(kind)
    names = tuple(p.name for p in declared)

    def force(vector, given, runs):
        filled = _with_vector(given, index, names, vector)
        return jax.vmap(filled.force)(runs)

    evaluate = eqx.filter_jit(lambda v, m, r: (force(v, m, r), jax.jacfwd(force)(v, m, r)))
    return Bench(given, index, declared, evaluate)


@functools.cache
def host_force(kinds: tuple, which: str) -> np.ndarray:
    """Force of a model of these effects along the visible or the hard runs."""
    runs = {"visible": VISIBLE, "hard": HARD}[which]
    given = model(MUSCLE, *(kind() for kind in kinds))
    return np.asarray(eqx.filter_jit(jax.vmap(given.force))(runs))


def braid_slope(contraction, pressure) -> jax.Array:
    """Slope of the ideal law (eq 10) over contraction, N, by hand: -2 pi r0^2 P a (1 - eps)."""
    a = 3 / jnp.tan(MUSCLE.braid_angle) ** 2
    return -2 * jnp.pi * MUSCLE.radius**2 * pressure * a * (1 - contraction)
