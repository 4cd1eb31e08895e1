"""Muscles that move a load: quick release and pressure steps, with dry friction that really sticks.

M x'' = F(x, v, P) - load with x = l0 eps, positive when shorter, and M = load/g + moving mass (Tondu 2012, eqs 42 to
48, with any model in place of eq 10). Everything is differentiable in forward mode (`jax.jacfwd`) and works under `jit`
and `vmap`; the number of steps is static. Effects of the read stage act on the force channel, not on a position.
"""

import math
from typing import Any, ClassVar, NamedTuple

import diffrax as dfx
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import ArrayLike
from scipy import constants

from mckibben_jax.laws.shape import path_rate
from mckibben_jax.model import Memories, Model
from mckibben_jax.motion.friction_step import Law, push
from mckibben_jax.state import State

STEP = 2.5e-4  # s: errors of some 1e-6 m; 1e-3 s is enough for screening
LEAST_MASS = 1e-3  # kg: without any mass there is no motion to integrate
MOST_CONTRACTION = 0.9  # a stop far beyond any stroke, as straight strands are at the other end


class Motion(eqx.Module):
    """What changes while a muscle moves: contraction, its rate (1/s), and what the effects remember.

    `seen` is the state up to which memories have advanced (half a step behind), None where nothing is remembered;
    `finite` falls from 1 to 0 when a step led to no number; the muscle then stays where it was.
    """

    contraction: jax.Array
    rate: jax.Array
    memories: Memories
    seen: State | None
    finite: jax.Array


class Nodes(NamedTuple):
    """Where a run is begun anew, for multiple shooting: after how many steps, at which contraction and rate (1/s).

    What the effects remember is carried across.
    """

    step: jax.Array
    contraction: jax.Array
    rate: jax.Array


class Moved(NamedTuple):
    """A run: contraction and rate (1/s) at the times asked for, and whether every number in it was finite.

    `gaps` are the contraction and rate in which each stretch misses the node that it leads to, None without nodes.
    """

    contraction: jax.Array
    rate: jax.Array
    finite: jax.Array
    gaps: tuple[jax.Array, jax.Array] | None = None


class Rig(eqx.Module):
    """A muscle and what is imposed on it, on an even grid of `step` seconds from `begin`; straight lines between.

    Time is counted in steps, k = (t - begin)/step, so that runs of different length share one loop. `waiting` are the
    samples until `begin`, in which the muscle is held.
    """

    model: Model
    waiting: State
    begin: jax.Array
    step: jax.Array
    pressure: jax.Array  # Pa
    load: jax.Array  # N
    mass: jax.Array  # kg

    def state(self, k: jax.Array, contraction: jax.Array, rate: jax.Array) -> State:
        """The state that the rig reports."""
        pressure, rise = _on_grid(self.pressure, k)
        return State(contraction, pressure, rate, rise / self.step, time=self.begin + k * self.step)

    def law(self, k: jax.Array, state: State, memories: Memories) -> tuple[Law, jax.Array]:
        """Acceleration (1/s^2) at any speed of sliding and direction of friction, and the rate without sliding (1/s).

        What is felt and the pull are taken as straight in the rate, which they nearly are; what is lost is not. The
        braid does not slide when its path stands still: at rate 0, but for fittings and strands that give way.
        """
        model, load = self.model, _on_grid(self.load, k)[0]
        inertia = _on_grid(self.mass, k)[0] * model.muscle.length

        def at(rate: jax.Array) -> tuple[State, tuple[jax.Array, jax.Array], jax.Array]:
            felt = model.felt_now(state.replace(rate=rate), memories)
            return felt, model.pull(felt, memories), path_rate(model.muscle, felt)

        now, slope = jax.jvp(at, (state.rate,), (jnp.ones_like(state.rate),))
        resting = state.rate - now[2] / slope[2]

        def acceleration(speed: jax.Array, direction: jax.Array) -> jax.Array:
            change = resting + speed - state.rate
            felt, (total, elastic), _ = jax.tree.map(lambda a, b: a + change * b, now, slope)
            lost = model.lost_now(felt, elastic, memories, direction).force
            return (total - lost - load) / inertia

        return acceleration, resting

    def after(self, k: jax.Array, motion: Motion, steps: jax.Array) -> Motion:
        """The motion after `steps` steps: half a drift, a push there, and the way that the push gives."""
        duration, middle = steps * self.step, k + steps / 2
        halfway = self._within(motion.contraction + duration / 2 * motion.rate)
        seen = self.state(middle, halfway, motion.rate)
        memories = motion.memories
        if motion.seen is not None:
            memories = self.model.advance_memories(memories, motion.seen, seen)
        law, resting = self.law(middle, seen, memories)
        slid = push(law, motion.rate - resting, duration)
        contraction, rate = motion.contraction + resting * duration + slid.way, resting + slid.speed
        finite = jnp.isfinite(contraction) & jnp.isfinite(rate)
        free = finite & (contraction == self._within(contraction))  # nothing bounces off a stop
        contraction = self._within(jnp.where(finite, contraction, motion.contraction))
        seen = None if motion.seen is None else seen
        return Motion(contraction, jnp.where(free, rate, 0.0), memories, seen, jnp.where(finite, motion.finite, 0.0))

    def change(self, k: jax.Array, motion: Motion) -> Motion:
        """Change per step, for general methods; right where nothing is remembered and there is no dry friction."""
        law, resting = self.law(k, self.state(k, motion.contraction, motion.rate), motion.memories)
        speed = motion.rate - resting
        still = jax.tree.map(jnp.zeros_like, motion)
        moving = (motion.rate * self.step, law(speed, jnp.sign(speed)) * self.step)
        return eqx.tree_at(lambda m: (m.contraction, m.rate), still, moving)

    def _within(self, contraction: jax.Array) -> jax.Array:
        straight = 1 - 1 / jnp.cos(self.model.muscle.braid_angle)  # strands cannot be pulled longer than straight
        return jnp.clip(contraction, straight, MOST_CONTRACTION)


