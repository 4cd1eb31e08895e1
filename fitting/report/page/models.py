"""The models that one page shows: each with its own errors, test and diagnosis, so that no two of them are mixed."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fitting.comparison.compare import Comparison
from fitting.diagnosis.record import Diagnosis
from fitting.report.text.names import marked
from fitting.report.text.stages import stage_text
from fitting.study.stages import Stage


@dataclass(frozen=True)
class ShownModel:
    """One model of the study. `is_preview`: the page is of an earlier model, and this one shows what would come of it.

    `stages` are the steps up to this model, itself the last; `diagnosis` is what was missing from it, if it was
    diagnosed itself.
    """

    number: int
    stages: tuple[Stage, ...]
    comparison: Comparison
    diagnosis: Diagnosis | None
    is_preview: bool = False

    @property
    def stage(self) -> Stage:
        """The step that made this model."""
        return self.stages[-1]

    @property
    def effects(self) -> tuple[str, ...]:
        """The names of its effects."""
        return self.comparison.fit.layout.templates[0].names

    @property
    def residual(self) -> np.ndarray:
        """Model minus measurement of every sample that carries weight, in the recording's unit."""
        return self.comparison.fit.residual

    @property
    def p_value(self) -> float | None:
        """Of the test that nothing is missing from this model; None where that was not tested."""
        return self.stage.p_value if self.diagnosis is None else self.diagnosis.p_value


def models_of(
    c: Comparison, d: Diagnosis | None = None, stages: Sequence[Stage] = (), chosen: int = -1
) -> list[ShownModel]:
    """Every step of the study, if all are known on the same samples; else the model of the comparison alone.

    `chosen` is the step that the page is of, counted as in a list.
    """
    if not _all_known(c, stages):
        return [ShownModel(0, tuple(stages) or (_alone(c, d),), c, d)]
    own = tuple(_of_all_samples(stage) for stage in _with_diagnosis(stages, d))
    first_preview = range(len(own))[chosen] + 1
    return [ShownModel(k, own[: k + 1], s.comparison or c, s.diagnosis, k >= first_preview) for k, s in enumerate(own)]


def _all_known(c: Comparison, stages: Sequence[Stage]) -> bool:
    known = [stage.residual for stage in stages]
    return bool(known) and all(r is not None and len(r) == len(c.fit.residual) for r in known)


def _of_all_samples(stage: Stage) -> Stage:
    """The step with its error over all samples, as everywhere on the page; a diagnosis may have looked at fewer."""
    return stage if stage.comparison is None else replace(stage, rmse=stage.comparison.rmse)


def _alone(c: Comparison, d: Diagnosis | None) -> Stage:
    """The model of a page without a study."""
    p_value = None if d is None else d.p_value
    return Stage("model", c.rmse, None if d is None else d.held_out_rmse, comparison=c, diagnosis=d, p_value=p_value)


def _with_diagnosis(stages: Sequence[Stage], d: Diagnosis | None) -> tuple[Stage, ...]:
    """The steps; where none has a diagnosis, the last one with a verdict (or the first) has this one."""
    if d is None or any(stage.diagnosis is not None for stage in stages):
        return tuple(stages)
    owner = max((k for k, stage in enumerate(stages) if stage.verdict), default=0)
    return tuple(replace(s, diagnosis=d) if k == owner else s for k, s in enumerate(stages))


def bar_width(model: ShownModel, models: Sequence[ShownModel]) -> float:
    """How long the bar of its error is on the switch, in % of the longest."""
    return 100 * model.stage.rmse / (max(each.stage.rmse for each in models) or 1.0)


def short_name(model: ShownModel, count: int) -> str:
    """What the switch calls a model: 'before', '+ tip', 'after: + creep'."""
    if count == 1:
        return stage_text(model.stage)
    if not model.number:
        return "before"
    added = model.stage.added
    name = f"+ {marked(added, ' + ')}" if added else stage_text(model.stage)  # what gave way stands in the table
    return f"after: {name}" if model.number == count - 1 else name
