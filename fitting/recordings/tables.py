"""Recordings as tables in SI: which column is what, its unit, and every cell checked before it becomes a number."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from fitting import units
from fitting.errors import InputError, alike, nearest, unknown_name
from fitting.recordings.cells import NUMBER
from fitting.recordings.heads import (
    COLUMNS,
    PULLS,
    USUAL,
    has_suffix,
    is_second,
    plain_name,
    split_brackets,
    split_head,
)
from fitting.recordings.kinds import open_source
from fitting.recordings.settings import TABLES
from fitting.recordings.source import FAILED, Source
from fitting.recordings.time_stamps import CURE, UNCLEAR, are_stamps, seconds_of

OPTIONAL = ("run", "branch", "set_pressure")
_ABSOLUTE = re.compile(r"\babs(olute?)?\b(?!\s*\()|\babsolut(?!e)")
_HUMP = re.compile(r"(?<=[a-z])(?=[A-Z])")  # where a word begins within a name: pAbs
_NOT_ABSOLUTE = re.compile(r"\b(not|error|rel)")


class _Place(NamedTuple):
    """Where cells stand: the file, the row of its header (None: there is none), the number of each row; its decimal
    mark."""

    path: Path
    header_row: int | None
    rows: np.ndarray
    decimal: str


@dataclass(frozen=True)
class Table:
    """Columns in SI by the program's names, the line of the file that each row stands in, and what was noticed.

    In a sheet a line is a row as the spreadsheet counts; in MATLAB files and bags it is the place in a column, from 1.
    """

    file: str
    columns: dict[str, np.ndarray]
    heads: dict[str, str]  # what the file calls each column
    header_row: int | None
    row: np.ndarray  # line of the file, per row of the table
    unused: tuple[str, ...]  # heads of columns that are none of the program's
    raw: bytes
    units: dict[str, str]  # what the file gives each column in, by the program's names; labels and stamps have none
    absolute: tuple[str, ...] = ()  # columns whose unit says that their pressure is absolute: 'bara', 'bar abs'

    @property
    def has_stamps(self) -> bool:
        """Whether its times are dates or a clock's, not seconds from the beginning."""
        return "time" in self and "time" not in self.units

    def __contains__(self, name: str) -> bool:
        return name in self.columns

    def __getitem__(self, name: str) -> np.ndarray:
        return self.columns[name]

    def error(self, problem: str, at: int, column: str, value: Any = None, cure: str = "") -> InputError:
        """An error about one cell: `at` counts rows of the table."""
        return InputError(problem, self.file, int(self.row[at]), self.heads.get(column, column), value, cure)


def is_absolute(head: str) -> bool:
    """Whether the head of a column of pressures says that they are absolute: 'p_abs [bar]', 'p [bara]'."""
    if units.without_absolute(split_head(head)[1] or ""):
        return True
    words = _HUMP.sub(" ", head).lower().replace("_", " ")
    return bool(_ABSOLUTE.search(words)) and not _NOT_ABSOLUTE.search(words)


def read_table(
    path: Path,
    called: Mapping[str, str] | None = None,
    given_units: Mapping[str, str] | None = None,
    inside: Mapping[str, str] | None = None,
) -> Table:
    """Read and check a recording; `called` maps names to what the file calls them, `given_units` states units.

    `inside` may hold `sheet` (of an Excel file), `variable` (of a MATLAB file), `topic` (of a ROS 2 bag) or `group` (of
    a TDMS file).
    InputError with file, row, column, value and cure where anything cannot be used.
    """
    source = open_source(path, inside or {}, _is_head)
    heads, called, given_units = source.heads, called or {}, given_units or {}
    where, unused = _columns(heads, called, path, source.header_row)
    cells, decimal = source.cells()
    _check_units_used(given_units, where, path)
    rows = _common_rows(source, cells, where, path)
    place = _Place(path, source.header_row, rows, decimal)
    given = {name: _unit_of(name, heads[at], called, given_units, place) for name, at in where.items()}
    bare = {name: units.without_absolute(unit or "") for name, unit in given.items() if COLUMNS[name] == "Pa"}
    absolute = tuple(name for name, unit in bare.items() if unit)
    given |= {name: bare[name] for name in absolute}
    columns = {name: _column(name, cells[at], heads[at], given[name], place) for name, at in where.items()}
    named = {name: heads[at] for name, at in where.items()}
    measured = [name for name, at in where.items() if COLUMNS[name] is not None and not _is_stamped(name, cells[at])]
    stated = {name: unit for name in measured if (unit := given[name])}
    return Table(str(path), columns, named, source.header_row, rows, tuple(unused), source.raw, stated, absolute)


def read_heads(path: Path, inside: Mapping[str, str] | None = None) -> list[str]:
    """What the columns of a recording are called, as it stands there; `inside` as in `read_table`."""
    return open_source(path, inside or {}, _is_head).heads


