"""Designs under uncertainty: what comes of one when dimensions scatter in manufacture and models are not known exactly.

Draws are fixed beforehand, so that everything stays a smooth function of the design.
"""

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from scipy.stats import norm, qmc

from mckibben_jax.design import merit
from mckibben_jax.design.best import Design, Limit, Task, search_of, settle, wanted_of, with_values
from mckibben_jax.model import Model
from mckibben_jax.muscle import Muscle

DRAWS = 512
SLACK = 1e-6  # of a limit, as a search leaves it


@dataclass(frozen=True)
class Scatter:
    """Muscles that come of one design: deviations of dimensions (SI, to be added), parameters of effects by full name.

    One entry per draw in each; draws of several belong together.
    """

    dimensions: dict[str, np.ndarray]
    parameters: dict[str, np.ndarray] = field(default_factory=dict)


@dataclass(frozen=True)
class Odds:
    """What comes of a design: mean and 5 % to 95 % of the objective, how often each limit holds, and all of them."""

    mean: float
    q05: float
    q95: float
    holds: tuple[float, ...]
    all_hold: float
    draws: int


def scatter_of(
    tolerances: dict[str, float], draws: dict[str, np.ndarray] | None = None, count: int = DRAWS, seed: int = 0
) -> Scatter:
    """Dimensions spread evenly and independently within +- their tolerance, and `count` draws of a posterior."""
    spread = qmc.Sobol(max(len(tolerances), 1), seed=seed).random(count)  # type: ignore[call-arg]
    dimensions = {name: (2 * spread[:, i] - 1) * width for i, (name, width) in enumerate(tolerances.items())}
    length = len(next(iter(draws.values()))) if draws else 1
    chosen = np.random.default_rng(seed).integers(length, size=count)
    return Scatter(dimensions, {name: np.asarray(values)[chosen] for name, values in (draws or {}).items()})


def scattered(task: Task, scatter: Scatter) -> Callable[[Any], jax.Array]:
    """The quantities of a task, as a function of the design, for all muscles that come of it: (draw, quantity)."""
    wanted = wanted_of(task)

    def one(muscle: Muscle, deviations: dict[str, jax.Array], parameters: dict[str, jax.Array]) -> jax.Array:
        moved = {name: getattr(muscle, name) + deviation for name, deviation in deviations.items()}
        given = merit.built(dataclasses.replace(muscle, **moved), task.effects)
        return merit.evaluate(_with(given, parameters), wanted)

    drawn = jax.tree.map(jnp.asarray, (scatter.dimensions, scatter.parameters))
    return lambda values: jax.vmap(one, (None, 0, 0))(with_values(task, values), *drawn)


def _with(given: Model, parameters: dict[str, jax.Array]) -> Model:
    for full, value in parameters.items():
        effect, name = full.split(".")
        index = given.names.index(effect)
        given = eqx.tree_at(lambda m, i=index, n=name: getattr(m.effects[i], n), given, value)
    return given


def one_sided(task: Task) -> Task:
    """The same task, every constraint with one limit."""
    sides = [Limit(c.quantity, c.at, min=c.min) for c in task.constraints if c.min is not None]
    sides += [Limit(c.quantity, c.at, max=c.max) for c in task.constraints if c.max is not None]
    return dataclasses.replace(task, constraints=tuple(sides))


def cautious(task: Task, scatter: Scatter, chance: float) -> Callable[[Any], jax.Array]:
    """Mean of the objective, and each constrained quantity moved towards its limit by some standard deviations.

    As many as make `chance` for a normal quantity: a smooth stand-in for a quantile. How often a limit then holds is
    counted (`odds`). Constraints have one limit each (`one_sided`).
    """
    every, apart = scattered(task, scatter), float(norm.ppf(chance))
    ways = jnp.array([0.0, *(-apart if c.max is None else apart for c in task.constraints)])

    def law(values: Any) -> jax.Array:
        found = every(values)
        tiny = (1e-9 * jnp.mean(found, axis=0)) ** 2  # the root has a slope where nothing scatters
        return jnp.mean(found, axis=0) + ways * jnp.sqrt(jnp.var(found, axis=0) + tiny)

    return law


def design_cautiously(task: Task, scatter: Scatter, chance: float = 0.5) -> Design:
    """The design whose objective is best on average, every limit holding with this chance."""
    task = one_sided(task)
    with jax.enable_x64(True):
        return settle(task, search_of(task, cautious(task, scatter, chance)))


def odds(task: Task, muscle: Muscle, scatter: Scatter) -> Odds:
    """How a design fares among the muscles that come of it."""
    with jax.enable_x64(True):
        values = jnp.asarray([getattr(muscle, name) for name in task.variables])
        found = np.asarray(jax.jit(scattered(task, scatter))(values))
    met = [_holds(c, found[:, row]) for row, c in enumerate(task.constraints, 1)]
    q05, q95 = np.quantile(found[:, 0], (0.05, 0.95))
    together = float(np.all(met, axis=0).mean()) if met else 1.0
    mean = float(found[:, 0].mean())
    return Odds(mean, float(q05), float(q95), tuple(float(m.mean()) for m in met), together, len(found))


def _holds(c: Limit, values: np.ndarray) -> np.ndarray:
    low, high = (-np.inf if c.min is None else c.min), (np.inf if c.max is None else c.max)
    return (values >= low - SLACK * abs(low)) & (values <= high + SLACK * abs(high))
