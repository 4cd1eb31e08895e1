"""What a discovery comes to for somebody who uses the muscle: how much of full scale is left unexplained."""

from collections.abc import Sequence

from fitting.diagnosis.outcomes import NOTHING_MISSING, Verdict
from fitting.report.text.amounts import percent
from fitting.study.stages import Stage

ENOUGH = 0.01  # of full scale: what most users of a muscle need; chosen


def practice_text(stages: Sequence[Stage], rmse: float, full_scale: float) -> str:
    """What was added explains all but so much of full scale, whether that is little, and what the rest is."""
    added = [name for stage in stages for name in stage.added]
    who = " + ".join(added) if added else "The model"
    verb = "explain" if len(added) > 1 else "explains"
    share, held_out = rmse / full_scale, stages[-1].held_out_rmse
    outside = "" if held_out is None else f" ({percent(held_out / full_scale)} on held-out runs)"
    size = "below" if share < ENOUGH else "above"
    rest = f" {_rest(stages[-1].verdict)}" if stages[-1].verdict else ""
    return f"{who} {verb} all but {percent(share)} of full scale{outside}, which is {size} {percent(ENOUGH)}.{rest}"


def _rest(verdict: str) -> str:
    if verdict == Verdict.NOT_IN_LIBRARY:
        return "What remains follows no effect of the library."
    if verdict == Verdict.WITHIN_INSTRUMENTS:
        return "What remains is within what the instruments may err by."
    return (
        "In what remains these data show nothing more."
        if verdict in NOTHING_MISSING
        else "What remains is not decided by these data."
    )