def read_cells(path: Path, inside: Mapping[str, str] | None = None) -> tuple[list[str], list[pd.Series], str]:
    """What the columns of a recording are called, their cells as they stand there, and the decimal mark.

    Nothing is checked or converted; `inside` as in `read_table`.
    """
    source = open_source(path, inside or {}, _is_head)
    cells, decimal = source.cells()
    return source.heads, cells, decimal


def _common_rows(source: Source, cells: list[pd.Series], where: Mapping[str, int], path: Path) -> np.ndarray:
    """The numbers of the rows; columns that are used have to be of one length."""
    for at in where.values():
        if reason := source.unread.get(source.heads[at]):
            raise InputError(f"it {reason}", path, column=source.heads[at], cure=source.cure)
    lengths = {name: len(cells[at]) for name, at in where.items()}
    longest = max(lengths, key=lambda name: (lengths[name], name == "time"), default=None)
    for name, length in lengths.items():
        if longest is not None and length != lengths[longest]:
            problem = f"the column has {length} values, and '{source.heads[where[longest]]}' has {lengths[longest]}"
            cure = "give every column a value for every reading, in MATLAB with repmat or interp1"
            raise InputError(problem, path, column=source.heads[where[name]], cure=cure)
    return source.rows if longest is None else source.rows[: lengths[longest]]


# --------------------------------------------------------------------------------------------------- names and units


def _is_head(cell: str) -> bool:
    return plain_name(cell) in COLUMNS


def _columns(
    heads: list[str], called: Mapping[str, str], path: Path, row: int | None
) -> tuple[dict[str, int], list[str]]:
    """Which column of the file is which quantity, and what columns are none; a column that a recording may do without
    is not passed over when it is only misspelt."""
    for name in called:
        if name not in COLUMNS:
            raise unknown_name("name in columns", name, COLUMNS, path)
    where = {name: _called(name, head, heads, path) for name, head in called.items()}
    free = [at for at in range(len(heads)) if at not in where.values()]
    for at in sorted(free, key=lambda at: has_suffix(heads[at])):
        name = plain_name(heads[at])
        beside = [other for other, place in where.items() if not has_suffix(heads[place])]
        if name in COLUMNS and name not in called and not (has_suffix(heads[at]) and _is_told(name, beside)):
            if name in where:
                raise InputError(f"two columns are called {name}", path, row, heads[at], cure="keep one of them")
            where[name] = at
    unused = [heads[at] for at in free if at not in where.values() and heads[at]]
    for head in unused:
        like = nearest(plain_name(head), [name for name in OPTIONAL if name not in where], 0.75)
        if like is not None:
            raise InputError("no such column", path, row, head, cure=f"did you mean '{like}'? Else rename it")
    return where, unused


def _is_told(name: str, beside: Sequence[str]) -> bool:
    """Whether columns with the usual heads tell what this one may tell; of force and load a recording needs one."""
    return is_second(name, beside) or (name in PULLS and not set(PULLS).isdisjoint(beside))


def _called(name: str, head: str, heads: list[str], path: Path) -> int:
    """The column that `columns` names: by the whole header cell, or by its name without the unit.

    A unit behind a name may be part of it: as long as a column is called so with it, no other is meant.
    """
    for part in (str.strip, lambda h: split_brackets(h)[0], lambda h: split_head(h)[0]):
        found = [at for at, h in enumerate(heads) if part(h) == part(head)]
        if len(found) > 1:
            cure = "give each a name of its own"
            raise InputError(f"{len(found)} columns are called '{head}', which is to be {name}", path, cure=cure)
        if found:
            return found[0]
    raise unknown_name(f"column for {name}:", head, heads, path)


def _unit_of(name: str, head: str, called: Mapping[str, str], given: Mapping[str, str], place: "_Place") -> str | None:
    """Unit of a column: from `units`, else from the header, else from what `columns` calls it.

    InputError where header and `columns` contradict each other: which of them is right, `units` has to say.
    """
    if name in given:
        return str(given[name])
    there, here = split_head(head)[1], split_head(called.get(name, ""))[1]
    if there is None or here is None:
        return here if there is None else there
    if all(map(units.is_unit, (there, here))) and units.in_si(there) != units.in_si(here):
        cure = f'write units = {{ {name} = "{here}" }} or "{there}" in muscle.toml, whichever is right'
        problem = f"the header gives this column in {there}, and columns in muscle.toml in {here}"
        raise InputError(problem, place.path, place.header_row, head, cure=cure)
    return there


def _check_units_used(given: Mapping[str, str], where: Mapping[str, int], path: Path) -> None:
    for name in given:
        if name not in where:
            raise unknown_name("column in units:", name, where, path)


# ------------------------------------------------------------------------------------------------- cells to SI values