class StickSlip(dfx.AbstractSolver):
    """Strang splitting with exact sticking, second order; of the kind of diffrax's own solvers, `args` is the rig."""

    term_structure: ClassVar = dfx.ODETerm
    interpolation_cls: ClassVar = dfx.ThirdOrderHermitePolynomialInterpolation

    def order(self, terms: Any) -> int:
        """Order of the error over a run."""
        return 2

    def init(self, terms: Any, t0: Any, t1: Any, y0: Motion, args: Rig) -> None:
        """Nothing is kept between steps."""
        return None

    def step(
        self, terms: Any, t0: Any, t1: Any, y0: Motion, args: Rig, solver_state: None, made_jump: Any
    ) -> tuple[Motion, None, dict[str, Any], None, dfx.RESULTS]:
        """One step, and what is needed to interpolate in it: a cubic for the contraction, lines for the rest."""
        y1 = args.after(t0, y0, t1 - t0)
        line = jax.tree.map(lambda a, b: b - a, y0, y1)
        start, end = (eqx.tree_at(lambda m: m.contraction, line, (t1 - t0) * args.step * y.rate) for y in (y0, y1))
        return y1, None, {"y0": y0, "y1": y1, "k0": start, "k1": end}, None, dfx.RESULTS.successful

    def func(self, terms: Any, t0: Any, y0: Motion, args: Rig) -> Motion:
        """The vector field."""
        return terms.vf(t0, y0, args)


def moved(
    model: Model, states: State, load: Any, start: Any, *, steps: Any, since: Any = None, mass: Any = None,
    solver: dfx.AbstractSolver | None = None, nodes: Nodes | None = None, room: int | None = None,
) -> Moved:  # fmt: skip
    """How a muscle moves a load, at the times of `states`, under their pressure (straight between the samples).

    It stands at contraction `start` until `since` (s; the first sample if None) and is free from then on. `load` in N
    and `mass` in kg, one number or one per sample; mass is load/g + moving mass if None. `steps` even steps lead to the
    last time; they may be traced where there is `room` for that many. Times that repeat do no harm. At `nodes` the
    muscle is put elsewhere.
    """
    since = states.time[0] if since is None else since
    load, start, since = (jnp.asarray(value, dtype=float) for value in (load, start, since))
    mass = load / constants.g + model.muscle.moving_mass if mass is None else jnp.asarray(mass, dtype=float)
    pushed, solver = (states.time, states.pressure, load, mass), solver or StickSlip()
    if room is None:
        return _moved(model, *pushed, start, since, None, steps, solver, nodes)
    return _moved(model, *pushed, start, since, jnp.asarray(steps, dtype=float), room, solver, nodes)


