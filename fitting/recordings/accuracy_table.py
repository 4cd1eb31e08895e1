"""`[recording.accuracy]` of a muscle.toml as an `Accuracy`: a table of column names, of the errors of each.

Values are strings with units, one standard deviation each; hysteresis is a share of full scale, drift goes by time.
"""

from collections.abc import Mapping
from dataclasses import fields, replace
from typing import Any

import numpy as np

from fitting import showing, units
from fitting.errors import InputError, concerning, unknown_name
from fitting.recordings.accuracy import Accuracy, Channel, ChannelAccuracy
from fitting.recordings.records import FORCE_TESTS, POSITION_TESTS
from fitting.recordings.settings import ACCURACY, TABLES

POSITIONS = {
    "contraction": "1",
    "length": "m",
    "displacement": "m",
}  # columns of one channel: SI unit of what is stated
COLUMNS = {"pressure": "Pa", **POSITIONS, "force": "N"}
ALONE = {Channel.TIME: ("skew", "s"), Channel.FRICTION: ("per_run", "1")}  # what has one error, with its SI unit
ACCURATE = (*COLUMNS, *ALONE)
ERRORS = tuple(each.name for each in fields(ChannelAccuracy))
SHARES = ("gain", "gain_per_run", "hysteresis")
EXAMPLES = {
    "Pa": "150 Pa", "Pa/s": "0.1 kPa/h", "N": "0.5 N", "N/s": "5 N/h", "m": "0.01 mm", "m/s": "0.1 mm/h", "1": "0.1 %",
    "1/s": "0.1 %/h", "s": "5 ms",
}  # fmt: skip


def accuracy_of(stated: Any, test: str, length: float, noise: float | None = None) -> Accuracy:
    """What the table `stated` says of a recording's channels; a contraction's errors are multiplied by `length` (m).

    `noise` (N or m) is what the recording itself states of the channel that its test measures. An `InputError` names
    the column it is about as the key "accuracy.force".
    """
    stated = {} if stated is None else stated
    with concerning("accuracy"):
        if not isinstance(stated, Mapping):
            cure = f'write [recording.accuracy] and below it pressure = {{ noise = "{EXAMPLES["Pa"]}" }}'
            raise InputError("accuracy is not a table", value=stated, cure=cure)
        position = _position_column(stated)
    found: dict[str, Any] = {}
    for column, errors in stated.items():
        with concerning(f"accuracy.{column}"):
            _check_column(column, errors, test)
            if column in ALONE:
                found["skew" if column == Channel.TIME else "friction_per_run"] = _only(Channel(column), errors)
            else:
                found[Channel.POSITION if column == position else column] = _channel(column, errors, length)
    measured = Channel.FORCE if test in FORCE_TESTS else Channel.POSITION
    with concerning(f"accuracy.{position if measured is Channel.POSITION else measured}"):
        return _with_noise(Accuracy(**found), measured, noise)


def _position_column(stated: Mapping[str, Any]) -> str | None:
    """The column by which the table speaks of the position; None where it does not."""
    named = [column for column in stated if column in POSITIONS]
    if len(named) > 1:
        cure = "keep one of these lines"
        raise InputError(f"accuracy: {' and '.join(named)} are one channel", value=", ".join(named), cure=cure)
    return named[0] if named else None


def _check_column(column: str, errors: Any, test: str) -> None:
    known = [each for each in ACCURATE if each != "force" or test in FORCE_TESTS]
    if column == "force" and test in POSITION_TESTS:
        cure = "leave this line out; what a test of this kind measures is the displacement"
        raise InputError(f"accuracy: no force is read in a recording of test = '{test}'", value=column, cure=cure)
    if column not in known:
        raise unknown_name("column in [recording.accuracy]:", column, known)
    if not isinstance(errors, Mapping):
        key, si = ALONE[Channel(column)] if column in ALONE else ("noise", COLUMNS[column])
        example = f'{key} = "{EXAMPLES[si]}"'
        raise InputError(f"accuracy: {column} is not a table", value=errors, cure=f"write {column} = {{ {example} }}")


