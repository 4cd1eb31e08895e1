"""The steps of a study: how the error fell from model to model."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np

from fitting.comparison.compare import Comparison
from fitting.diagnosis.findings import Attempt
from fitting.diagnosis.record import Diagnosis


@dataclass(frozen=True)
class Stage:
    """One step of a study: how its model differs, the error then, the verdict there, and what the model missed where.

    `label` names a model that was not made of the one before it; else `added` and `dropped` are names of effects.
    `comparison` is this model beside the data, where it was fitted to all of them; `diagnosis` is what was missing from
    it, where it was diagnosed itself; `p_value` is of the test that nothing is missing from it, where that was tested.
    `attempts` are the larger models that a discovery tried after this one and did not keep; `held` are stated sizes of
    the muscle that it holds since this step; `freed` says that it holds none any more. `strained`: instruments explain
    its misfit only by errors far beyond their accuracy. `exchanged`: what was added explains the readings better
    than what was dropped for it.
    """

    label: str
    rmse: float
    held_out_rmse: float | None
    verdict: str = ""
    comparison: Comparison | None = field(default=None, compare=False, repr=False)
    attempts: tuple[Attempt, ...] = ()
    held: tuple[str, ...] = ()
    added: tuple[str, ...] = ()
    dropped: tuple[str, ...] = ()
    strained: bool = False
    diagnosis: Diagnosis | None = field(default=None, compare=False, repr=False)
    p_value: float | None = None
    freed: bool = False
    exchanged: bool = False

    @property
    def confines_alone(self) -> bool:
        """Whether its model differs only in that stated sizes are confined."""
        return bool(self.held) and not self.added and not self.dropped

    @property
    def residual(self) -> np.ndarray | None:
        """Model minus measurement of every sample that carries weight, in the recording's unit, where it is known."""
        return None if self.comparison is None else self.comparison.fit.residual


def added_by(stages: Iterable[Stage]) -> tuple[str, ...]:
    """What the last of these models has that the first had not: what was added, less what was dropped after that."""
    here: list[str] = []
    for stage in stages:
        here = [name for name in here if name not in stage.dropped] + list(stage.added)
    return tuple(here)


def begin_of_fall(stages: Sequence[Stage]) -> int:
    """The place of the step from which the error fell: the first, or the last that only confines sizes of the muscle.

    Before that step the sizes stood in for what was missing, and the error was too small.
    """
    return max((at for at, stage in enumerate(stages) if stage.confines_alone), default=0)
