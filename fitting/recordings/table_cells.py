"""The cells of a CSV: separators, header, decimal marks, and every row as wide as the header."""

import csv
import io
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd

from fitting.errors import InputError
from fitting.recordings.cells import NUMBER
from fitting.recordings.header import header_at, readings_above, rows_of
from fitting.recordings.settings import LISTED
from fitting.showing import numbered_rows

_SAYS_SEPARATOR = re.compile(r"\s*\"?sep=.\"?\s*", re.IGNORECASE)  # what spreadsheets put there
NO_ROW = "there is a header but no row of readings"


def lines_of(text: str, path: Path, is_head: Callable[[str], bool]) -> tuple[int, str, list[str], np.ndarray]:
    """Header line and data lines with their numbers in the file; comments and blank lines are left out.

    So is what stands above the header; `is_head` says whether a cell is headed as the program heads columns.
    """
    kept = [
        (number, line)
        for number, line in enumerate(text.replace("\r\n", "\n").replace("\r", "\n").split("\n"), 1)
        if line and not line.isspace() and not line.lstrip().startswith("#")
    ]
    if kept and _SAYS_SEPARATOR.fullmatch(kept[0][1]):
        del kept[0]
    if not kept:
        raise InputError("the file is empty", path, cure="begin with a header: 'time [s],pressure [kPa],...'")
    rows = rows_of([line for _, line in kept])
    at = header_at(rows, is_head)
    if readings_above(rows, at) is not None:
        number, line = kept[at]
        cure = "delete what stands above it, or begin those lines with '#'"
        raise InputError("there are readings above the header", path, number, value=line[:60], cure=cure)
    (header_row, header), *body = kept[at:]
    if not body:
        raise InputError(NO_ROW, path, header_row, cure="export the readings too")
    return header_row, header, [line for _, line in body], np.array([number for number, _ in body])


def separator_of(header: str, path: Path) -> str:
    """What separates the cells: whatever of ; tab and , stands most often outside of units and quotes."""
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


def heads_of(header: str, separator: str, path: Path) -> list[str]:
    """The header cells as they stand there."""
    heads = [head.strip() for head in split(header, separator, path)]
    if all(NUMBER.fullmatch(head) for head in heads):
        cure = "begin with a header: 'time [s],pressure [kPa],...'"
        raise InputError("there is no header, the file begins with numbers", path, value=header[:60], cure=cure)
    return heads


def split(line: str, separator: str, path: Path) -> list[str]:
    """The cells of one line."""
    try:
        return next(csv.reader([line], delimiter=separator, skipinitialspace=True))
    except csv.Error as error:
        problem = f"a line cannot be cut into cells: {error}"
        raise InputError(problem, path, value=line[:60], cure="shorten it") from None


def cells_of(
    lines: list[str], rows: np.ndarray, heads: list[str], separator: str, path: Path
) -> tuple[list[pd.Series], str]:
    """The cells column by column, numbers where every cell is one, and the decimal mark of the file.

    That is a comma only where commas do not separate and more numbers have one than have a point.
    """
    open_quote = next((at for at, line in enumerate(lines) if line.count('"') % 2), None)
    if open_quote is not None:
        raise InputError("a quotation mark is not closed", path, int(rows[open_quote]), cure="close or delete it")
    width = _checked_width(lines, rows, len(heads), separator, path)
    decimal = "," if separator != "," and _has_decimal_commas(lines, separator) else "."
    try:
        frame = pd.read_csv(
            io.StringIO("\n".join(lines)),
            sep=separator,
            header=None,
            names=list(range(width)),
            index_col=False,
            decimal=decimal,
            skipinitialspace=True,
            skip_blank_lines=False,
            low_memory=False,
        )
    except pd.errors.ParserError as error:
        said = str(error).removeprefix("Error tokenizing data. ").strip()
        raise InputError(f"the table cannot be read: {said}", path, cure="export the recording again") from None
    return [pd.Series(frame[at]) for at in range(len(heads))], decimal


def _has_decimal_commas(lines: list[str], separator: str) -> bool:
    cells = [cell for line in lines[:1000] for cell in line.split(separator) if NUMBER.fullmatch(cell)]
    return sum("," in cell for cell in cells) > sum("." in cell for cell in cells)


def _checked_width(lines: list[str], rows: np.ndarray, width: int, separator: str, path: Path) -> int:
    """Cells in every row, as many as the header has; one empty cell more, in all rows, is a trailing separator."""
    counts = np.array([_width(line, separator, path) for line in lines])
    if (counts == width + 1).all() and all(line.rstrip(" ").endswith(separator) for line in lines):
        return width + 1
    wrong = np.flatnonzero(counts != width)
    if not wrong.size:
        return width
    at = wrong[0]
    cure = "complete or delete the row, or begin it with '#'"
    if len(wrong) > 1:
        listed = numbered_rows(rows[wrong], LISTED)
        cure = f"complete or delete {listed}, which are like it, or begin them with '#'"
    if separator == "," and (counts > width).mean() > 0.5:
        cure = "if these are decimal commas, separate the cells by semicolons, or write decimal points"
    raise InputError(
        f"the row has {counts[at]} cells, the header {width}", path, int(rows[at]), value=lines[at][:80], cure=cure
    )


def _width(line: str, separator: str, path: Path) -> int:
    return line.count(separator) + 1 if '"' not in line else len(split(line, separator, path))
