"""One sheet of an Excel workbook. Formulas are never evaluated: the values that Excel kept beside them are read."""

import io
import re
import warnings
import zipfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from fitting.errors import InputError, unknown_name
from fitting.recordings.header import header_at, readings_above
from fitting.recordings.settings import TABLES
from fitting.recordings.source import FAILED, Source, printable, series_of
from fitting.recordings.table_cells import NO_ROW
from fitting.recordings.table_text import bytes_of
from fitting.recordings.units_row import with_units

SAVE_AS_CSV = "save the sheet as CSV (UTF-8), and name that file in muscle.toml"
SAVE_AGAIN = "open it in Excel or LibreOffice and save it again as .xlsx; or save the sheet as CSV (UTF-8)"
Rows = list[tuple[int, list[Any]]]  # the number of a row, and its cells


def sheet_source(path: Path, sheet: str | None, is_head: Callable[[str], bool]) -> Source:
    """One sheet as a recording; `sheet` may be left out where only one has cells."""
    raw = bytes_of(path)
    sheets = {name: rows for name, rows in _sheets(raw, path, sheet) if rows or sheet is not None}
    name = _chosen(sheets, sheet, is_head, path)
    (header_row, header), *body = _without_remarks(sheets[name], is_head, path)
    heads = [_text(cell) for cell in header]
    named = with_units(heads, [_text(cell) for cell in body[0][1]]) if body else None
    if named is not None:
        heads, body = named, body[1:]
    if not body:
        raise InputError(NO_ROW, path, header_row, cure="put the readings below it")
    width = max(len(cells) for _, cells in body)
    columns = [[cells[at] if at < len(cells) else None for _, cells in body] for at in range(max(width, len(heads)))]
    _check_heads(heads, columns, header_row, path)
    place = np.array([row for row, _ in body])
    _check_formulas(raw, name, place, heads, columns, path)
    return Source(heads, header_row, place, raw, lambda: ([series_of(c) for c in columns[: len(heads)]], "."))


def sheet_names(path: Path) -> list[str]:
    """The sheets of a workbook that have cells; none where it cannot be read."""
    try:
        return [name for name, rows in _sheets(bytes_of(path), path, None) if rows]
    except InputError:
        return []


# ------------------------------------------------------------------------------------------------- what openpyxl reads


def _sheets(raw: bytes, path: Path, only: str | None, formulas: bool = False) -> Iterator[tuple[str, Rows]]:
    """The rows of every sheet that have a cell with something in it, or of `only` one; formulas, or their values."""
    _check_archive(raw, path)
    with _workbook(raw, path, formulas) as book:
        for sheet in book.worksheets:
            sheet.reset_dimensions()  # what a program has written there is not always true
            yield sheet.title, _filled(sheet, path) if only in (None, sheet.title) else []


@contextmanager
def _workbook(raw: bytes, path: Path, formulas: bool) -> Iterator[Any]:
    """The workbook, read row by row; whatever goes wrong in it is one message."""
    try:
        from openpyxl import load_workbook
    except ImportError:
        cure = f"pip install 'mckibben-jax[files]'; or {SAVE_AS_CSV}"
        raise InputError("an Excel file needs openpyxl", path, cure=cure) from None
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # about styles and pictures, which nobody asked for
            book = load_workbook(io.BytesIO(raw), read_only=True, data_only=not formulas, keep_links=False)
            yield book
            book.close()
    except InputError:
        raise
    except Exception as error:  # openpyxl trusts its input: a damaged one ends in any exception that there is
        problem = f"the workbook is damaged ({type(error).__name__})"
        raise InputError(problem, path, cure=SAVE_AGAIN) from None


def _check_archive(raw: bytes, path: Path) -> None:
    """Refuse what is no workbook, and one that would unpack to more than a recording can be."""
    if raw.startswith(b"\xd0\xcf\x11\xe0"):
        problem = "this workbook is of the old kind (.xls), or protected by a password"
        raise InputError(problem, path, cure="save it without a password as .xlsx, or as CSV (UTF-8)")
    try:
        with zipfile.ZipFile(io.BytesIO(raw)) as archive:
            size = sum(entry.file_size for entry in archive.infolist())
    except Exception:  # damaged archives end in many kinds of exception
        raise InputError("this is no Excel workbook, or it breaks off", path, cure=SAVE_AGAIN) from None
    if size > TABLES.unpacked_bytes:
        problem = f"the workbook unpacks to more than {TABLES.unpacked_bytes / 1e6:g} MB"
        raise InputError(problem, path, value=f"{size / 1e6:.0f} MB", cure=SAVE_AS_CSV)


