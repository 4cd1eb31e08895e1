"""Designs for several models of one muscle, where measurements cannot tell which of them is right."""

import dataclasses
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from mckibben_jax.design.best import Design, Met, Task, quantities_of, search_of, settle
from mckibben_jax.effect import Effect


@dataclass(frozen=True)
class OneSays:
    """What one model says of a design: its objective, and the constrained quantities in the task's order; SI."""

    value: float
    constrained: tuple[float, ...]


def design_for_all(task: Task, models: Sequence[tuple[Effect, ...]]) -> tuple[Design, tuple[OneSays, ...]]:
    """The design whose objective is best on average over these models, every limit kept in each of them.

    Of a constraint the design states the value in the model that comes nearest to its limit, or misses it most; what
    the limit costs is the sum over the models that it holds back. Beside the design stands what each model says of it.
    """
    everywhere = dataclasses.replace(task, constraints=task.constraints * len(models))
    with jax.enable_x64(True):
        found = settle(everywhere, search_of(everywhere, _mean_and_limits(task, models)))
        values = jnp.asarray([getattr(found.muscle, name) for name in task.variables])
        each = [np.asarray(jax.jit(_of_model(task, effects))(values)) for effects in models]
    said = tuple(OneSays(float(row[0]), tuple(map(float, row[1:]))) for row in each)
    count = len(task.constraints)
    tightest = tuple(_tightest(found.constraints[place::count]) for place in range(count))
    return dataclasses.replace(found, constraints=tightest, fighting=tuple(dict.fromkeys(found.fighting))), said


def _of_model(task: Task, effects: tuple[Effect, ...]) -> Callable[[Any], jax.Array]:
    return quantities_of(dataclasses.replace(task, effects=effects))


def _mean_and_limits(task: Task, models: Sequence[tuple[Effect, ...]]) -> Callable[[Any], jax.Array]:
    """The mean objective, then the constrained quantities of one model after the other."""
    laws = [_of_model(task, effects) for effects in models]

    def law(values: Any) -> jax.Array:
        found = jnp.stack([each(values) for each in laws])
        return jnp.concatenate([jnp.mean(found[:, :1], axis=0), found[:, 1:].ravel()])

    return law


def _tightest(mets: Sequence[Met]) -> Met:
    """How one constraint is met in the model that comes nearest to its limit, with what it costs in all of them."""
    nearest = min(mets, key=_room)
    return dataclasses.replace(
        nearest,
        active=any(met.active for met in mets),
        multiplier=sum(met.multiplier for met in mets),
        relative=sum(met.relative for met in mets),
    )


def _room(met: Met) -> float:
    """How far a quantity lies within its limits, as a share of the nearer one; below zero outside of them."""
    sides = [(met.min, 1.0), (met.max, -1.0)]
    return min((sign * (met.value - end) / (abs(end) or 1.0) for end, sign in sides if end is not None), default=np.inf)