@eqx.filter_jit
def _moved(
    model: Model, time: jax.Array, pressure: jax.Array, load: jax.Array, mass: jax.Array, start: jax.Array,
    since: jax.Array, fewer: jax.Array | None, room: int, solver: dfx.AbstractSolver, nodes: Nodes | None,
) -> Moved:  # fmt: skip
    steps = room if fewer is None else fewer
    rig = _rig(model, time, (pressure, load, mass), since, steps, room)
    term = dfx.ODETerm(lambda k, motion, rig: rig.change(k, motion))
    first = _at_rest(rig, start)

    def advance(carry: tuple[Motion, Any], k: jax.Array) -> tuple[tuple[Motion, Any], tuple[Any, Any]]:
        begun = carry[0] if nodes is None else _begun(carry[0], nodes, k)
        motion, _, _, state, _ = solver.step(term, k, k + 1, begun, rig, carry[1], made_jump=False)
        return (motion, state), (_place(motion), None if nodes is None else _place(begun))

    def advance_if_asked(carry: tuple[Motion, Any], k: jax.Array) -> tuple[tuple[Motion, Any], tuple[Any, Any]]:
        stays = _place(carry[0])
        stay = lambda carry, _: (carry, (stays, None if nodes is None else stays))  # noqa: E731
        return jax.lax.cond(k < steps, advance, stay, carry, k)

    # diffrax's solvers, stepped by hand: even steps need no controller, whose loop costs 1.3 to 2 times as much
    carry = (first, solver.init(term, jnp.zeros(()), jnp.ones(()), first, rig))
    follow = advance if fewer is None else advance_if_asked
    (last, _), (ends, begins) = jax.lax.scan(follow, carry, jnp.arange(room, dtype=float))
    if begins is None:
        begins = jax.tree.map(lambda a, b: jnp.concatenate([a[None], b[:-1]]), _place(first), ends)
    k = jnp.clip((time - rig.begin) / rig.step, 0, steps)
    contraction, rate = _between(begins, ends, rig.step, k)
    return Moved(contraction, rate, last.finite == 1, None if nodes is None else _gaps(ends, nodes))


def _place(motion: Motion) -> tuple[jax.Array, jax.Array]:
    return motion.contraction, motion.rate


def _begun(motion: Motion, nodes: Nodes, k: jax.Array) -> Motion:
    """The motion, put where a node says if there is one before step k."""
    here = nodes.step == k
    there = (jnp.sum(jnp.where(here, value, 0.0)) for value in (nodes.contraction, nodes.rate))
    place = tuple(jnp.where(jnp.any(here), new, old) for new, old in zip(there, _place(motion), strict=True))
    return eqx.tree_at(lambda m: (m.contraction, m.rate), motion, place)


def _gaps(ends: tuple[jax.Array, jax.Array], nodes: Nodes) -> tuple[jax.Array, jax.Array]:
    before = nodes.step.astype(int) - 1
    return ends[0][before] - nodes.contraction, ends[1][before] - nodes.rate


def released(model: Model, states: State, load: Any, start: Any = 0.0, *, steps: int) -> jax.Array:
    """Contraction at the times of `states` of a muscle held at `start` under pressure and let go at t = 0 (s)."""
    return moved(model, states, load, start, steps=steps, since=0.0).contraction


def release(
    model: Model, *, load: Any, pressure: Any, times: Any, start: Any = 0.0, mass: Any = None, step: float = STEP
) -> jax.Array:
    """Quick release: contraction at `times` (s, not traced), let go at t = 0. `pressure` in Pa, `load` in N."""
    states = _imposed(times, pressure)
    return moved(model, states, load, start, steps=steps_for(times, step), since=0.0, mass=mass).contraction


