"""Instruments as answers: how large each error seems, how large it may be, how large it had to be."""

import math
from collections.abc import Sequence
from typing import Any

from fitting import showing
from fitting.diagnosis.findings import Blamed, InstrumentAnswer
from fitting.diagnosis.outcomes import NOTHING_MISSING, Verdict
from fitting.diagnosis.record import Diagnosis
from fitting.instruments.sources import RELATIVE, ErrorKind, Source
from fitting.recordings.accuracy import Channel
from fitting.recordings.channel_errors import UNITS
from fitting.report.text.amounts import amount, percent
from fitting.report.text.instruments import accuracy_text
from fitting.report.text.names import mark, marked

NAMES = {
    Channel.PRESSURE: "the pressure gauge",
    Channel.POSITION: "the position reading",
    Channel.FORCE: "the load cell",
}
PHRASES = {
    ErrorKind.ZERO: "the zero of {} is off by {}",
    ErrorKind.GAIN: "the gain of {} is off by {}",
    ErrorKind.ZERO_PER_RUN: "the zero of {} differs by {} from run to run",
    ErrorKind.GAIN_PER_RUN: "the gain of {} differs by {} from run to run",
    ErrorKind.HYSTERESIS: "{} has a hysteresis of {} of full scale",
    ErrorKind.DRIFT: "the zero of {} drifts by {}",
}
ERRORS = {
    ErrorKind.ZERO: "zero",
    ErrorKind.GAIN: "gain",
    ErrorKind.ZERO_PER_RUN: "zero, from run to run",
    ErrorKind.GAIN_PER_RUN: "gain, from run to run",
    ErrorKind.HYSTERESIS: "hysteresis, of full scale",
    ErrorKind.DRIFT: "drift of the zero",
    ErrorKind.SKEW: "time between the channels",
    ErrorKind.FRICTION_PER_RUN: "friction, from run to run",
}
LASTING = {
    ErrorKind.ZERO: "zero",
    ErrorKind.GAIN: "gain",
    ErrorKind.HYSTERESIS: "hysteresis",
    ErrorKind.DRIFT: "drift",
}
HEADS = ("instrument", "error", "most likely size", "known to", "would explain the misfit")
EXACT, NEVER = "taken as exact", "no"
MOST_NAMED = 3
MOSTLY = 0.5  # of the misfit, that is left where instruments can make most of it


def rival_texts(d: Diagnosis) -> list[str]:
    """Sentences on the errors of instruments that would explain the misfit, the least unlikely first."""
    rivals = sorted((each for each in d.instruments if each.needed is not None), key=_excess)
    also = "also " if d.explanations else ""
    return [
        f"An instrument could {also}explain it only if {error_text(each.source, each.needed or 0.0)} "
        f"({_known_to(each.source)})."
        for each in rivals[:MOST_NAMED]
    ]


def _excess(each: InstrumentAnswer) -> float:
    """How many times its accuracy an error had to be to explain the misfit; none without an end."""
    return math.inf if each.needed is None else each.needed / max(each.source.allowed, 1e-300)


def asked_texts(d: Diagnosis) -> list[str]:
    """What explanations ask of each instrument that they blame, beside what is allowed, where it is more.

    Of several explanations that blame the same error the likeliest is said, or that which asks least. Someone has to go
    and look: no verdict makes a load cell read 400 N at rest.
    """
    likeliest = tuple(sorted(d.explanations[0])) if d.explanations else ()
    first = "The likeliest of these" if len(d.explanations) > 1 else "This"
    told = [each for each in d.blamed if each.among == likeliest]
    others = [each for each in d.blamed if each.effect not in {one.effect for one in told}]
    least = {each.effect: each for each in sorted(others, key=lambda each: -each.size)}
    return [
        *(_asked(first, each) for each in told if each.size > each.source.allowed),
        *(_asked(_who_blames(others, name), each) for name, each in least.items() if each.size > each.source.allowed),
    ]


def _who_blames(blamed: Sequence[Blamed], effect: str) -> str:
    """Which explanations, other than the likeliest, stand for this error of an instrument."""
    found = [each for each in blamed if each.effect == effect]
    return marked(found[0].among, " + ") if len(found) == 1 else f"Every explanation with {mark(effect)}"


def asked_of_added_texts(d: Diagnosis, added: Sequence[str]) -> list[str]:
    """The same of effects that a discovery has added for this diagnosis: they stay errors of instruments.

    What was added may be a part of an explanation alone. Of several sizes that of the explanation that was added is
    said, else the smallest.
    """
    blamed = [each for each in d.blamed if each.effect in added]
    blamed.sort(key=lambda each: (set(each.among) <= set(added), -each.size))
    of_these = {each.effect: each for each in blamed}  # the last of each effect
    beyond = [each for each in of_these.values() if each.size > each.source.allowed]
    return [_asked(f"{mark(each.effect)} was added, which", each) for each in beyond]


def _asked(what: str, each: Blamed) -> str:
    return (
        f"{what} holds only if {error_text(each.source, each.size)} ({_known_to(each.source)}{_times(each)}). "
        "Check this before you believe it."
    )


def _times(each: Blamed) -> str:
    return f", {showing.figures(each.size / each.source.allowed)} times as much is asked" if each.source.allowed else ""


