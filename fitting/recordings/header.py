"""Which row of a table is its header: many loggers write rows about the rig and the day above it."""

import csv
from collections import Counter
from collections.abc import Callable, Sequence

from fitting.recordings.cells import NUMBER, filled
from fitting.recordings.settings import TABLES
from fitting.recordings.units_row import with_units

SEPARATORS = ";\t,"  # a comma may be a decimal mark where another one separates
FEWEST = 2  # cells of a table, and numbers in a row of readings
Rows = Sequence[Sequence[str]]


def header_at(rows: Rows, is_head: Callable[[str], bool]) -> int:
    """The place of the header among rows of cells that are no comments.

    It is the first with two heads or more that the program knows (`is_head` of a cell). Where there is none, it is the
    first row, unless that has fewer cells than the table: then it is the row above the first readings, or above a row
    of units.
    """
    first = [filled(cells) for cells in rows[: TABLES.lines_before_header]]
    known = next((at for at, cells in enumerate(first) if sum(map(is_head, cells)) >= FEWEST), None)
    if known is not None:
        return known
    width = _most(rows)[0]
    return 0 if len(first[0]) >= width else _above_readings(first, width)


def readings_above(rows: Rows, header: int) -> int | None:
    """The place of the first row above the header that holds nothing but numbers, as readings do; None: there is none.

    They would be lost.
    """
    above = (filled(cells) for cells in rows[:header])
    return next((at for at, cells in enumerate(above) if len(cells) >= FEWEST and _numbers(cells) == len(cells)), None)


def rows_of(lines: Sequence[str]) -> Rows:
    """The first lines of a CSV as cells, by whatever separates most lines into equally many."""
    some = lines[: TABLES.lines_looked_at]
    return max((_split(some, separator) for separator in SEPARATORS), key=lambda rows: _most(rows)[1])


def _split(lines: Sequence[str], separator: str) -> Rows:
    try:
        return [next(csv.reader([line], delimiter=separator, skipinitialspace=True), []) for line in lines]
    except csv.Error:  # said in words by whoever reads the whole table
        return [line.split(separator) for line in lines]


def _most(rows: Rows) -> tuple[int, int]:
    """How many cells the table has, which are at least two, and how many rows have them; 1 and 0 where none has.

    The later half tells, for the table may have fewer rows than stand above it.
    """
    widths = Counter(len(filled(cells)) for cells in rows[len(rows) // 2 :])
    tables = [(count, width) for width, count in widths.items() if width >= FEWEST]
    count, width = max(tables, default=(0, 1))
    return width, count


def _above_readings(rows: Rows, width: int) -> int:
    """The row above the first readings of so many cells; the first of all where there are none."""
    begin = next((at for at, cells in enumerate(rows) if len(cells) == width and _numbers(cells) >= FEWEST), 0)
    if begin > 1 and len(rows[begin - 2]) == width and with_units(rows[begin - 2], rows[begin - 1]) is not None:
        return begin - 2
    return begin - 1 if begin > 0 and len(rows[begin - 1]) >= FEWEST else begin


def _numbers(cells: Sequence[str]) -> int:
    return sum(NUMBER.fullmatch(cell) is not None for cell in cells)