def _filled(sheet: Any, path: Path) -> Rows:
    rows: Rows = []
    for number, cells in enumerate(sheet.iter_rows(values_only=True), 1):
        if number > TABLES.sheet_rows:
            raise InputError(f"the sheet has more than {TABLES.sheet_rows:,} rows", path, cure=SAVE_AS_CSV)
        if any(cell is not None and _text(cell) for cell in cells):
            rows.append((number, list(cells)))
    return rows


# ------------------------------------------------------------------------------------------------ which sheet and rows


def _chosen(sheets: dict[str, Rows], sheet: str | None, is_head: Callable[[str], bool], path: Path) -> str:
    """The sheet that was named, or the only one with cells, or the only one with heads that are ours."""
    if not sheets:
        raise InputError("the workbook is empty", path, cure="begin with a header: 'time [s]', 'pressure [kPa]', ...")
    if sheet is not None:
        if sheet not in sheets:
            raise unknown_name("sheet", sheet, sheets, path)
        return sheet
    known = [name for name, rows in sheets.items() if _most_heads(rows, is_head) > 1]
    if len(sheets) > 1 and len(known) != 1:
        names, first = ", ".join(f"'{name}'" for name in sheets), (known or [*sheets])[0]
        cure = f'add sheet = "{first}" below file in muscle.toml; every sheet is a [[recording]] of its own'
        raise InputError(f"the workbook has {len(sheets)} sheets with cells: {names}", path, cure=cure)
    return (known or [*sheets])[0]


def _most_heads(rows: Rows, is_head: Callable[[str], bool]) -> int:
    """How many heads of ours stand in one row near the top."""
    return max(sum(map(is_head, map(_text, cells))) for _, cells in rows[: TABLES.lines_before_header])


def _without_remarks(rows: Rows, is_head: Callable[[str], bool], path: Path) -> Rows:
    """The rows from the header on; those whose first cell begins with '#' are remarks."""
    kept = [(number, cells) for number, cells in rows if not _is_remark(cells[0])]
    if not kept:
        raise InputError("the sheet is empty", path, cure="begin with a header: 'time [s]', 'pressure [kPa]', ...")
    texts = [[*map(_text, cells)] for _, cells in kept[: TABLES.lines_looked_at]]
    at = header_at(texts, is_head)
    if readings_above(texts, at) is not None:
        cure = "delete the rows above it, or begin the first cell of each with '#'"
        shown = ", ".join(texts[at])[:60]
        raise InputError("there are readings above the header", path, kept[at][0], value=shown, cure=cure)
    kept = kept[at:]
    if not any(isinstance(cell, str) for cell in kept[0][1]):
        cure = "begin with a header: 'time [s]', 'pressure [kPa]', ..."
        raise InputError("there is no header, the sheet begins with numbers", path, kept[0][0], cure=cure)
    return kept


def _is_remark(cell: Any) -> bool:
    return _text(cell).startswith("#") and _text(cell) not in FAILED


def _text(cell: Any) -> str:
    return "" if cell is None else printable(re.sub(r"\s+", " ", str(cell)).strip())


def _check_heads(heads: list[str], columns: list[list[Any]], header_row: int, path: Path) -> None:
    """Refuse readings under an empty head: the head of a merged cell stands in the first of its columns only."""
    for at, column in enumerate(columns):
        numbers = sum(isinstance(cell, (int, float)) for cell in column)
        if not (at < len(heads) and heads[at]) and numbers > len(column) / 2:
            cure = "write a head there; if head cells are merged, separate them and name every column"
            problem = f"the head of column {_letters(at)} is empty, and readings stand below it"
            raise InputError(problem, path, header_row, cure=cure)


def _letters(at: int) -> str:
    """0 -> 'A', 26 -> 'AA': as a spreadsheet names its columns."""
    return (_letters(at // 26 - 1) if at >= 26 else "") + chr(ord("A") + at % 26)


def _check_formulas(
    raw: bytes, name: str, place: np.ndarray, heads: list[str], columns: list[list[Any]], path: Path
) -> None:
    """Refuse a formula that no spreadsheet has computed: programs that write workbooks leave its value out."""
    if not any(cell is None for column in columns[: len(heads)] for cell in column):
        return
    written = dict(dict(_sheets(raw, path, name, formulas=True))[name])
    for at, head in enumerate(heads):
        for number, cell in zip(place.tolist(), columns[at], strict=True):
            formula = written.get(number, [])[at : at + 1] if cell is None else []
            if formula and formula[0] is not None:
                cure = "open the file in Excel or LibreOffice and save it; this program computes no formulas"
                shown = getattr(formula[0], "text", formula[0])  # one over several cells is an object of openpyxl's
                raise InputError("the formula in this cell has no value", path, number, head, shown, cure)
