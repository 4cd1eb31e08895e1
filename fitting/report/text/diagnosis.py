"""A diagnosis: the verdict, how sure it is, and the evidence for each effect."""

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from rich.console import RenderableType
from rich.text import Text

from fitting import showing
from fitting.diagnosis.flip_groups import rests_on_in_words, too_few_to_flip
from fitting.diagnosis.outcomes import Reason, Verdict, Why
from fitting.diagnosis.record import Diagnosis, Evidence, Explanation
from fitting.recordings.records import FORCE_TESTS, MOVING_TESTS, Experiment
from fitting.report.settings import ADVICE, SHOWN
from fitting.report.text.amounts import amount, percent
from fitting.report.text.evidence import named_explanations, named_sets, sort_evidence
from fitting.report.text.instrument_answers import asked_texts, explaining_text, odd_run_texts, rival_texts
from fitting.report.text.layout import columns, line, lines, spaced
from fitting.report.text.limits import limits_lines, open_text, would_have_shown
from fitting.report.text.measurement import pull_text, purpose_text, what_text
from fitting.report.text.names import identifiers, listed, mark, marked
from fitting.report.text.reasons import why_text
from fitting.report.text.untried import untried_texts
from fitting.showing import counted
from fitting.study.preview import MOST

if TYPE_CHECKING:
    from fitting.comparison.compare import Comparison
    from fitting.planning.next_measurement import NextMeasurement

SOME = 0.05  # of the squared error: what takes away less is not told
UNDECIDED = "These data cannot say whether something is missing"
FOUND = ("missing", "one of", "not in the library")


def effect_set(names: Sequence[str]) -> str:
    """A set of effects for people."""
    return marked(names, " + ") if names else "nothing"


def classes_text(group: Sequence[Sequence[str]]) -> str:
    """Sets of effects that predict the same, for people."""
    return " = ".join(marked(names, " + ") for names in group)


def values_text(e: Explanation) -> str:
    """The numbers of an explanation, each with its robust standard error."""
    return "; ".join(
        f"{mark(name)} = {showing.show(value, unit, error)}" for name, (value, error, unit) in e.estimate.items()
    )


def most_similar(e: Evidence) -> str:
    """The effect whose mark is most like this one's; empty where none is."""
    return max(e.similar, key=lambda name: e.similar[name], default="")


def remark(e: Evidence) -> str:
    """What is to be said of an effect beside its numbers.

    What cannot be seen where it is small may still lower the error much where it is large.
    """
    if e.why is not None and e.why.reason is Reason.NOT_SEEN:
        return "a small amount of it would not show"
    return why_text(e.why, e.unexplained) or ("explains the data" if e.adequate else "")


def verdict_text(d: Diagnosis) -> str:
    """The verdict in one sentence, and whether what is missing matters."""
    size = " It is small: below half a per cent of full scale." if d.verdict in FOUND and d.negligible else ""
    return _verdict(d) + size


def headline_text(d: Diagnosis) -> str:
    """The verdict for a headline: where nothing is decided without the reason, which may be a long list."""
    return f"{UNDECIDED}." if _is_undecided(d) else verdict_text(d)


def undecided_text(d: Diagnosis) -> str:
    """Why nothing is decided, as a sentence of its own; empty where something is."""
    why = _undecided(d.why) if _is_undecided(d) else ""
    return f"{why[:1].upper()}{why[1:]}." if why else ""


def _is_undecided(d: Diagnosis) -> bool:
    return d.verdict == Verdict.INCONCLUSIVE and not d.is_strained


def _verdict(d: Diagnosis) -> str:
    sets = [effect_set(names) + _in_place_of(d, names) for names in d.explanations]
    if d.verdict == "nothing detectable":
        return "Nothing is missing that these data could show."
    if d.is_strained:
        return (
            "Nothing rejects this model, but errors of the instruments explain its misfit only if one of them errs by "
            "more than three times its accuracy. Do not believe it before that is checked."
        )
    if d.verdict == "within the instruments":
        return "Errors of the instruments within their accuracy explain all of the misfit."
    if d.verdict == "missing":
        names = d.explanations[0]
        return f"{effect_set(names)} {'is' if len(names) == 1 else 'are'} missing{_in_place_of(d, names)}."
    if d.verdict == "one of":
        return f"One of these is missing, and these data cannot tell which (the likeliest first): {'; '.join(sets)}."
    if d.verdict == "not in the library":
        return "Something is missing, and no effect of the library explains all of it."
    return f"{UNDECIDED}: {_undecided(d.why) or 'too little shows'}."