def _column(name: str, cells: pd.Series, head: str, unit: str | None, place: _Place) -> np.ndarray:
    """One column in SI; missing readings are NaN. Labels stay text."""
    si = COLUMNS[name]
    if si is None:
        return _labels(cells, head, place)
    if _is_stamped(name, cells):
        return _stamped(cells, head, place)
    numbers = _numbers(cells, head, place)
    if unit is None:
        cure = f'write in muscle.toml units = {{ {name} = "{USUAL[si]}" }}'
        if place.header_row is not None:
            cure = f"write '{name} [{USUAL[si]}]' in the header, or {cure.replace('write ', '')}"
        raise InputError("the column has no unit", place.path, place.header_row, head, cure=cure)
    try:
        factor = units.load_factor(unit) if si == "load" else units.factor(unit, si)
    except InputError as error:
        raise error.located(place.path, place.header_row, head) from None
    beyond = np.abs(numbers) > TABLES.largest_number / factor
    if beyond.any():
        at = int(np.argmax(beyond))
        cure = "write a reading that can be measured; leave the cell empty where one is missing"
        problem = f"the number is too large{alike(place.rows[beyond])}"
        raise InputError(problem, place.path, int(place.rows[at]), head, numbers[at], cure)
    return numbers * factor


def _is_stamped(name: str, cells: pd.Series) -> bool:
    return name == "time" and not pd.api.types.is_numeric_dtype(cells) and are_stamps(cells)


def _stamped(cells: pd.Series, head: str, place: _Place) -> np.ndarray:
    """Seconds of stamps, which need no unit; one that cannot be read is an error."""
    seconds = seconds_of(cells)
    wrong = np.isnan(seconds) & cells.notna().to_numpy()
    if wrong.any():
        at = int(np.argmax(wrong))
        problem = f"not a moment such as {cells.dropna().iloc[0]}{alike(place.rows[wrong])}"
        raise InputError(problem, place.path, int(place.rows[at]), head, str(cells.iloc[at]), CURE)
    return seconds


def _labels(cells: pd.Series, head: str, place: _Place) -> np.ndarray:
    empty = cells.isna().to_numpy()
    if empty.any():
        problem = f"the cell is empty{alike(place.rows[empty])}"
        raise InputError(problem, place.path, int(place.rows[np.argmax(empty)]), head, cure="fill it in every row")
    if pd.api.types.is_float_dtype(cells) and ((cells % 1 == 0) & (cells.abs() < 2**53)).all():
        cells = cells.astype(int)
    return cells.astype(str).str.strip().to_numpy(dtype=object)


def _numbers(cells: pd.Series, head: str, place: _Place) -> np.ndarray:
    """Cells as numbers; infinite ones are missing; text is an error."""
    if not pd.api.types.is_numeric_dtype(cells) or pd.api.types.is_bool_dtype(cells):
        texts = cells.astype(str).str.strip()
        if place.decimal == ",":  # a point may then stand for thousands: no number
            texts = texts.str.replace(".", "?").str.replace(",", ".")
        numbers = pd.Series(pd.to_numeric(texts.where(cells.notna()), errors="coerce"))
        wrong = np.asarray(numbers.isna() & cells.notna())
        if wrong.any():
            at = int(np.argmax(wrong))
            text = str(cells.iloc[at])
            problem, cure = f"not a number{alike(place.rows[wrong])}", _number_cure(text, place.decimal, at == 0)
            raise InputError(problem, place.path, int(place.rows[at]), head, text, cure)
        cells = numbers
    numbers = cells.to_numpy(dtype=float, copy=True)
    numbers[~np.isfinite(numbers)] = np.nan
    if np.isnan(numbers).all():
        raise InputError(
            "the column holds no reading", place.path, place.header_row, head, cure="fill it in, or delete the column"
        )
    return numbers


def _number_cure(text: str, decimal: str, first: bool) -> str:
    """What to do about a cell that is no number; `first`: it stands in the row below the header."""
    if decimal == "," and NUMBER.fullmatch(text):
        return "write a decimal comma as in the other cells, and nothing between thousands"
    if re.fullmatch(r"\s*[+-]?\d+,\d+\s*", text):
        return "write decimal points throughout, or decimal commas throughout and semicolons between the cells"
    if UNCLEAR.fullmatch(text):
        return CURE
    if found := re.fullmatch(r"\s*[+-]?\d+\.?\d*\s*([A-Za-zµ°%]+[/\w]*)\s*", text):
        return f"write the number alone, and its unit in the header: [{found[1]}]"
    if text in FAILED:
        return "the formula in this cell has failed: mend it in the spreadsheet, or leave the cell empty"
    if first and not re.search(r"\d", text):
        return "if this row holds the units, write them in the header, as in 'force [N]', and delete the row"
    return "write a number; leave the cell empty where a reading is missing; begin comment lines with '#'"
