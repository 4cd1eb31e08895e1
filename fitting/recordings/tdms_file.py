"""A TDMS file, as LabVIEW and the loggers of NI write it: the channels of one group are the columns."""

import io
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from fitting.errors import InputError, unknown_name
from fitting.recordings.settings import TABLES
from fitting.recordings.source import Source, printable
from fitting.recordings.table_text import bytes_of

FEWER = "write the channels of the muscle alone, or cut the file into several recordings"
AGAIN = "close the file in LabVIEW before you copy it; its index (.tdms_index) is not needed"
BEGIN = "write pressure, length and force as channels of one group"
OTHER_TIMES = "is sampled at other times than the first channel"
TOGETHER = "write all channels of the muscle with the same clock, as one reading each at every moment"
NO_NUMBERS = "holds no numbers"
UNITS = ("unit_string", "NI_UnitDescription")  # properties by which LabVIEW and DAQmx say the unit of a channel
TIMES = "time [s]"


def tdms_source(path: Path, group: str | None) -> Source:
    """The channels of a group as columns, a unit in brackets behind the name where the channel has one.

    A waveform brings its times along: they become a column of seconds, unless the group has a channel of times.
    """
    raw = bytes_of(path, FEWER)
    groups = _groups(raw, path)
    name = _chosen([*groups], group, path)
    columns, unread = _columns(groups[name])
    if not columns:
        raise InputError(f"no channel of the group '{printable(name)}' holds numbers", path, cure=BEGIN)
    heads, longest = [*columns, *unread], max(map(len, columns.values()))
    empty = pd.Series([], dtype=float)
    cells = [*columns.values(), *(empty for _ in unread)]
    return Source(heads, None, np.arange(1, longest + 1), raw, lambda: (cells, "."), unread, TOGETHER)


def group_names(path: Path) -> list[str]:
    """The groups of a file that have channels; none where it cannot be read."""
    try:
        return [*_groups(bytes_of(path, FEWER), path)]
    except InputError:
        return []


def _chosen(groups: list[str], group: str | None, path: Path) -> str:
    if not groups:
        raise InputError("the file has no channel with readings", path, cure=BEGIN)
    if group is not None:
        if group not in groups:
            raise unknown_name("group", group, groups, path)
        return group
    if len(groups) > 1:
        shown = ", ".join(map(printable, groups))
        cure = f'add group = "{printable(groups[0])}" below file in muscle.toml: a group is a recording'
        raise InputError(f"the file has {len(groups)} groups with readings: {shown}", path, cure=cure)
    return groups[0]


def _groups(raw: bytes, path: Path) -> dict[str, list[Any]]:
    """By the name of a group, its channels with readings; all are in memory."""
    try:
        from nptdms import TdmsFile
    except ImportError:
        cure = "pip install 'mckibben-jax[tdms]'; or save the channels as CSV"
        raise InputError("a TDMS file needs npTDMS", path, cure=cure) from None
    try:
        _check_size(TdmsFile.read_metadata(io.BytesIO(raw)), path)
        file = TdmsFile.read(io.BytesIO(raw))
        groups = {group.name: [each for each in group.channels() if len(each)] for group in file.groups()}
    except InputError:
        raise
    except Exception as error:  # npTDMS trusts its input: a damaged file ends in any exception that there is
        problem = f"this is no TDMS file, or it is damaged or breaks off ({type(error).__name__})"
        raise InputError(problem, path, cure=AGAIN) from None
    return {name: channels for name, channels in groups.items() if channels}


def _check_size(file: Any, path: Path) -> None:
    """Refuse a file that would unpack to more than a recording can be."""
    size = 8 * sum(len(channel) for group in file.groups() for channel in group.channels())
    if size > TABLES.unpacked_bytes:
        problem = f"the file unpacks to more than {TABLES.unpacked_bytes / 1e6:g} MB"
        raise InputError(problem, path, value=f"{size / 1e6:.0f} MB", cure=FEWER)


def _columns(channels: list[Any]) -> tuple[dict[str, pd.Series], dict[str, str]]:
    """The columns of a group by their heads, and why other channels are none."""
    columns: dict[str, pd.Series] = {}
    unread: dict[str, str] = {}
    numeric = [channel for channel in channels if channel.dtype.kind in "biufM"]
    unread |= {printable(channel.name): NO_NUMBERS for channel in channels if channel not in numeric}
    if not numeric:
        return columns, unread
    timing = _timing(numeric[0])
    for channel in numeric:
        if _timing(channel) != timing:
            unread[_head(channel)] = _unlike(channel, numeric[0])
        else:
            columns[_head(channel)] = _readings(channel)
    if timing[1] and not any(_is_time(channel) for channel in numeric):
        columns = {TIMES: pd.Series(timing[1] * np.arange(timing[0]))} | columns
    return columns, unread


def _unlike(channel: Any, first: Any) -> str:
    """Why a channel stands beside no reading of the first one."""
    if len(channel) != len(first):
        return f"has {len(channel)} readings, and '{printable(first.name)}' has {len(first)}"
    return OTHER_TIMES


def _timing(channel: Any) -> tuple[int, float, str]:
    """How many readings a channel has, the seconds between two (0: not said), and when the first one was taken."""
    increment = channel.properties.get("wf_increment", 0.0)
    began = channel.properties.get("wf_start_time", ""), channel.properties.get("wf_start_offset", 0.0)
    known = isinstance(increment, (int, float)) and np.isfinite(increment) and increment > 0
    return len(channel), float(increment) if known else 0.0, str(began) if known else ""


def _is_time(channel: Any) -> bool:
    return channel.dtype.kind == "M" or channel.name.strip().lower().split(" ")[0] in ("time", "t")


def _head(channel: Any) -> str:
    """The name of a channel with its unit in brackets, where the name has none."""
    name = printable(channel.name)
    if channel.dtype.kind == "M":
        return f"{name} [s]"
    unit = next((str(channel.properties[key]).strip() for key in UNITS if channel.properties.get(key)), "")
    return f"{name} [{printable(unit)}]" if unit and "[" not in name and "(" not in name else name


def _readings(channel: Any) -> pd.Series:
    """The readings in the unit of the channel, scaled as the file says; moments as seconds from the first."""
    values = np.asarray(channel.data)
    if values.dtype.kind == "M":
        return pd.Series((values - values[0]) / np.timedelta64(1, "s"))
    return pd.Series(values.astype(float))
