"""What a discovery is made of: the models on its way, and the steps that are told."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fitting.diagnosis.findings import Attempt
from fitting.diagnosis.record import Diagnosis
from fitting.diagnosis.search import Search
from fitting.diagnosis.universe import Universe
from mckibben_jax.effect import Effect


@dataclass(frozen=True)
class Step:
    """One model on the way: how it differs from the one before it, its errors (N), and what is said of it.

    `added` are names of effects, "baseline" first; `dropped` those whose place they took, or, where nothing was added,
    those that are not needed any more. `attempts` are the larger models that were tried after this one, in their order,
    and not kept.
    """

    added: tuple[str, ...]
    rmse: float
    held_out_rmse: float
    verdict: str
    diagnosis: Diagnosis
    attempts: tuple[Attempt, ...] = ()
    held: tuple[str, ...] = ()  # stated sizes of the muscle that are confined since this step
    dropped: tuple[str, ...] = ()
    freed: bool = False  # no stated size is confined any more
    exchanged: bool = False  # what was added explains the readings better than what was dropped

    @property
    def effect(self) -> str:
        """What was added, as one name."""
        return "+".join(self.added)


OnStep = Callable[[Step], None]


@dataclass(frozen=True, eq=False)
class ModelOnTheWay:
    """How a model differs from the one before it, all its effects, its search, and the stated sizes that it confines.

    `held` are those that it is the first to confine; `freed` says that it confines none any more.
    """

    added: tuple[str, ...]
    present: list[Effect]
    search: Search
    held: tuple[str, ...] = ()
    dropped: tuple[str, ...] = ()
    freed: bool = False
    exchanged: bool = False

    def step(self, found: Diagnosis, attempts: tuple[Attempt, ...] = ()) -> Step:
        """The step that ends at this model."""
        errors, how = (found.rmse, found.held_out_rmse), (self.held, self.dropped, self.freed, self.exchanged)
        return Step(self.added, *errors, found.verdict, found, attempts, *how)


def values_of(world: Universe, vector: np.ndarray) -> dict[str, float]:
    """Values by full name, SI, from a vector of all unknowns."""
    return dict(zip(world.layout.names, map(float, vector), strict=True))
