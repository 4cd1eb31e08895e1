"""Moments as a date or a clock writes them: stamps, which loggers and spreadsheets leave in the column of time."""

import datetime
import re

import numpy as np
import pandas as pd

_SECONDS = r":[0-5]\d(?:[.,]\d{1,9})?"
_CLOCK = rf"\d{{1,2}}:[0-5]\d(?:{_SECONDS})?"
ISO = re.compile(rf"\d{{4}}[-/]\d{{1,2}}[-/]\d{{1,2}}[T ]+{_CLOCK}\s*(?:Z|[+-]\d{{2}}:?\d{{2}})?")
DAY_FIRST = re.compile(rf"\d{{1,2}}\.\d{{1,2}}\.\d{{4}}[T ]+{_CLOCK}")
CLOCK = re.compile(rf"\d+:[0-5]\d{_SECONDS}")  # with seconds: of 10:15 nobody can say whether it is minutes
UNCLEAR = re.compile(r"\s*(?:[\d./-]+[ T]+)?\d+:\d+(?::\d+(?:[.,]\d+)?)?.*", re.DOTALL)  # 11/12/2026 is which month?
DAY = 86400.0  # s
CURE = "write stamps as 2026-11-20 10:15:03.010, or the time in seconds from the beginning of the test"


def are_stamps(cells: pd.Series) -> bool:
    """Whether the first cell that is not empty is a moment that can be read."""
    first = cells.dropna()
    return len(first) > 0 and _pattern(first.iloc[0]) is not None


def seconds_of(cells: pd.Series) -> np.ndarray:
    """Seconds (rows,) of stamps since the beginning of 1970, where they have a date, else since the first midnight.

    The time of different files can so be compared. A stamp without a zone is taken as it stands. NaN where a cell is
    empty, or is no stamp of the kind of the first one.
    """
    texts = cells.map(_text, na_action="ignore").astype("string").str.strip()
    pattern = _pattern(texts.dropna().iloc[0])
    assert pattern is not None  # the caller has looked
    kept = texts.where(texts.str.fullmatch(pattern).fillna(value=False)).str.replace(",", ".")
    if pattern is CLOCK:
        return _of_clock(kept)
    if pattern is DAY_FIRST:
        kept = kept.str.replace(r"^(\d+)\.(\d+)\.(\d+)", r"\3-\2-\1", regex=True)
    else:
        kept = kept.str.replace("/", "-")
    return _of_dates(kept.str.replace(r"[T ]+", " ", regex=True))


def _pattern(cell: object) -> re.Pattern[str] | None:
    text = _text(cell)
    return next((pattern for pattern in (ISO, DAY_FIRST, CLOCK) if pattern.fullmatch(text)), None)


def _text(cell: object) -> str:
    """A cell as text; a sheet has moments as such."""
    return cell.isoformat() if isinstance(cell, (datetime.datetime, datetime.time)) else str(cell).strip()


def _of_clock(texts: pd.Series) -> np.ndarray:
    """A clock that goes back by more than half a day has passed midnight."""
    seconds = np.array(pd.to_timedelta(texts, errors="coerce") / pd.Timedelta(seconds=1), dtype=float)
    read = np.isfinite(seconds)
    days = np.cumsum(np.diff(seconds[read], prepend=0.0) < -DAY / 2)
    seconds[read] += DAY * days
    return seconds


def _of_dates(texts: pd.Series) -> np.ndarray:
    moments = pd.to_datetime(texts, format="ISO8601", utc=True, errors="coerce")
    return np.asarray((moments - pd.Timestamp(0, tz="UTC")) / pd.Timedelta(seconds=1), dtype=float)