def step_response(
    model: Model, *, load: Any, pressure: Any, times: Any, start: Any = 0.0, mass: Any = None, step: float = STEP
) -> jax.Array:
    """Contraction at `times` (s, not traced) under an imposed `pressure` (Pa, one per time), free from the first time.

    With the effect `supply_lag` in the model the pressure is that of the port, else that in the muscle.
    """
    steps = steps_for(np.asarray(times) - np.min(times), step)
    return moved(model, _imposed(times, pressure), load, start, steps=steps, mass=mass).contraction


def steps_for(times: Any, step: float = STEP) -> int:
    """How many steps of at most `step` seconds lead from 0 to the last of these times."""
    return max(math.ceil(float(np.max(times)) / step - 1e-9), 1)


def _imposed(times: Any, pressure: Any) -> State:
    time = jnp.asarray(times, dtype=float)
    return State(jnp.zeros_like(time), jnp.broadcast_to(jnp.asarray(pressure, dtype=float), time.shape), time=time)


def _rig(
    model: Model, time: jax.Array, imposed: tuple[jax.Array, ...], begin: jax.Array, steps: ArrayLike, room: int
) -> Rig:
    step = jnp.maximum(time[-1] - begin, 0.0) / steps
    step = jnp.where(step > 0, step, 1.0)  # nothing is asked of a run without duration but where it begins
    grid = begin + step * jnp.arange(room + 1)
    pressure, load, mass = (jnp.broadcast_to(each, time.shape) for each in imposed)
    waiting = jnp.minimum(time, begin)
    whole = jnp.concatenate([waiting, grid])
    pressure = model.show(jnp.interp(whole, time, pressure), whole, "pressure")
    held = State(jnp.zeros_like(waiting), pressure[: len(time)], time=waiting)
    load, mass = (jnp.interp(grid, time, each) for each in (load, mass))
    return Rig(model, held, begin, step, pressure[len(time) :], load, jnp.maximum(mass, LEAST_MASS))


def _at_rest(rig: Rig, start: jax.Array) -> Motion:
    """The muscle when it is let go: memories have seen what was before, held at `start`."""
    state = rig.state(jnp.zeros_like(start), start, jnp.zeros_like(start))
    held = rig.waiting.replace(contraction=jnp.broadcast_to(start, rig.waiting.time.shape))
    zero = jnp.zeros_like(held.time)
    held = held.replace(rate=zero, pressure_rate=zero, stretch=zero, stretch_rate=zero)
    first = jax.tree.map(lambda a: a[0], held)
    memories = rig.model.start_memories(first)
    if not jax.tree.leaves(memories):
        return Motion(start, jnp.zeros_like(start), memories, None, jnp.ones_like(start))

    def wait(carry: tuple[Memories, State], after: State) -> tuple[tuple[Memories, State], None]:
        memories, before = carry
        return (rig.model.advance_memories(memories, before, after), after), None

    (memories, _), _ = jax.lax.scan(wait, (memories, first), held)
    return Motion(start, jnp.zeros_like(start), memories, state, jnp.ones_like(start))


def _on_grid(values: jax.Array, k: jax.Array) -> tuple[jax.Array, jax.Array]:
    """Value at k, and its change over the step that k lies in."""
    first = jnp.clip(jnp.floor(k).astype(int), 0, len(values) - 2)
    change = values[first + 1] - values[first]
    return values[first] + (k - first) * change, change


def _between(
    begins: tuple[jax.Array, jax.Array], ends: tuple[jax.Array, jax.Array], step: jax.Array, k: jax.Array
) -> tuple[jax.Array, jax.Array]:
    """Place and rate at k steps: cubic Hermite interpolation between the begin and the end (place, rate) of each."""
    first = jnp.clip(jnp.floor(k).astype(int), 0, len(ends[0]) - 1)
    (a, p), (b, q) = ((place[first], rate[first] * step) for place, rate in (begins, ends))
    s, rise = k - first, b - a
    square, cube = 3 * rise - 2 * p - q, p + q - 2 * rise
    return a + s * (p + s * (square + s * cube)), (p + s * (2 * square + 3 * s * cube)) / step