def _in_place_of(d: Diagnosis, names: Sequence[str]) -> str:
    """Which effects of the model these would replace: a model has one rubber, and one friction of the strands."""
    gone = next((e.replaces for e in d.tried if e.effects == tuple(names)), ())
    return f" in place of {marked(gone)}" if gone else ""


def _undecided(why: Why | None) -> str:
    """Why nothing is decided; of many faint effects the first few, for OPEN lists all of them."""
    if why is None or why.reason is not Reason.FAINT or len(why.names) <= SHOWN.named:
        return why_text(why)
    more = len(why.names) - SHOWN.named
    return f"{why_text(replace(why, names=why.names[: SHOWN.named]))} and {more} more"


def leading_text(d: Diagnosis, unit: str = "N") -> str | None:
    """What removes most of the error, whatever the verdict; None where next to nothing is removed or missing."""
    if d.leading is None or (d.verdict not in FOUND and d.leading.share < SOME):
        return None
    lead = d.leading
    names = marked(lead.effects, " or ")
    left = f"{amount(d.held_out_rmse, unit)} -> {amount(lead.held_out_rmse, unit)} on held-out runs"
    most = f"{names} lowers the error more than any other single effect that contradicts no measured size"
    most = f"Mostly {names}" if lead.share > MOST else most
    return f"{most}: {left}; it removes {percent(lead.share)} of the squared error.{_beside_verdict(d, lead.effects)}"


def _beside_verdict(d: Diagnosis, leading: tuple[str, ...]) -> str:
    """What keeps a leading effect from being read as a second verdict, where the verdict does not name it."""
    if d.verdict not in FOUND:
        return " But these data do not prove that it is there."
    if d.explanations and not any((name,) in d.explanations for name in leading):
        return " But the verdict names another explanation."
    return ""


def p_value_text(d: Diagnosis) -> str:
    """The p-value of the test that nothing is missing, and what was flipped."""
    basis = rests_on_in_words(d.rests_on)
    name = "test" if too_few_to_flip(d.rests_on) else "sign-flip test"
    test = f"p = {d.p_value:.2g} in the {name} that nothing is missing (level {d.level:g}; {basis})."
    unseen = d.verdict in FOUND and d.p_value >= d.level
    return test + (" The test does not reject, but the error is many times the noise." if unseen else "")


def left_missing_text(p_value: float | None, level: float) -> str:
    """What the test says of a model that was not diagnosed itself."""
    if p_value is None:
        return "The chosen model was not tested: diagnose it to learn what is missing from it."
    what = "finds nothing missing any more" if p_value >= level else "still finds something missing"
    return f"In the chosen model the sign-flip test {what} (p = {p_value:.2g}, level {level:g})."


def samples_text(d: Diagnosis, whole: "Comparison | None") -> list[str]:
    """Which samples the errors of a diagnosis are of, where these are not all, and the error over the whole."""
    seen, samples = len(d.baseline.samples), 0 if whole is None else len(whole.fit.samples)
    if whole is None or seen >= samples:
        return []
    runs = len(np.unique(d.baseline.samples.run))
    return [
        f"The errors of the diagnosis, and all on held-out runs, are those of {seen:,} samples of "
        f"{counted(runs, 'run')}, taken evenly from the {samples:,}: these suffice to decide.{_over_all(d, whole)}"
    ]


def _over_all(d: Diagnosis, whole: "Comparison") -> str:
    """The error of the model over these samples and over all, where both are of measured forces."""
    if not np.all(whole.fit.problem.of_force(whole.fit.samples)):
        return ""
    errors = amount(d.rmse, whole.unit), amount(whole.rmse, whole.unit)
    return f" The error of the model as it is, {errors[0]} over these, is {errors[1]} over all samples."


def substitutes_text(d: Diagnosis) -> list[str]:
    """What these data cannot tell from an effect that the model has."""
    found: dict[str, list[str]] = {}
    for mine, other in d.substitutes:
        found.setdefault(mine, []).append(other)
    return [
        f"{marked(others, ' or ')} could take the place of {mark(mine)}: these data cannot tell which of them acts."
        for mine, others in found.items()
    ]


def measurement_text(planned: "NextMeasurement") -> list[str]:
    """What to record next and why, and how surely it decides."""
    often = f"It separates them with a power of {percent(planned.power)}"
    if planned.power < ADVICE.hopeless:
        often += "; no other recording that was tried has more"
    return [
        text for text in (f"{what_text(planned)}: {purpose_text(planned)}.", f"{often}.", pull_text(planned)) if text
    ]


