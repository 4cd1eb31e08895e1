"""What a step of a study is called."""

from fitting.study.stages import Stage


def stage_text(stage: Stage) -> str:
    """'baseline', '+ tip', '+ textile_friction in place of coulomb_friction', '- tip'."""
    if stage.label:
        return stage.label
    return f"+ {added_text(stage)}" if stage.added else f"- {' - '.join(stage.dropped)}"


def added_text(stage: Stage) -> str:
    """The effects that were added, and those whose place they took."""
    return " + ".join(stage.added) + (f" in place of {', '.join(stage.dropped)}" if stage.dropped else "")
