"""What a step of a study is called."""

from fitting.report.text.names import marked
from fitting.study.stages import Stage


def stage_text(stage: Stage) -> str:
    """'baseline', '+ tip', '+ textile_friction in place of coulomb_friction', '- tip'."""
    if stage.label:
        return stage.label
    return f"+ {added_text(stage)}" if stage.added else f"- {marked(stage.dropped, ' - ')}"


def added_text(stage: Stage) -> str:
    """The effects that were added, and those whose place they took."""
    return marked(stage.added, " + ") + (f" in place of {marked(stage.dropped)}" if stage.dropped else "")
