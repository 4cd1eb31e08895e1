"""How text stands on the terminal: lines with a label, tables without rules, commands to be pasted."""

import os
import sys
from collections.abc import Collection, Iterable, Sequence

from rich.cells import cell_len
from rich.console import Console, ConsoleOptions, RenderableType, RenderResult
from rich.measure import Measurement
from rich.table import Table
from rich.text import Text

from fitting.report.settings import LAYOUT


class Lasting(Console):
    """A console whose reader may leave (`| head`): what was computed is saved all the same."""

    def on_broken_pipe(self) -> None:
        """Say nothing any more."""
        self.quiet = True
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def console(quiet: bool = False) -> Console:
    """The terminal; a file or pipe is written to at a fixed width."""
    plain = Lasting(highlight=False, markup=False, quiet=quiet)
    if plain.is_terminal or "COLUMNS" in os.environ:
        return plain
    return Lasting(highlight=False, markup=False, quiet=quiet, width=LAYOUT.width)


def line(label: str, text: str, style: str = "") -> RenderableType:
    """A line 'WHERE   ...' whose text stays to the right of its label."""
    grid = Table.grid(padding=(0, 1))
    grid.add_column(width=LAYOUT.label, no_wrap=True)
    grid.add_column(overflow="fold")
    grid.add_row(Text(label, style="bold"), Text(text, style=style))
    return grid


def paste_line(label: str, command: str) -> Text:
    """A command behind its label, which no narrow terminal breaks: it can be pasted."""
    return Text.assemble((label.ljust(LAYOUT.label + 1), "bold"), command)


def lines(label: str, texts: Iterable[str], style: str = "") -> list[RenderableType]:
    """The label beside the first of several lines."""
    return [line(label if not number else "", text, style) for number, text in enumerate(texts)]


class TextTable:
    """A table without rules. Where the terminal is narrow, columns that are spare go; if that is not enough, columns of
    words are broken between words. A word or a number is never split.
    """

    def __init__(self, heads: Sequence[str], words: Collection[int], spare: Sequence[int]):
        self.heads, self.words, self.spare = tuple(heads), words, spare
        self.rows: list[tuple[Sequence[str | Text], str]] = []

    def add_row(self, *cells: str | Text, style: str = "") -> None:
        """One more row; cells that are not given stay empty."""
        self.rows.append(((*cells, *[""] * (len(self.heads) - len(cells))), style))

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        """The table with as many of its columns as there is room for."""
        unbounded = options.update(width=LAYOUT.unbounded)
        fits = lambda table: Measurement.get(console, unbounded, table).minimum <= options.max_width  # noqa: E731
        shown = list(range(len(self.heads)))
        for column in self.spare:
            if fits(self._table(shown)):
                break
            shown.remove(column)
        table = self._table(shown)
        yield table if fits(table) else self._table(shown, broken=True)

    def _table(self, shown: Sequence[int], broken: bool = False) -> Table:
        """The columns that are shown; `broken`: those of words may be as narrow as their longest word."""
        table = Table(box=None, pad_edge=False, padding=(0, 2))
        for number in shown:
            side, last = ("left" if number in self.words else "right"), number == len(self.heads) - 1
            cells = [self.heads[number], *(str(row[number]) for row, _ in self.rows)]
            widest = max(map(cell_len, cells))
            least = min(widest, LAYOUT.note) if last else widest
            if broken and number in self.words:
                least = max(cell_len(word) for cell in cells for word in cell.split() or [""])
            table.add_column(self.heads[number], justify=side, header_style="dim", min_width=least, overflow="fold")
        for cells, style in self.rows:
            table.add_row(*(cells[number] for number in shown), style=style)
        return table


def columns(*heads: str, words: Collection[int] = (0,), spare: Sequence[int] = ()) -> TextTable:
    """An empty table; `words` are columns of words, which stand to the left; of `spare` ones the first goes first."""
    return TextTable(heads, words, spare)


def spaced(table: TextTable) -> RenderableType:
    """A table below an empty line."""
    grid = Table.grid()
    grid.add_row("")
    grid.add_row(table)
    return grid
