"""How text stands on the terminal: lines with a label, tables without rules, commands to be pasted.

Texts keep the marks of their names until a console prints them, for it knows the library that gives the names.
"""

import os
import re
import sys
from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from rich.cells import cell_len
from rich.console import Console, ConsoleOptions, RenderableType, RenderResult
from rich.table import Table
from rich.text import Text

from fitting.report.settings import LAYOUT
from fitting.report.text.names import Names

Rows = Sequence[tuple[Sequence[str | Text], str]]  # cells, and the style of all
OF_THE_PROGRAM = Names()


class NamingConsole(Console):
    """A console that knows what readers call the effects of a library."""

    def __init__(self, names: Names, **options: Any) -> None:
        super().__init__(highlight=False, markup=False, **options)
        self.names = names


class Lasting(NamingConsole):
    """A console whose reader may leave (`| head`): what was computed is saved all the same."""

    def on_broken_pipe(self) -> None:
        """Say nothing any more."""
        self.quiet = True
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def console(quiet: bool = False, names: Names = OF_THE_PROGRAM) -> Console:
    """The terminal; a file or pipe is written to at a fixed width."""
    plain = Lasting(names, quiet=quiet)
    if plain.is_terminal or "COLUMNS" in os.environ:
        return plain
    return Lasting(names, quiet=quiet, width=LAYOUT.width)


def names_of(console: Console) -> Names:
    """What a console calls effects: by the program's own library, unless it has another."""
    return console.names if isinstance(console, NamingConsole) else OF_THE_PROGRAM


@dataclass(frozen=True)
class Line:
    """A text to the right of its label."""

    label: str
    text: str
    style: str

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        """The label, and the text with its names as this console says them."""
        grid = Table.grid(padding=(0, 1))
        grid.add_column(width=LAYOUT.label, no_wrap=True)
        grid.add_column(overflow="fold")
        grid.add_row(Text(self.label, style="bold"), Text(names_of(console).spoken(self.text), style=self.style))
        yield grid


def line(label: str, text: str, style: str = "") -> RenderableType:
    """A line 'WHERE   ...' whose text stays to the right of its label."""
    return Line(label, text, style)


def paste_line(label: str, command: str) -> Text:
    """A command behind its label, which no narrow terminal breaks: it can be pasted."""
    return Text.assemble((label.ljust(LAYOUT.label + 1), "bold"), command)


def lines(label: str, texts: Iterable[str], style: str = "") -> list[RenderableType]:
    """The label beside the first of several lines."""
    return [line(label if not number else "", text, style) for number, text in enumerate(texts)]


class TextTable:
    """A table without rules. Where the terminal is narrow, heads of numbers are broken between words, and cells with
    names before identifiers; then columns that are spare go; if that is not enough, columns of words are broken between
    words. A word or a number is never split.
    """

    def __init__(self, heads: Sequence[str], words: Collection[int], spare: Sequence[int]):
        self.heads, self.words, self.spare = tuple(heads), words, spare
        self.rows: list[tuple[Sequence[str | Text], str]] = []

    def add_row(self, *cells: str | Text, style: str = "") -> None:
        """One more row; cells that are not given stay empty."""
        self.rows.append(((*cells, *[""] * (len(self.heads) - len(cells))), style))

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        """The table with as many of its columns as there is room for."""
        rows = [([_spoken(console, cell) for cell in cells], style) for cells, style in self.rows]
        shown = list(range(len(self.heads)))
        for column in (*self.spare, None):
            for pieces in (_whole, _names):
                least, whole = self._widths(rows, shown, pieces)
                if sum(least) + LAYOUT.gap * (len(shown) - 1) <= options.max_width:
                    yield self._table(rows, shown, least, whole, options.max_width)
                    return
            if column is not None:
                shown.remove(column)
        yield self._table(rows, shown, *self._widths(rows, shown, str.split), options.max_width)

    def _widths(
        self, rows: Rows, shown: Sequence[int], pieces: Callable[[str], list[str]]
    ) -> tuple[list[int], list[int]]:
        """The least and the whole width of each column: those of words may be broken between `pieces` of their cells,
        the last one, often a remark, between words.
        """
        least, whole = [], []
        for number in shown:
            cells = self._cells(rows, number)
            narrow = _longest(cells, pieces if number in self.words else _whole)
            last = number == len(self.heads) - 1
            least.append(max(_longest(cells, str.split), min(narrow, LAYOUT.note)) if last else narrow)
            whole.append(_longest(cells, _whole))
        return least, whole

    def _cells(self, rows: Rows, number: int) -> list[str]:
        """A column from its head down."""
        return [self.heads[number], *(str(row[number]) for row, _ in rows)]

    def _with_broken_head(self, rows: Rows, number: int) -> int:
        """The width of a column whose head stands in several lines."""
        head, *below = self._cells(rows, number)
        return max(_longest([head], str.split), _longest(below, _whole))

    def _table(self, rows: Rows, shown: Sequence[int], least: Sequence[int], whole: Sequence[int], room: int) -> Table:
        """The columns that are shown. Where they have no room, heads of numbers are broken, which costs nothing but a
        line; if that is not enough, the widest columns are narrowed.

        Rich would narrow a column below its least width, widen it again, and cut the last one off.
        """
        widths, gaps = list(whole), LAYOUT.gap * (len(shown) - 1)
        if sum(widths) + gaps > room:
            of_numbers = [i for i, number in enumerate(shown) if number not in self.words]
            widths = [self._with_broken_head(rows, shown[i]) if i in of_numbers else w for i, w in enumerate(widths)]
        while sum(widths) + gaps > room and any(width > low for width, low in zip(widths, least, strict=True)):
            widths[max(range(len(shown)), key=lambda i: (widths[i] > least[i], widths[i]))] -= 1
        table = Table(box=None, pad_edge=False, padding=(0, LAYOUT.gap), collapse_padding=True)
        for number, width in zip(shown, widths, strict=True):
            side = "left" if number in self.words else "right"
            table.add_column(self.heads[number], justify=side, header_style="dim", width=width, overflow="fold")
        for cells, style in rows:
            table.add_row(*(cells[number] for number in shown), style=style)
        return table


def _spoken(console: Console, cell: str | Text) -> str | Text:
    return names_of(console).spoken(cell) if isinstance(cell, str) else cell


def _longest(cells: Sequence[str], pieces: Callable[[str], list[str]]) -> int:
    """Letters of the longest piece of any cell."""
    return max((cell_len(piece) for cell in cells for piece in pieces(cell)), default=0)


def _whole(cell: str) -> list[str]:
    return [cell]


def _names(cell: str) -> list[str]:
    """A cell before and behind its identifiers: 'Tip correction', '(tip)', '+ Creep', '(creep)'."""
    return re.split(r" (?=\()|(?<=\)) ", cell)


def columns(*heads: str, words: Collection[int] = (0,), spare: Sequence[int] = ()) -> TextTable:
    """An empty table; `words` are columns of words, which stand to the left; of `spare` ones the first goes first."""
    return TextTable(heads, words, spare)


def spaced(table: TextTable) -> RenderableType:
    """A table below an empty line."""
    grid = Table.grid()
    grid.add_row("")
    grid.add_row(table)
    return grid
