"""What the instruments of a data set may err by: one line for each channel, a table of all, and JSON."""

from collections.abc import Callable, Iterable, Sequence
from typing import Any

from fitting.recordings.accuracy import Channel
from fitting.recordings.channel_errors import ChannelErrors
from fitting.report.text.amounts import amount, percent

HOUR = 3600.0  # s
FIGURES = 2  # of an accuracy: nobody knows it better
CHANNEL_TEXT = {
    Channel.PRESSURE: "pressure", Channel.POSITION: "position", Channel.FORCE: "force", Channel.TIME: "time",
    Channel.FRICTION: "friction",
}  # fmt: skip
ERROR_TEXT = {
    "zero": "zero {}", "gain": "gain {}", "zero_per_run": "zero {} from run to run",
    "gain_per_run": "gain {} from run to run", "hysteresis": "hysteresis {} of full scale", "drift": "drift {}",
    "skew": "{} between channels", "friction_per_run": "{} from run to run",
}  # fmt: skip
SHARES = ("gain", "gain_per_run", "hysteresis", "friction_per_run")
HEADS = ("recording", "channel", "one reading errs by", "from", "found in the readings", "rounded to", "stated",
         "presumed")  # fmt: skip


def channel_lines(channels: Sequence[ChannelErrors]) -> list[str]:
    """One line for each channel, over all recordings: what one reading errs by, what is stated, what is presumed."""
    return [
        f"{CHANNEL_TEXT[channel]}: {_line(mine)}"
        for channel in Channel
        if (mine := [each for each in channels if each.channel is channel])
    ]


def _line(mine: Sequence[ChannelErrors]) -> str:
    noises = [(each.noise, each.unit) for each in mine if each.noise]
    known = {each.noise_is_stated for each in mine if each.noise}
    source = "stated" if known == {True} else "found" if known == {False} else "stated or found"
    parts = [f"one reading errs by {_between(noises)} ({source})"] if noises else []
    for stated, word in ((True, "stated"), (False, "presumed")):
        allowed = _all_allowed(mine, stated)
        parts += [f"{word}: {allowed}"] if allowed else []
    return "; ".join(parts) or "taken as exact"


def _all_allowed(mine: Sequence[ChannelErrors], stated: bool) -> str:
    named = (_allowed(mine, name, stated) for name in ERROR_TEXT)
    return ", ".join(text for text in named if text)


def _allowed(mine: Sequence[ChannelErrors], name: str, stated: bool) -> str:
    """The size of one error where it is (not) stated; empty where it is nothing, unless that is stated."""
    sizes = [each.systematic.get(name) for each in mine if (name in each.stated) is stated]
    known = [size for size in sizes if size is not None and (size or stated)]
    return ERROR_TEXT[name].format(_range(known, lambda size: accuracy_text(name, size, mine[0].unit))) if known else ""


def _between(values: Iterable[tuple[float, str]]) -> str:
    sizes, units = zip(*values, strict=True)
    return _range(sizes, lambda size: amount(size, units[0], FIGURES))


def _range(sizes: Sequence[float], text: Callable[[float], str]) -> str:
    """One size, or the least and the largest of several."""
    least, most = text(min(sizes)), text(max(sizes))
    return most if least == most else f"{least} to {most}"


def accuracy_text(name: str, size: float, unit: str) -> str:
    """The size of an error (by the name of its accuracy) with its unit, that of the channel; drifts per hour."""
    if name in SHARES:
        return percent(size)
    return f"{amount(HOUR * size, unit, FIGURES)}/h" if name == "drift" else amount(size, unit, FIGURES)


def channel_cells(each: ChannelErrors) -> tuple[str, ...]:
    """One row of the table of all recordings and channels, under `HEADS`."""
    source = "" if each.noise is None else "muscle.toml" if each.noise_is_stated else "the readings"
    resolution = "" if each.resolution is None else amount(each.resolution, each.unit)
    noises = [amount(size, each.unit, FIGURES) for size in (each.noise, each.found.noise)]
    stated, presumed = (_all_allowed([each], is_stated) for is_stated in (True, False))
    return each.file, CHANNEL_TEXT[each.channel], noises[0], source, noises[1], resolution, stated, presumed


def channels_result(channels: Sequence[ChannelErrors]) -> list[dict[str, Any]]:
    """The same for machines, in SI: `noise` and `resolution` as stated or found, `allowed` as stated or presumed."""
    return [
        {"file": each.file, "channel": each.channel.value, "noise": each.noise, "noise_found": each.found.noise,
         "resolution": each.resolution, "unit": each.unit, "allowed": each.systematic, "stated": list(each.stated)}
        for each in channels
    ]  # fmt: skip