def motion_notes(d: Diagnosis, experiments: Sequence[Experiment]) -> list[str]:
    """What errors are of, where motions were read as force; where these show nothing, that the motions may."""
    tests = {recording.test for each in experiments for recording in each.recordings}
    if not tests & {*MOVING_TESTS}:
        return []
    both = "the errors of the effects include motions read as force; the error after ERROR is of measured forces alone"
    coarse = (
        "a motion read as force is far noisier than the motion itself: 'mckibben compare' gives the error in the "
        "motions, 'mckibben add DATASET EFFECT' shows whether an effect that you suspect lowers it"
    )
    return [both] * bool(tests & {*FORCE_TESTS}) + [coarse] * (d.verdict not in FOUND)


def diagnosis_report(d: Diagnosis, unit: str = "N", whole: "Comparison | None" = None) -> list[RenderableType]:
    """The verdict, what it rests on, and the evidence for each effect; `whole`: the same model beside all data."""
    shown: list[RenderableType] = [line("VERDICT", verdict_text(d), "bold")]
    leading = leading_text(d, unit)
    shown += [line("LEADING", leading)] if leading else []
    shown.append(line("TEST", p_value_text(d)))
    shown += lines("SAMPLES", samples_text(d, whole))
    shown += lines("CHECK", [*untried_texts(d), *odd_run_texts(d), *asked_texts(d)])
    shown += lines("LIKELY", [text for text in (explaining_text(d, unit),) if text])
    shown += lines("OR", [*rival_texts(d), *substitutes_text(d)])
    shown += lines("LIMITS", limits_lines(d, unit))
    shown += lines("OPEN", [text] if (text := open_text(d, unit)) else [])
    shown += lines("SIMILAR", (f"{classes_text(group)}: these data cannot tell them apart" for group in d.classes))
    shown += lines("VALUES", (values_text(e) for e in named_explanations(d)[: SHOWN.valued] if e.estimate))
    shown += lines("NEAREST", (_nearest_text(e, unit) for e in d.nearest))
    return [*shown, *_evidence(d, unit)]


def _evidence(d: Diagnosis, unit: str) -> list[RenderableType]:
    """The effects that help, in a table; the others by name."""
    helping, idle, blind = sort_evidence(d)
    heads = ("effect added", "unexplained", "RMS", "held out", "smallest detectable", "most similar", "")
    table = columns(*heads, words=(0, 5, 6), spare=(5, 4, 2))
    several = named_sets(d)
    for e in several:
        values = (amount(value, unit) for value in (e.unexplained, e.rmse, e.held_out_rmse))
        table.add_row(effect_set(e.effects), *values, "", "", "explain the data", style="bold")
    for e in helping:
        table.add_row(mark(e.name), *_evidence_cells(e, unit), style="bold" if e.adequate else "")
    now = f"by the model as it is {amount(d.unexplained, unit, 2)}"
    about = f"unexplained is what neither noise nor instruments within their accuracy can make of the misfit: {now}."
    shown = [spaced(table), line("", about), Text()] if helping or several else []
    named = {name for names in d.explanations for name in names}
    near = {name for e in d.nearest for name in e.effects}
    told = {*d.faint, *named, *near, *(name for _, names in would_have_shown(d, unit) for name in names)}
    others = listed([e.name for e in idle if e.name not in told])
    shown += [line("NOT IT", f"{others}: {_idle_text(d)}")] if others else []
    return [*shown, *lines("UNSEEN", (f"{listed(names)}: {why}" for why, names in blind.items()))]


def _nearest_text(e: Explanation, unit: str) -> str:
    """What a set leaves that does not explain the data, and why it does not: it may need an absurd instrument."""
    left = f"{amount(e.rmse, unit)}, of which {amount(e.unexplained, unit, 2)} is unexplained"
    why = "" if e.why is None or e.why.reason is Reason.FAR_WORSE else f"; {why_text(e.why, e.unexplained)}"
    return f"{effect_set(e.effects)}: {left}{why}"


def _idle_text(d: Diagnosis) -> str:
    """Why effects are said not to be it."""
    if d.p_value < d.level:
        return "alone none of them explains a tenth of it"
    return "alone none of them lowers the error on held-out runs"


def _evidence_cells(e: Evidence, unit: str) -> tuple[str, ...]:
    """The cells behind the name of an effect; in these narrow columns others have their identifiers alone."""
    alike, note = most_similar(e), identifiers(remark(e))
    values = (amount(value, unit) for value in (e.unexplained, e.rmse, e.held_out_rmse))
    return *values, amount(e.detection_limit, unit), f"{alike} {e.similar[alike]:.2f}" if alike else "", note