def explaining_text(d: Diagnosis, unit: str = "N") -> str:
    """Which errors within their accuracy are at work, where instruments explain the misfit or most of it; else empty.

    Where instruments explain all, and the most likely size of an error is far beyond its accuracy, it is said: the test
    does not see that. Where something else is missing, such a size stands for that.
    """
    most = d.verdict not in NOTHING_MISSING and d.unexplained < MOSTLY * d.beyond_noise
    if d.verdict != Verdict.WITHIN_INSTRUMENTS and not most:
        return ""
    at_work = [each for each in d.instruments if 0 < each.source.allowed <= 2 * each.found]
    at_work.sort(key=lambda each: -each.found / each.source.allowed)
    beyond = [each for each in at_work if each.is_beyond]
    within = [each for each in at_work if not each.is_beyond]
    texts = [f"Most likely, {_phrases(within)}."] if within else []
    if most:
        left, misfit = amount(d.unexplained, unit, 2), amount(d.beyond_noise, unit)
        about = f"Errors of the instruments can make all but {left} of the misfit of {misfit}."
        return " ".join([about, *texts]) if within else ""
    more = f"The readings ask for far more than the accuracy: {_phrases(beyond)}. Check this first."
    return " ".join([*texts, more] if beyond else texts)


def _phrases(errors: Sequence[InstrumentAnswer]) -> str:
    """What some errors seem to be; one of the same kind in several recordings is said once, with the first of them."""
    alike: dict[tuple[Channel | None, ErrorKind], list[InstrumentAnswer]] = {}
    for each in errors:
        alike.setdefault((each.source.channel, each.source.kind), []).append(each)
    return "; ".join(_phrase(each) for each in [*alike.values()][:MOST_NAMED])


def _phrase(alike: Sequence[InstrumentAnswer]) -> str:
    first = alike[0]
    more = f", and likewise in {showing.counted(len(alike) - 1, 'recording')} more" if len(alike) > 1 else ""
    return f"{error_text(first.source, first.found)} ({_known_to(first.source)}){more}"


def instrument_texts(d: Diagnosis, unit: str = "N") -> list[str]:
    """All that is said of instruments in sentences, as far as there is anything to say."""
    return [*odd_run_texts(d), *asked_texts(d), *filter(None, [explaining_text(d, unit)]), *rival_texts(d)]


def odd_run_texts(d: Diagnosis) -> list[str]:
    """Runs that differ from the others by more than their instruments allow, and what the test says without each."""
    return [
        f"Run {each.run} of {each.file} differs from the others: {_in_one_run(each.source, each.size)} "
        f"({_known_to(each.source)}). Without it, p = {each.p_value:.2g} in the test that nothing is missing. Look at "
        "this run, and record it again."
        for each in d.odd_runs
    ]


def _in_one_run(source: Source, size: float) -> str:
    return error_text(source, abs(size)).replace(" from run to run", "")


def error_text(source: Source, size: float) -> str:
    """An error as a clause: "friction differs by 2 % from run to run"."""
    if source.kind is ErrorKind.SKEW:
        return f"force and the other channels are read {size_text(source, size)} apart"
    if source.channel is None:
        return f"friction differs by {size_text(source, size)} from run to run"
    return PHRASES[source.kind].format(NAMES[source.channel], size_text(source, size))


def known_to_text(source: Source) -> str:
    """An error that all runs share, with its accuracy: "the gain of the load cell, known to 0.5 %"."""
    name = "the readings" if source.channel is None else NAMES[source.channel]
    return f"the {LASTING[source.kind]} of {name}, {_known_to(source)}"


def _known_to(source: Source) -> str:
    """How well an error is known: one standard deviation, no limit."""
    if not source.allowed:
        return EXACT
    return f"{'presumed to be ' * source.presumed}known to {size_text(source, source.allowed)}"


def size_text(source: Source, size: float) -> str:
    """The size of an error with its unit; drifts per hour."""
    return percent(size) if source.channel is None else accuracy_text(source.kind, size, UNITS[source.channel])


def checklist(answers: Sequence[InstrumentAnswer]) -> list[tuple[str, ...]]:
    """Errors as cells under `HEADS`: first what would explain the misfit; not what is neither found nor allowed."""
    told = [each for each in answers if each.found or each.source.allowed]
    return [_cells(each) for each in sorted(told, key=_excess)]


def _cells(each: InstrumentAnswer) -> tuple[str, ...]:
    channel = each.source.channel
    return (
        "muscle" if channel is None else NAMES[channel].removeprefix("the ") if channel in NAMES else "clock",
        ERRORS[each.source.kind],
        size_text(each.source, each.found) if each.found else "none",
        f"{size_text(each.source, each.source.allowed)}{', presumed' * each.source.presumed}"
        if each.source.allowed
        else EXACT,
        NEVER if each.needed is None else f"at {size_text(each.source, each.needed)}",
    )


def instruments_result(answers: Sequence[InstrumentAnswer]) -> list[dict[str, Any]]:
    """The same for machines, in SI."""
    return [
        {"channel": "muscle" if each.source.channel is None else each.source.channel.value,
         "kind": each.source.kind.value, "found": each.found, "allowed": each.source.allowed, "needed": each.needed,
         "presumed": each.source.presumed, "unit": _unit(each.source)}
        for each in answers
    ]  # fmt: skip


def _unit(source: Source) -> str:
    if source.channel is None or source.kind in RELATIVE:
        return "1"
    return UNITS[source.channel] + "/s" * (source.kind is ErrorKind.DRIFT)


def odd_runs_result(d: Diagnosis) -> list[dict[str, Any]]:
    """Odd runs for machines, in SI."""
    return [
        {"file": each.file, "run": each.run,
         "channel": "muscle" if each.source.channel is None else each.source.channel.value,
         "kind": each.source.kind.value, "size": each.size, "allowed": each.source.allowed, "unit": _unit(each.source),
         "p_value_without": each.p_value}
        for each in d.odd_runs
    ]  # fmt: skip
