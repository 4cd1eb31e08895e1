"""A row of units below the header, as test machines and many loggers write it: '(s)', '[bar]', 'mm'."""

import re
from collections.abc import Sequence

from fitting.recordings.table_cells import NUMBER
from fitting.units import is_unit

_NAMED = re.compile(r".*(\[[^\]]*\]|\([^)]*\))\s*", re.DOTALL)  # a head that has a unit already
_CLOCK = re.compile(r"[hHmMsSdDyYfT0 :.,/_-]*(?:hh|HH|mm|MM|dd|DD|yy)[hHmMsSdDyYfT0 :.,/_-]*")  # 'hh:mm:ss'
_NONE = ("", "-")  # what stands below the head of a column that has no unit


def with_units(heads: Sequence[str], below: Sequence[str]) -> list[str] | None:
    """The heads with the units that the row `below` them gives, as 'force [N]'; None where that row gives none.

    It does where each of its cells is a unit, the form of a clock or nothing, at least one is a unit, and none is
    another one than its head names already.
    """
    below = _filled(below)
    if len(below) > len(heads) or any(NUMBER.fullmatch(cell) for cell in below if cell):
        return None
    found = [_bare(cell) for cell in below] + [""] * (len(heads) - len(below))
    if not any(cell not in _NONE and is_unit(cell) for cell in found):
        return None
    if not all(cell in _NONE or is_unit(cell) or _is_clock(cell) for cell in found):
        return None
    named = [_NAMED.fullmatch(head) for head in heads]
    if any(head and unit not in _NONE and _bare(head[1]) != unit for head, unit in zip(named, found, strict=True)):
        return None
    return [head if known else _with_unit(head, unit) for head, known, unit in zip(heads, named, found, strict=True)]


def _filled(cells: Sequence[str]) -> Sequence[str]:
    """The cells up to the last that is not empty: a line may end with separators."""
    return cells[: max((at + 1 for at, cell in enumerate(cells) if cell.strip()), default=0)]


def _bare(cell: str) -> str:
    """'(mm)' and '[mm]' -> 'mm'."""
    cell = cell.strip()
    return cell[1:-1].strip() if cell[:1] + cell[-1:] in ("()", "[]") else cell


def _is_clock(cell: str) -> bool:
    return ":" in cell and _CLOCK.fullmatch(cell) is not None


def _with_unit(head: str, unit: str) -> str:
    return head if unit in _NONE or _is_clock(unit) or not head else f"{head} [{unit}]"
