"""A self-test in words: from which size each effect is found in these recordings, and what it is taken for."""

from collections.abc import Mapping, Sequence
from typing import Any

from rich.console import RenderableType

from fitting import showing
from fitting.diagnosis.outcomes import NOTHING_MISSING, Verdict
from fitting.report.text.amounts import amount
from fitting.report.text.diagnosis import effect_set
from fitting.report.text.layout import columns, line, lines, spaced
from fitting.report.text.names import listed, mark
from fitting.selftest.record import Outcome, SelfTest, Sought, Trial
from fitting.selftest.settings import SELFTEST
from fitting.showing import counted

MEANS = (
    "Each effect was hidden in these recordings as they were made: the same lengths and pressures, the same noise, "
    "instruments as accurate as stated or presumed. The truth was the model at its fit with this one effect more, so "
    "that errors of the program's own laws do not show. Sizes are what the effect leaves when the model has given "
    "way to it. One draw of the noise was tried at each size."
)


def selftest_report(test: SelfTest) -> list[RenderableType]:
    """What was found of every effect, in a table and in sentences."""
    hidden = [each for each in test.sought if each.trials]
    heads = ("hidden effect", "detection limit", "seen from", "named from", "that is", "taken for")
    table = columns(*heads, words=(0, 4, 5), spare=(4, 1))
    for each in hidden:
        table.add_row(mark(each.effect), *_sizes(each), _values(each, test.units), _taken_for(each))
    shown: list[RenderableType] = lines("WARNING", misfit_texts(test), "yellow")
    shown.append(line("NOTHING", nothing_text(test.clean), "bold"))
    shown += [spaced(table), ""] if hidden else []
    for label, text in _sentences(test.sought):
        shown.append(line(label, text))
    return [*shown, line("HOW", MEANS)]


def misfit_texts(test: SelfTest) -> list[str]:
    """That the model does not describe the recordings themselves, where it does not."""
    if test.over_noise <= SELFTEST.far:
        return []
    return [
        f"The model itself misses these recordings by {amount(test.rmse, 'N')} rms, "
        f"{showing.figures(test.over_noise)} times the noise of a reading. What is said here holds for a muscle that "
        "the model describes: look for what it lacks with `mckibben diagnose` first, and test again."
    ]


def nothing_text(clean: Trial) -> str:
    """What was said where nothing was hidden."""
    if Verdict(clean.verdict) in NOTHING_MISSING:
        return f"Where nothing was hidden, nothing was found missing ({clean.verdict})."
    if clean.verdict == Verdict.INCONCLUSIVE:
        return "Where nothing was hidden, the diagnosis was inconclusive: these recordings say too little."
    named = " or ".join(effect_set(names) for names in clean.explanations) or clean.verdict
    return f"A false alarm: where nothing was hidden, the diagnosis said {named}. Believe no verdict on these data yet."


def sought_text(each: Sought) -> str:
    """What came of one effect, in a sentence."""
    if not each.trials:
        return f"{mark(each.effect)}: not hidden, {each.why_not}"
    if each.named_from is not None:
        return f"{mark(each.effect)}: named from {_newtons(each.named_from)}"
    if each.seen_from is not None:
        return f"{mark(each.effect)}: from {_newtons(each.seen_from)} one of several"
    return f"{mark(each.effect)}: not found up to {_newtons(each.trials[-1].size)}"


def _sizes(each: Sought) -> tuple[str, str, str]:
    largest = each.trials[-1].size
    beyond = lambda size: f"> {_newtons(largest)}" if size is None else _newtons(size)  # noqa: E731
    return ("" if each.limit is None else _newtons(each.limit)), beyond(each.seen_from), beyond(each.named_from)


def _values(each: Sought, unit_of: Mapping[str, str]) -> str:
    found = each.found((Outcome.NAMED,)) or each.found()
    return "" if found is None else values_text(found, unit_of)


def _taken_for(each: Sought) -> str:
    wrong = [effect_set(names) for names in each.taken_for]
    several = [names for t in each.trials if t.outcome is Outcome.ONE_OF for names in t.explanations]
    likes = [effect_set(names) for names in dict.fromkeys(several) if names != (each.effect,)]
    unknown = ["none of the library"] if any(t.outcome is Outcome.UNKNOWN for t in each.trials) else []
    parts = [*([" or ".join([*wrong, *unknown])] if wrong or unknown else []),
             *([f"tied with {', '.join(likes)}"] if likes else [])]  # fmt: skip
    return "; ".join(parts)


def _sentences(sought: Sequence[Sought]) -> list[tuple[str, str]]:
    """The effects by what came of them."""
    tried = [each for each in sought if each.trials]
    named = [each.effect for each in tried if each.named_from is not None]
    several = [each.effect for each in tried if each.named_from is None and each.seen_from is not None]
    missed = [each.effect for each in tried if each.seen_from is None]
    reasons = {}
    for each in sought:
        if not each.trials:
            reasons.setdefault(each.why_not, []).append(each.effect)
    said = [("NAMED", f"{counted(len(named), 'effect')} of {len(tried)}: {listed(named)}")] if named else []
    said += [("ONE OF", f"found, but only among others: {listed(several)}")] if several else []
    said += [("NEVER", f"not found at any size that was tried: {listed(missed)}")] if missed else []
    return [*said, *(("UNTRIED", f"{listed(names)}: {why}") for why, names in reasons.items())]


def _newtons(size: float) -> str:
    return showing.show(size, "N", digits=2)


def values_text(trial: Trial, unit_of: Mapping[str, str]) -> str:
    """The values of a hidden effect's parameters: 'k = 1.1'."""
    return ", ".join(f"{name.split('.')[1]} = {amount(value, unit_of[name])}" for name, value in trial.values.items())


def selftest_result(test: SelfTest) -> dict[str, Any]:
    """For machines: SI; sizes are N rms left when the model has given way."""
    return {
        "model_rmse_N": test.rmse,
        "model_rmse_over_noise": test.over_noise,
        "nothing_hidden": _plain(test.clean, test.units),
        "effects": {each.effect: _of_effect(each, test.units) for each in test.sought},
    }


def _of_effect(each: Sought, unit_of: Mapping[str, str]) -> dict[str, Any]:
    return {
        "detection_limit_N": each.limit,
        "named_from_N": each.named_from,
        "seen_from_N": each.seen_from,
        "taken_for": [list(names) for names in each.taken_for],
        "why_not": each.why_not or None,
        "trials": [_plain(trial, unit_of) for trial in each.trials],
    }


def _plain(trial: Trial, unit_of: Mapping[str, str]) -> dict[str, Any]:
    told = {
        "size_N": trial.size,
        "values": {name: {"value": value, "unit": unit_of[name]} for name, value in trial.values.items()},
        "verdict": trial.verdict,
        "explanations": [list(names) for names in trial.explanations],
    }
    return told | ({"outcome": str(trial.outcome)} if trial.effect else {})