def _channel(column: str, errors: Mapping[str, Any], length: float) -> ChannelAccuracy:
    """The errors of one column in the SI unit of its channel.

    A gain of the length l0 - x, read with the error g (l0 - x), is a gain of the displacement x and a zero of g l0.
    """
    _check_keys(column, errors, ERRORS)
    si = COLUMNS[column]
    found = {key: _size(text, _unit(key, si), f"accuracy: {column}.{key}") for key, text in errors.items()}
    if si == "1":
        found = {key: size if key in SHARES else size * length for key, size in found.items()}
    if column == "length":
        for gain, zero in (("gain", "zero"), ("gain_per_run", "zero_per_run")):
            if found.get(gain):
                found[zero] = float(np.hypot(found.get(zero, 0.0), found[gain] * length))
    return ChannelAccuracy(**found)


def _only(channel: Channel, errors: Mapping[str, Any]) -> float | None:
    """The one error of what has no other: the time between channels (s), friction from run to run (relative)."""
    key, si = ALONE[channel]
    _check_keys(channel, errors, (key,))
    return _size(errors[key], si, f"accuracy: {channel}.{key}") if errors else None


def _check_keys(column: str, errors: Mapping[str, Any], known: tuple[str, ...]) -> None:
    for key in errors:
        if key not in known:
            raise unknown_name(f"key in [recording.accuracy], {column}:", key, known)


def _unit(key: str, si: str) -> str:
    return "1" if key in SHARES else f"{si}/s" if key == "drift" else si


def _size(text: Any, si: str, what: str) -> float:
    """A standard deviation as written ("150 Pa", "0.25 %", "5 N/h") in SI; a share needs its unit too."""
    cure = f'write it with its unit, in quotes, as in "{EXAMPLES[si]}"'
    if not isinstance(text, str):
        raise InputError(f"{what} is not a value with a unit", value=text, cure=cure)
    if "?" in text:
        cure = "write what the data sheet says, or leave it out: then it is presumed"
        raise InputError(f"{what} is still to be filled in", value=text, cure=cure)
    number, unit = _parts(text, what, cure)
    if not unit:
        raise InputError(f"{what} has no unit", value=text, cure=cure)
    try:
        size = units.to_si(text, si, what)
    except InputError as error:
        known = units.is_unit(unit)  # an unknown one has a likely spelling as its cure
        raise InputError(error.problem, value=text, cure=cure if known else error.cure) from None
    if number < 0:
        raise InputError(f"{what} is negative", value=text, cure="it is a standard deviation: leave the sign out")
    if size > TABLES.largest_number:
        raise InputError(f"{what} is larger than anything measured", value=text, cure=cure)
    return size


def _parts(text: str, what: str, cure: str) -> tuple[float, str]:
    try:
        return units.split_value(text, what)
    except InputError as error:
        raise InputError(error.problem, value=text, cure=cure) from None


def _with_noise(accuracy: Accuracy, measured: Channel, noise: float | None) -> Accuracy:
    """The same with one noise of the measured channel, wherever it is stated; refused where two differ."""
    channel: ChannelAccuracy = getattr(accuracy, measured)
    if noise is not None and channel.noise is not None and abs(channel.noise - noise) > ACCURACY.same * noise:
        unit = "N" if measured is Channel.FORCE else "m"
        both = f"{showing.show(noise, unit)} and {showing.show(channel.noise, unit)}"
        problem = f"accuracy: noise and {measured}.noise of this recording mean the same and differ"
        raise InputError(problem, value=both, cure="leave one of the two out")
    if channel.noise == 0:
        problem = f"accuracy: the noise of the measured {measured} is not positive"
        raise InputError(problem, value="0", cure="leave it out if it is unknown")
    return replace(accuracy, **{measured.value: replace(channel, noise=channel.noise if noise is None else noise)})
