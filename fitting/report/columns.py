"""Tables on the terminal: columns without lines, heads that stand back, numbers to the right."""

from collections.abc import Collection

from rich.table import Table


def columns(*heads: str, words: Collection[int] = (0,)) -> Table:
    """An empty table; `words` are the columns that hold words, which stand to the left."""
    table = Table(box=None, pad_edge=False, padding=(0, 2))
    for number, head in enumerate(heads):
        table.add_column(head, justify="left" if number in words else "right", header_style="dim", overflow="fold")
    return table
