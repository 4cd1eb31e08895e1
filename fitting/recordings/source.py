"""What a file of any kind holds before its columns have a meaning: heads, cells, and where they stand."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pandas as pd

FAILED = ("#DIV/0!", "#N/A", "#NAME?", "#NULL!", "#NUM!", "#REF!", "#VALUE!")  # formulas, as spreadsheets write it


@dataclass(frozen=True)
class Source:
    """A recording as its file has it. `cells` gives the columns in the order of `heads`, and the decimal mark.

    `rows` are the numbers by which a user finds a row: lines of a CSV, rows of a sheet, places in a variable, topic
    or channel.
    Columns may differ in length where a file keeps each by itself.
    """

    heads: list[str]
    header_row: int | None  # None: the file has no row of heads, for its columns are named by themselves
    rows: np.ndarray
    raw: bytes
    cells: Callable[[], tuple[list[pd.Series], str]]
    unread: Mapping[str, str] = field(default_factory=dict)  # heads that stand for no column, and why
    cure: str = "save it as a vector"  # how a user makes columns of these


def series_of(values: Sequence[Any]) -> pd.Series:
    """Cells of mixed kinds as a column: numbers where all are numbers, None and blank text where a reading misses."""
    kept = [_kept(value) for value in values]
    if all(value is None or _is_number(value) for value in kept):
        return pd.Series([np.nan if value is None else float(value) for value in kept], dtype=float)
    return pd.Series(kept, dtype=object)


def printable(text: str) -> str:
    """A file's text without what would steer a screen."""
    return text if text.isprintable() else "".join(c if c.isprintable() else "\N{REPLACEMENT CHARACTER}" for c in text)


def _kept(value: Any) -> Any:
    if not isinstance(value, str):
        return value
    return printable(value.strip()) or None


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and abs(value) < 1e300
