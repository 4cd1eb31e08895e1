"""How text stands on the terminal: lines with a label, tables without rules, commands to be pasted."""

import os
import sys
from collections.abc import Collection, Iterable

from rich.console import Console, RenderableType
from rich.table import Table
from rich.text import Text

WIDTH = 110  # where the output is no terminal
LABEL = 9


class Lasting(Console):
    """A console whose reader may leave (`| head`): what was computed is saved all the same."""

    def on_broken_pipe(self) -> None:
        """Say nothing any more."""
        self.quiet = True
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def console(quiet: bool = False) -> Console:
    """The terminal; a file or pipe is written to at a fixed width."""
    plain = Lasting(highlight=False, markup=False, quiet=quiet)
    return plain if plain.is_terminal else Lasting(highlight=False, markup=False, quiet=quiet, width=WIDTH)


def line(label: str, text: str, style: str = "") -> RenderableType:
    """A line 'WHERE   ...' whose text stays to the right of its label."""
    grid = Table.grid(padding=(0, 1))
    grid.add_column(width=LABEL, no_wrap=True)
    grid.add_column(overflow="fold")
    grid.add_row(Text(label, style="bold"), Text(text, style=style))
    return grid


def paste_line(label: str, command: str) -> Text:
    """A command behind its label, which no narrow terminal breaks: it can be pasted."""
    return Text.assemble((label.ljust(LABEL + 1), "bold"), command)


def lines(label: str, texts: Iterable[str], style: str = "") -> list[RenderableType]:
    """The label beside the first of several lines."""
    return [line(label if not number else "", text, style) for number, text in enumerate(texts)]


def spaced(table: Table) -> RenderableType:
    """A table below an empty line."""
    grid = Table.grid()
    grid.add_row("")
    grid.add_row(table)
    return grid


def columns(*heads: str, words: Collection[int] = (0,), title: str | None = None) -> Table:
    """An empty table without rules; `words` are the columns that hold words, which stand to the left."""
    table = Table(box=None, pad_edge=False, padding=(0, 2), title=title, title_justify="left", title_style="bold")
    for number, head in enumerate(heads):
        table.add_column(head, justify="left" if number in words else "right", header_style="dim", overflow="fold")
    return table
