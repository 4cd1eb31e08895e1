"""Why an effect is not tested, not adequate or not named, and why nothing is decided, in words."""

from collections.abc import Sequence

from fitting.diagnosis.outcomes import Reason, Screened, Why
from fitting.diagnosis.record import Diagnosis
from fitting.report.text.names import marked

SENTENCES = {
    Reason.NO_FORCE: "cannot be tested: no force was measured",
    Reason.NO_NUMBER: "cannot be tested: gives no number on these data",
    Reason.NOT_FITTED: "cannot be tested",
    Reason.NOT_SEEN: "these data cannot see it beside this model",
    Reason.FAR_WORSE: "not tested: others leave far less",
    Reason.LARGE_MISFIT: "leaves many times the noise",
    Reason.MOST_LEFT: "leaves most of the error, many times the noise",
    Reason.NO_GAIN: "does not clearly lower the error on held-out runs",
    Reason.BETTERED: "one more effect brings the error far down",
    Reason.PREDICTS_WORSE: "explains the data, but predicts held-out runs worse than others",
    Reason.RIVAL_SEEN: "explains the data, but others are seen in what it leaves",
    Reason.LESS_LIKELY: "explains the data, but another is more than a hundred times likelier",
    Reason.TEST_BLIND: "an added effect lowers the error, but the test does not see that one is missing",
    Reason.FEW_LOOPS: "too few loops to flip, and the noise model alone says that something is missing",
    Reason.ONLY_MOTIONS: "these motions do not show a break-away or a standstill: record a loop as well",
}
SETS = {2: "pairs", 3: "triples"}


def _needed(names: Sequence[str]) -> str:
    """What an effect needs and where it comes from: other effects bring rubber and friction, sizes are stated."""
    brought = [name for name in names if name in ("rubber", "friction")]
    stated = [name for name in names if name not in brought]
    places = ((brought, "in the model"), (stated, "in muscle.toml"))
    return " and ".join(f"{' and '.join(some)} {place}" for some, place in places if some)


def why_text(why: Why | None, unexplained: float | None = None) -> str:
    """A reason as part of a sentence; empty where there is none.

    `unexplained` is what a set leaves beyond noise and instruments: where that is nothing, nothing large is missing.
    """
    if why is None:
        return ""
    names = marked(why.names)
    about = {
        Reason.NEEDS: f"cannot be tested: needs {_needed(why.names)}",
        Reason.AT_BOUND: f"{names} ends at its bound",
        Reason.CONTRADICTS: f"contradicts what was measured: {names}",
        Reason.UNBELIEVED: f"needs an instrument that is off by more than a tenth of full scale: {names}",
        Reason.UNTOLD: f"beside the others these data do not determine {names}",
        Reason.SPECIAL_CASE: f"explains the data, and so does its special case {marked(why.names, ' + ')}",
        Reason.FEW_READINGS: f"{why.readings} readings cannot judge a model with {why.fitted} fitted numbers: "
        "record more",
        Reason.FAINT: f"only a large amount of each of these would show: {names}",
    }
    if why.p_value is not None:
        said = "something is still missing" if unexplained != 0 else "what is left is small, but too alike for chance"
        return f"{said} (p = {why.p_value:.2g})"
    return about.get(why.reason) or SENTENCES[why.reason]


def notes_of(d: Diagnosis) -> list[str]:
    """Why nothing is decided, how many sets were refitted, and what reading the data noted."""
    return [*([why_text(d.why)] if d.why else []), *map(screened_text, d.screened), *d.notes]


def screened_text(screened: Screened) -> str:
    """How many pairs or triples were fitted, of how many; or why none was."""
    if not screened.refitted:
        return f"no {SETS[screened.size]} refitted: in a linear look all effects together leave much of the misfit"
    sets = f"{screened.refitted} of {screened.possible:,} {SETS[screened.size]}"
    return f"{sets} refitted, the rest pruned by a linear look"
