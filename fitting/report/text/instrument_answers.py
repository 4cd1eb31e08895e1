"""Instruments as answers: how large each error seems, how large it may be, how large it had to be."""

from collections.abc import Sequence
from typing import Any

from fitting.diagnosis.instrument_answers import InstrumentAnswer
from fitting.diagnosis.instrument_errors import RELATIVE, ErrorKind, Source
from fitting.diagnosis.record import Diagnosis
from fitting.recordings.accuracy import Channel
from fitting.report.text.amounts import amount, percent

HOUR = 3600.0  # s
FIGURES = 2  # of an accuracy: nobody knows it better
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
HEADS = ("instrument", "error", "most likely size", "allowed", "would explain the misfit")
MOST_NAMED = 3


def rival_texts(d: Diagnosis) -> list[str]:
    """Instruments that would explain the misfit as well as an effect, the least unlikely first."""
    rivals = [each for each in d.instruments if each.needed is not None]
    rivals.sort(key=lambda each: (each.needed or 0.0) / max(each.source.allowed, 1e-300))
    return [f"{_phrase(each.source, each.needed or 0.0)} ({_allowed(each.source)})" for each in rivals[:MOST_NAMED]]


def explaining_text(d: Diagnosis) -> str:
    """Which errors within their accuracy are at work, where instruments explain the misfit."""
    at_work = [each for each in d.instruments if 0 < each.source.allowed <= 2 * each.found]
    at_work.sort(key=lambda each: -each.found / each.source.allowed)
    phrases = [f"{_phrase(each.source, each.found)} ({_allowed(each.source)})" for each in at_work[:MOST_NAMED]]
    return f"Most likely: {'; '.join(phrases)}." if phrases else ""


def _phrase(source: Source, size: float) -> str:
    if source.kind is ErrorKind.SKEW:
        return f"force and the other channels are read {size_text(source, size)} apart"
    if source.channel is None:
        return f"friction differs by {size_text(source, size)} from run to run"
    return PHRASES[source.kind].format(NAMES[source.channel], size_text(source, size))


def _allowed(source: Source) -> str:
    return f"{size_text(source, source.allowed)} allowed" if source.allowed else "taken as exact"


def size_text(source: Source, size: float) -> str:
    """The size of an error with its unit; drifts per hour."""
    if source.kind in RELATIVE or source.channel is None:
        return percent(size)
    if source.kind is ErrorKind.DRIFT:
        return f"{amount(HOUR * size, channel_unit(source), FIGURES)}/h"
    return amount(size, channel_unit(source), FIGURES)


def channel_unit(source: Source) -> str:
    """SI unit of the channel."""
    return {Channel.PRESSURE: "Pa", Channel.POSITION: "m", Channel.FORCE: "N", Channel.TIME: "s", None: "1"}[
        source.channel
    ]


def checklist(answers: Sequence[InstrumentAnswer]) -> list[tuple[str, ...]]:
    """Every error as cells under `HEADS`."""
    return [
        (
            "the muscle" if each.source.channel is None else each.source.channel.value,
            each.source.kind.value.replace("_", " "),
            size_text(each.source, each.found) if each.found else "none",
            size_text(each.source, each.source.allowed) if each.source.allowed else "taken as exact",
            "" if each.needed is None else size_text(each.source, each.needed),
        )
        for each in answers
    ]


def instruments_result(answers: Sequence[InstrumentAnswer]) -> list[dict[str, Any]]:
    """The same for machines, in SI."""
    return [
        {"channel": "muscle" if each.source.channel is None else each.source.channel.value,
         "kind": each.source.kind.value, "found": each.found, "allowed": each.source.allowed, "needed": each.needed,
         "unit": _unit(each.source)}
        for each in answers
    ]  # fmt: skip


def _unit(source: Source) -> str:
    if source.kind in RELATIVE:
        return "1"
    return f"{channel_unit(source)}/s" if source.kind is ErrorKind.DRIFT else channel_unit(source)
