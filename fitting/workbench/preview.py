"""What dropped files hold: their first rows and the course of each column, seen before one says what they are."""

import html
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import zip_longest
from pathlib import Path

import numpy as np
import pandas as pd

from fitting.recordings.tables import read_cells
from fitting.showing import counted

ROWS = 10  # of a table
POINTS = 120  # at which a course is drawn, each by its least and its largest reading: a spike is not lost
WIDE, HIGH = 120, 22  # of the drawing, px
LABELS = 3  # of a column of text


@dataclass(frozen=True)
class ColumnPreview:
    """One column of a file: its first cells as text, and all its readings; those that are no numbers are NaN."""

    head: str
    first: tuple[str, ...]
    numbers: np.ndarray
    labels: tuple[str, ...]  # the different texts, where it holds no numbers

    @property
    def extent(self) -> str:
        """From where to where it goes, in words."""
        if self.labels:
            more = ", ..." if len(self.labels) > LABELS else ""
            return ", ".join(self.labels[:LABELS]) + more
        numbers = self.numbers[np.isfinite(self.numbers)]
        return f"{numbers.min():.4g} to {numbers.max():.4g}" if numbers.size else "empty"


def previews(path: Path, inside: Mapping[str, str]) -> tuple[ColumnPreview, ...]:
    """The columns of a recording as they stand in the file; `inside` as of `read_table`."""
    heads, cells, decimal = read_cells(path, inside)
    return tuple(_preview(head, column, decimal) for head, column in zip(heads, cells, strict=False))


def _preview(head: str, cells: pd.Series, decimal: str) -> ColumnPreview:
    texts = cells.astype(object).where(cells.notna(), "").map(_text)
    plain = texts.str.replace(",", ".") if decimal == "," else texts
    numbers = np.asarray(pd.to_numeric(plain.where(plain != ""), errors="coerce"), float)
    filled = texts[texts != ""]
    labels = () if np.isfinite(numbers).any() or filled.empty else tuple(dict.fromkeys(filled))
    return ColumnPreview(head, tuple(texts[:ROWS]), numbers, labels)


def _text(cell: object) -> str:
    return f"{cell:.6g}" if isinstance(cell, float) else str(cell).strip()


# Drawn ----------------------------------------------------------------------------------------------------------------


def rows_html(columns: Sequence[ColumnPreview]) -> str:
    """The first rows of a file as a table that opens at a click."""
    heads = "".join(f"<th>{html.escape(column.head)}</th>" for column in columns)
    rows = zip_longest(*(column.first for column in columns), fillvalue="")
    body = "".join(f"<tr>{''.join(f'<td>{html.escape(cell)}</td>' for cell in row)}</tr>" for row in rows)
    count = max((len(column.numbers) for column in columns), default=0)
    return (
        f'<div class="bench"><details><summary>{counted(count, "row")}; the first of them</summary>'
        f'<div class="scroll" tabindex="0"><table><tr>{heads}</tr>{body}</table></div></details></div>'
    )


def column_html(column: ColumnPreview) -> str:
    """A column's name, its course in small, and from where to where it goes."""
    return (
        f'<div class="bench column"><code>{html.escape(column.head)}</code>{sparkline(column)}'
        f"<small>{html.escape(column.extent)}</small></div>"
    )


def sparkline(column: ColumnPreview) -> str:
    """The course of a column's readings as a line of a few words' size; empty where there is none to draw."""
    numbers = column.numbers
    known = np.isfinite(numbers)
    if known.sum() < 2:
        return ""
    low, high = float(numbers[known].min()), float(numbers[known].max())
    parts = np.array_split(numbers, min(POINTS, len(numbers)))
    points = []
    for at, part in enumerate(parts):
        part = part[np.isfinite(part)]
        x = WIDE * at / max(len(parts) - 1, 1)
        ends = dict.fromkeys((part.min(), part.max())) if part.size else ()
        points += [f"{x:.1f},{HIGH - 1 - (HIGH - 2) * _share(end, low, high):.1f}" for end in ends]
    course = f"Course of {column.head}: {column.extent}"
    return (
        f'<svg class="course" viewBox="0 0 {WIDE} {HIGH}" width="{WIDE}" height="{HIGH}" role="img" '
        f'aria-label="{html.escape(course)}"><polyline points="{" ".join(points)}"/></svg>'
    )


def _share(value: float, low: float, high: float) -> float:
    """Where between two numbers another one is; in the middle where they are the same."""
    return (value - low) / (high - low) if high > low else 0.5
