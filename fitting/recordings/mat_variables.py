"""Columns out of MATLAB's variables: a vector is one, a matrix holds several, a struct names them by its fields.

An array of structs is a series of runs: the fields of its elements stand one behind another, with a column `run`.
"""

from collections import Counter
from collections.abc import Iterator, Sequence
from enum import StrEnum
from typing import Any

import numpy as np
import pandas as pd

from fitting.recordings.source import printable, series_of

Struct = dict[
    str, Any
]  # a struct, or all variables of a file: arrays, texts (lists), structs, lists of structs, Unread
Path = tuple[str, ...]
WIDEST = 64  # columns of a matrix; chosen: a matrix with more is a picture or a map


class DamagedError(ValueError):
    """A file that is not as its format has it."""


class Unread(StrEnum):
    """Why a variable is no column."""

    OBJECT = "is an object (a table, a timetable, a timeseries), which only MATLAB can read"
    FUNCTION = "is a function"
    SPARSE = "is a sparse matrix: write full(...)"
    CELLS = "is a cell array: write cell2mat(...)"
    COMPLEX = "is complex"
    WIDE = "has more than two dimensions, or too many columns"
    UNEQUAL = "has runs whose fields differ in length"
    ELSEWHERE = "is kept in another file"
    DEEP = "is nested too deep"


def cells_of(values: list[Any]) -> Any:
    """What a cell array holds: texts, or structs; anything else has no place in a column."""
    if all(isinstance(value, list) and len(value) == 1 and isinstance(value[0], str) for value in values):
        return [value[0] for value in values]
    if all(isinstance(value, dict) for value in values):
        return values
    return Unread.CELLS


def columns_of(variables: Struct) -> tuple[dict[str, pd.Series], dict[str, str]]:
    """The columns by what they are called, and why others are none.

    A column is called by the last part of its name, as 'force' of data.force, where no other is called so.
    """
    found = [*_columns((), variables)]
    calls = Counter(path[-1] for path, _ in found)
    columns, unread = {}, {}
    for path, values in found:
        name = printable(path[-1] if calls[path[-1]] == 1 else ".".join(path))
        if isinstance(values, Unread):
            unread[name] = str(values)
        else:
            columns[name] = values
    return columns, unread


def _columns(path: Path, value: Any) -> Iterator[tuple[Path, pd.Series | Unread]]:
    if isinstance(value, Unread):
        yield path, value
    elif isinstance(value, dict):
        for name, inner in value.items():
            yield from _columns((*path, name), inner)
    elif isinstance(value, list) and value and isinstance(value[0], dict):
        yield from _runs(path, value)
    elif isinstance(value, list):
        yield path, series_of(value)
    else:
        yield from _numbers(path, np.asarray(value))


def _numbers(path: Path, array: np.ndarray) -> Iterator[tuple[Path, pd.Series | Unread]]:
    """Columns of an array; one of time goes along the longer side of a matrix."""
    if array.size == 0:
        return
    if array.dtype.kind == "c":
        yield path, Unread.COMPLEX
    elif array.dtype.kind not in "biuf" or array.ndim > 2 or (array.ndim == 2 and min(array.shape) > WIDEST):
        yield path, Unread.WIDE
    elif array.ndim < 2 or min(array.shape) == 1:
        yield path, pd.Series(array.ravel().astype(float))
    else:
        way, rows = ("row", array) if array.shape[0] < array.shape[1] else ("column", array.T)
        for number, row in enumerate(rows, 1):
            yield (*path[:-1], f"{path[-1]} {way} {number}"), pd.Series(row.astype(float))


def _runs(path: Path, structs: Sequence[Struct]) -> Iterator[tuple[Path, pd.Series | Unread]]:
    """The fields of an array of structs, element behind element."""
    each = [dict(_columns((), struct)) for struct in structs]
    lengths = [{len(column) for column in run.values() if not isinstance(column, Unread)} for run in each]
    names = dict.fromkeys(name for run in each for name in run)
    if any(len(found) != 1 for found in lengths) or any(name not in run for run in each for name in names):
        yield path, Unread.UNEQUAL
        return
    for name in names:
        parts = [run[name] for run in each]
        bad = next((part for part in parts if isinstance(part, Unread)), None)
        yield (*path, *name), series_of([cell for part in parts for cell in part]) if bad is None else bad
    if ("run",) not in names:
        counts = [found.pop() for found in lengths]
        yield (*path, "run"), pd.Series(np.repeat(np.arange(1.0, len(each) + 1), counts))
