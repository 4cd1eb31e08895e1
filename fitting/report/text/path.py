"""What may be said of the whole path of a discovery, not of one step alone."""

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

from fitting.report.text.instrument_answers import asked_of_added_texts
from fitting.report.text.stages import added_text
from fitting.study.stages import Stage


def path_texts(stages: Sequence[Stage]) -> list[str]:
    """How often a path adds to a model that lacks nothing; nothing to say where none was added.

    A path goes too far only where it adds to its first complete model, and has to reject that one first: the level of
    one test holds for all steps together (sequential rejection: Goeman & Solari 2010, Ann. Stat. 38:3782).
    """
    level, additions = _level(stages), _additions(stages)
    if level is None or not additions:
        return []
    other = [(before, after) for before, after in additions if not _is_rejected(before)]
    every = "What was added came" if len(additions) == 1 else "Everything that was added came"
    if not other:
        return [
            f"{every} to a model that the test rejects (level {level:g}). Of models that lack nothing it rejects at "
            f"most {100 * level:g} in 100: so often is anything added to a complete model, by all steps together."
        ]
    return [
        f"The model to which {added_text(after)} was added is not rejected by the test (level {level:g}): "
        f"{_why_added_to(before)}. No chance of error can be stated for that step."
        for before, after in other
    ]


def _why_added_to(stage: Stage) -> str:
    """Why a discovery looks on beyond a model that the test does not reject."""
    if stage.strained:
        return "it was added because instruments alone would have to err by far more than their accuracy"
    return "it was added because it lowers the error on held-out runs"


def blamed_on_the_way(stages: Sequence[Stage]) -> list[str]:
    """What the effects that were added ask of instruments, beyond what these may err by."""
    return [
        text
        for before, after in pairwise(stages if all(stage.diagnosis for stage in stages) else ())
        if before.diagnosis is not None and after.added
        for text in asked_of_added_texts(before.diagnosis, after.added)
    ]


def path_result(stages: Sequence[Stage]) -> dict[str, Any]:
    """The same for machines: the level, how many times something was added, and how often after a rejection."""
    additions = _additions(stages)
    return {
        "path": {
            "level": _level(stages),
            "additions": len(additions),
            "after_rejection": sum(_is_rejected(before) for before, _ in additions),
        }
    }


def _level(stages: Sequence[Stage]) -> float | None:
    return next((stage.diagnosis.level for stage in stages if stage.diagnosis is not None), None)


def _additions(stages: Sequence[Stage]) -> list[tuple[Stage, Stage]]:
    """Every step that added something, after the step before it; of a discovery alone. An exchange adds nothing."""
    if any(stage.diagnosis is None for stage in stages):
        return []
    return [(before, after) for before, after in pairwise(stages) if after.added and not after.exchanged]


def _is_rejected(stage: Stage) -> bool:
    diagnosis = stage.diagnosis
    return diagnosis is not None and stage.p_value is not None and stage.p_value < diagnosis.level
