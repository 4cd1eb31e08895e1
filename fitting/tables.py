"""CSV files as tables in SI: separators, headers, units, and every cell checked before it becomes a number."""

import csv
import io
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from fitting import units
from fitting.errors import InputError, nearest, unknown_name

# SI unit of every column; None: a label, "load": newtons or a mass
COLUMNS = {"run": None, "time": "s", "pressure": "Pa", "set_pressure": "Pa", "contraction": "1", "length": "m",
           "displacement": "m", "force": "N", "load": "load", "branch": None}  # fmt: skip
USUAL = {"s": "s", "Pa": "kPa", "1": "1", "m": "mm", "N": "N", "load": "kg"}  # what such a column is mostly given in
OPTIONAL = ("run", "branch", "set_pressure")
_HEADER = re.compile(r"^(.*?)\s*(?:\[([^\]]*)\]|\(([^)]*)\))?$")


class _Place(NamedTuple):
    """Where cells stand: the file, the line of its header, the line of each row."""

    path: Path
    header_row: int
    rows: np.ndarray


@dataclass(frozen=True)
class Table:
    """Columns in SI by the program's names, the line of the file that each row stands in, and what was noticed."""

    file: str
    columns: dict[str, np.ndarray]
    heads: dict[str, str]  # what the file calls each column
    header_row: int
    row: np.ndarray  # line of the file, per row of the table
    unused: tuple[str, ...]  # heads of columns that are none of the program's
    raw: bytes

    def __contains__(self, name: str) -> bool:
        return name in self.columns

    def __getitem__(self, name: str) -> np.ndarray:
        return self.columns[name]

    def error(self, problem: str, at: int, column: str, value: Any = None, cure: str = "") -> InputError:
        """An error about one cell: `at` counts rows of the table."""
        return InputError(problem, self.file, int(self.row[at]), self.heads.get(column, column), value, cure)


def read_table(
    path: Path, called: Mapping[str, str] | None = None, given_units: Mapping[str, str] | None = None
) -> Table:
    """Read and check a CSV; `called` maps names to what the file calls them, `given_units` states units."""
    text, raw = _text(path)
    header_row, header, lines, rows = _lines(text, path)
    separator = _separator(header, path)
    heads = _heads(header, separator)
    called, given_units = called or {}, given_units or {}
    where, unused = _columns(heads, called, path, header_row)
    frame = _cells(lines, rows, heads, separator, path)
    _check_units_used(given_units, where, path)
    place = _Place(path, header_row, rows)
    columns = {
        name: _column(name, frame[at], heads[at], _unit_of(name, heads[at], called, given_units), place)
        for name, at in where.items()
    }
    return Table(
        str(path), columns, {name: heads[at] for name, at in where.items()}, header_row, rows, tuple(unused), raw
    )


def read_heads(path: Path) -> list[str]:
    """The header cells of a CSV as they stand there."""
    _, header, _, _ = _lines(_text(path)[0], path)
    return _heads(header, _separator(header, path))


# ------------------------------------------------------------------------------------------------------ text to cells


def _heads(header: str, separator: str) -> list[str]:
    return [head.strip() for head in next(csv.reader([header], delimiter=separator, skipinitialspace=True))]


