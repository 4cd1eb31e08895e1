"""What a model comes to for somebody who uses the muscle: the share of full scale that it leaves unexplained."""

from collections.abc import Sequence
from dataclasses import dataclass

from fitting.comparison.compare import Comparison
from fitting.diagnosis.step_rules import RULES
from fitting.study.stages import Stage, added_by

ENOUGH = RULES.enough  # of full scale


@dataclass(frozen=True)
class Practice:
    """What was added, and the errors that are left as shares of full scale; `enough` is what its user needs."""

    added: tuple[str, ...]
    left: float
    held_out: float | None  # None where no run was held out
    enough: float
    verdict: str  # on the last model; empty where none was asked for
    strained: bool = False  # as of `Stage`

    @property
    def is_enough(self) -> bool:
        """Whether less is left than its user needs."""
        return self.left < self.enough


def practice(stages: Sequence[Stage], c: Comparison, enough: float = ENOUGH) -> Practice:
    """Of the last of these stages, which is the model of the comparison."""
    last = stages[-1]
    held_out = None if last.held_out_rmse is None else last.held_out_rmse / c.full_scale
    return Practice(added_by(stages), c.rmse / c.full_scale, held_out, enough, last.verdict, last.strained)
