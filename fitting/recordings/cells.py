"""Cells of a table as text."""

import re
from collections.abc import Sequence

NUMBER = re.compile(r"\s*[+-]?(?:\d+[.,]?\d*|[.,]\d+)(?:[eE][+-]?\d+)?\s*")


def filled(cells: Sequence[str]) -> Sequence[str]:
    """The cells up to the last that is not empty: a row may end with separators."""
    return cells[: max((at + 1 for at, cell in enumerate(cells) if cell.strip()), default=0)]