def _text(path: Path) -> tuple[str, bytes]:
    """The file as text whatever common encoding a logger or spreadsheet wrote it in."""
    try:
        raw = path.read_bytes()
    except OSError:
        raise InputError("no such file, or it cannot be read", path, cure="check `file` in muscle.toml") from None
    if raw[:4] in (b"PK\x03\x04", b"\xd0\xcf\x11\xe0"):
        raise InputError("this is a spreadsheet, not a CSV", path, cure="save the sheet as CSV (UTF-8)")
    encoding = "utf-16" if raw[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8-sig"
    try:
        text = raw.decode(encoding)
    except UnicodeDecodeError:
        text = raw.decode("latin-1")
    if "\x00" in text:
        raise InputError("this is not a text file", path, cure="export the recording as CSV")
    return text, raw


def _lines(text: str, path: Path) -> tuple[int, str, list[str], np.ndarray]:
    """Header line and data lines with their numbers in the file; comments and blank lines are left out."""
    kept = [
        (number, line)
        for number, line in enumerate(text.replace("\r\n", "\n").replace("\r", "\n").split("\n"), 1)
        if line and not line.isspace() and not line.lstrip().startswith("#")
    ]
    if not kept:
        raise InputError("the file is empty", path, cure="begin with a header: 'time [s],pressure [kPa],...'")
    (header_row, header), *body = kept
    if not body:
        raise InputError("there is a header but no row of readings", path, header_row, cure="export the readings too")
    return header_row, header, [line for _, line in body], np.array([number for number, _ in body])


def _separator(header: str, path: Path) -> str:
    bare = re.sub(r"\[[^\]]*\]|\([^)]*\)|\"[^\"]*\"", "", header)
    found = max(";\t,", key=bare.count)
    if bare.count(found):
        return found
    if "|" in bare or len(bare.split()) > 1:
        raise InputError(
            "the columns are not separated by commas",
            path,
            value=header[:60],
            cure="separate the cells by commas (semicolons and tabs are read too)",
        )
    return ","


def _cells(lines: list[str], rows: np.ndarray, heads: list[str], separator: str, path: Path) -> list[pd.Series]:
    """The cells column by column, numbers where every cell is one; decimal commas where commas do not separate."""
    open_quote = next((at for at, line in enumerate(lines) if line.count('"') % 2), None)
    if open_quote is not None:
        raise InputError("a quotation mark is not closed", path, int(rows[open_quote]), cure="close or delete it")
    width = _checked_width(lines, rows, len(heads), separator, path)
    decimal = "," if separator != "," and _has_decimal_commas(lines) else "."
    frame = pd.read_csv(
        io.StringIO("\n".join(lines)),
        sep=separator,
        header=None,
        names=list(range(width)),
        decimal=decimal,
        skipinitialspace=True,
        skip_blank_lines=False,
        low_memory=False,
    )
    return [pd.Series(frame[at]) for at in range(len(heads))]


def _has_decimal_commas(lines: list[str]) -> bool:
    return any(re.search(r"\d,\d", line) for line in lines[:1000])


def _checked_width(lines: list[str], rows: np.ndarray, width: int, separator: str, path: Path) -> int:
    """Cells in every row, as many as the header has; one empty cell more, in all rows, is a trailing separator."""
    counts = np.array([_width(line, separator) for line in lines])
    if (counts == width + 1).all() and all(line.rstrip(" ").endswith(separator) for line in lines):
        return width + 1
    wrong = np.flatnonzero(counts != width)
    if not wrong.size:
        return width
    at = wrong[0]
    cure = "complete or delete the row"
    if separator == "," and (counts > width).mean() > 0.5:
        cure = "if these are decimal commas, separate the cells by semicolons, or write decimal points"
    raise InputError(
        f"the row has {counts[at]} cells, the header {width}", path, int(rows[at]), value=lines[at][:80], cure=cure
    )


def _width(line: str, separator: str) -> int:
    return line.count(separator) + 1 if '"' not in line else len(next(csv.reader([line], delimiter=separator)))


# --------------------------------------------------------------------------------------------------- names and units


def split_head(head: str) -> tuple[str, str | None]:
    """Name and unit of a header cell 'name [unit]' or 'name (unit)'; the unit is None where there is none."""
    match = _HEADER.match(head.strip())
    assert match is not None  # the pattern matches every text
    return match[1].strip(), match[2] if match[2] is not None else match[3]


def plain_name(head: str) -> str:
    """'Set pressure [bar]' -> 'set_pressure'."""
    return re.sub(r"[\s\-]+", "_", split_head(head)[0].lower())


def _columns(heads: list[str], called: Mapping[str, str], path: Path, row: int) -> tuple[dict[str, int], list[str]]:
    """Which column of the file is which quantity, and what columns are none; a column that a recording may do without
    is not passed over when it is only misspelt."""
    for name in called:
        if name not in COLUMNS:
            raise unknown_name("name in columns", name, COLUMNS, path)
    where = {name: _called(name, head, heads, path) for name, head in called.items()}
    free = [at for at in range(len(heads)) if at not in where.values()]
    for at in free:
        name = plain_name(heads[at])
        if name in COLUMNS and name not in called:
            if name in where:
                raise InputError(f"two columns are called {name}", path, row, heads[at], cure="keep one of them")
            where[name] = at
    unused = [heads[at] for at in free if at not in where.values() and heads[at]]
    for head in unused:
        like = nearest(plain_name(head), [name for name in OPTIONAL if name not in where], 0.75)
        if like is not None:
            raise InputError("no such column", path, row, head, cure=f"did you mean '{like}'? Else rename it")
    return where, unused


def _called(name: str, head: str, heads: list[str], path: Path) -> int:
    """The column that `columns` names: by the whole header cell, or by its name without the unit."""
    for same in (lambda h: h == head.strip(), lambda h: split_head(h)[0] == split_head(head)[0]):
        found = [at for at, h in enumerate(heads) if same(h)]
        if found:
            return found[0]
    raise unknown_name(f"column for {name}:", head, heads, path)


def _unit_of(name: str, head: str, called: Mapping[str, str], given: Mapping[str, str]) -> str | None:
    """Unit of a column: from `units`, else from the header, else from what `columns` calls it."""
    for unit in (given.get(name), split_head(head)[1], split_head(called.get(name, ""))[1]):
        if unit is not None:
            return str(unit)
    return None


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
    numbers = _numbers(cells, head, place)
    if unit is None:
        example = USUAL[si]
        cure = f"write '{name} [{example}]' in the header, or in muscle.toml units = {{ {name} = \"{example}\" }}"
        raise InputError("the column has no unit", place.path, place.header_row, head, cure=cure)
    try:
        return numbers * (units.load_factor(unit) if si == "load" else units.factor(unit, si))
    except InputError as error:
        raise InputError(error.problem, place.path, place.header_row, head, cure=error.cure) from None


def _labels(cells: pd.Series, head: str, place: _Place) -> np.ndarray:
    empty = cells.isna().to_numpy()
    if empty.any():
        raise InputError(
            "the cell is empty", place.path, int(place.rows[np.argmax(empty)]), head, cure="fill it in every row"
        )
    if pd.api.types.is_float_dtype(cells) and (cells % 1 == 0).all():
        cells = cells.astype(int)
    return cells.astype(str).str.strip().to_numpy(dtype=object)


def _numbers(cells: pd.Series, head: str, place: _Place) -> np.ndarray:
    """Cells as numbers; infinite ones are missing; text is an error."""
    if not pd.api.types.is_numeric_dtype(cells) or pd.api.types.is_bool_dtype(cells):
        numbers = pd.Series(pd.to_numeric(cells.astype(str).str.strip().where(cells.notna()), errors="coerce"))
        wrong = np.asarray(numbers.isna() & cells.notna())
        if wrong.any():
            at = int(np.argmax(wrong))
            text = str(cells.iloc[at])
            raise InputError("not a number", place.path, int(place.rows[at]), head, text, _number_cure(text))
        cells = numbers
    numbers = cells.to_numpy(dtype=float, copy=True)
    numbers[~np.isfinite(numbers)] = np.nan
    if np.isnan(numbers).all():
        raise InputError(
            "the column holds no reading", place.path, place.header_row, head, cure="fill it in, or delete the column"
        )
    return numbers


def _number_cure(text: str) -> str:
    if re.fullmatch(r"\s*[+-]?\d+,\d+\s*", text):
        return "write a decimal point, or separate the cells by semicolons throughout"
    return "write a number; leave the cell empty where a reading is missing; begin comment lines with '#'"
