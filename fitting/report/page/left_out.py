"""How well each data set is predicted by a fit of the others, as a part of a page."""

from collections.abc import Sequence

from fitting.least_squares.left_out_sets import LeftOutSet
from fitting.report.page.parts import Grid, Line, Section
from fitting.report.text.left_out import left_out_table, left_out_texts


def left_out_section(found: Sequence[LeftOutSet]) -> Section:
    """What the terminal says of it: sentences and a table."""
    heads, rows = left_out_table(found)
    grid = Grid(heads, tuple(map(Line, rows)), words=(0,))
    return Section("Each data set left out", sentences=tuple(left_out_texts(found)), tables=(grid,), rail="Evidence")
