"""Which row of a table is its header: many loggers write rows about the rig and the day above it."""

import re
from collections.abc import Callable, Sequence
from statistics import multimode

from fitting.recordings.settings import TABLES

NUMBER = re.compile(r"\s*[+-]?(?:\d+[.,]?\d*|[.,]\d+)(?:[eE][+-]?\d+)?\s*")
SEPARATORS = ";\t,"  # a comma may be a decimal mark where another one separates
FEWEST = 2  # cells of a table, and numbers in a row of readings
Rows = Sequence[Sequence[str]]


def header_at(rows: Rows, is_head: Callable[[str], bool]) -> int:
    """The place of the header among rows of cells that are no comments.

    It is the first with heads that the program knows (`is_head` of a cell). Where there is none, it is the first row,
    unless that has fewer or more cells than most rows: then it is the row above the first readings, or above a row of
    units.
    """
    first = [filled(cells) for cells in rows[: TABLES.lines_before_header]]
    known = [sum(map(is_head, cells)) for cells in first]
    if known[0]:
        return 0
    found = next((at for at, count in enumerate(known) if count >= FEWEST), None)
    if found is not None:
        return found
    width = _most(rows)
    return 0 if width < FEWEST or len(first[0]) == width else _above_readings(first, width)


def rows_of(lines: Sequence[str]) -> Rows:
    """The first lines of a CSV as cells, by whatever separates them in most lines; quotes are dropped."""
    some = [line.replace('"', "") for line in lines[: TABLES.lines_looked_at]]
    cut = ([line.split(separator) for line in some] for separator in SEPARATORS)
    return next((rows for rows in cut if _most(rows) >= FEWEST), [[line] for line in some])


def _most(rows: Rows) -> int:
    """How many cells most rows have."""
    return max(multimode(len(filled(cells)) for cells in rows))


def filled(cells: Sequence[str]) -> Sequence[str]:
    """The cells up to the last that is not empty: a row may end with separators."""
    return cells[: max((at + 1 for at, cell in enumerate(cells) if cell.strip()), default=0)]


def _above_readings(rows: Rows, width: int) -> int:
    """The row above the first readings of so many cells; the first of all where there are none."""
    numbers = [sum(map(bool, map(NUMBER.fullmatch, cells))) for cells in rows]
    begin = next((at for at, cells in enumerate(rows) if len(cells) == width and numbers[at] >= FEWEST), 0)
    if begin > 1 and len(rows[begin - 1]) == len(rows[begin - 2]) == width:
        return begin - 2
    return begin - 1 if begin > 0 and len(rows[begin - 1]) >= FEWEST else begin
