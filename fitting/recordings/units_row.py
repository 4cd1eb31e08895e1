"""A row of units below the header, as test machines and many loggers write it: '(s)', '[bar]', 'mm'."""

import re
from collections.abc import Sequence

from fitting.recordings.cells import NUMBER, filled
from fitting.units import is_unit

_NAMED = re.compile(r".*(\[[^\]]*\]|\([^)]*\))\s*", re.DOTALL)  # a head that has a unit already
_CLOCK = re.compile(r"[hHmMsSdDyYfT0 :.,/_-]*(?:hh|HH|mm|MM|dd|DD|yy)[hHmMsSdDyYfT0 :.,/_-]*")  # 'hh:mm:ss'
_NONE = ("", "\N{EM DASH}", "n/a", "N/A", "NA", "na", "NaN", "nan")  # below the head of a column without a unit
FEWEST_UNITS = 2  # in a row of units: one alone may be a word
LONGEST = 8  # letters of a unit that is none of ours


def with_units(heads: Sequence[str], below: Sequence[str]) -> list[str] | None:
    """The heads with the units that the row `below` them gives, as 'force [N]'; None where that row gives none.

    It does where no cell is a reading, at least two are units, and none is another one than its head names already.
    A short text that is no unit of ours ('degC') belongs to a column that nobody uses, or will be asked for.
    """
    below = filled(below)
    found = [_bare(cell) for cell in below] + [""] * (len(heads) - len(below))
    if len(below) > len(heads) or not all(map(_may_stand_there, found)):
        return None
    if sum(is_unit(cell) for cell in found if cell not in _NONE and not _is_clock(cell)) < FEWEST_UNITS:
        return None
    named = [_NAMED.fullmatch(head) for head in heads]
    if any(head and is_unit(unit) and unit not in _NONE and _bare(head[1]) != unit
           for head, unit in zip(named, found, strict=True)):  # fmt: skip
        return None
    return [head if has else _with_unit(head, unit) for head, has, unit in zip(heads, named, found, strict=True)]


def _may_stand_there(cell: str) -> bool:
    """Whether a cell may be a unit: it is one, or a short text without a digit."""
    if cell in _NONE or cell == "1" or _is_clock(cell):
        return True
    return not NUMBER.fullmatch(cell) and (is_unit(cell) or (len(cell) <= LONGEST and not re.search(r"\d", cell)))


def _bare(cell: str) -> str:
    """'(mm)' and '[mm]' -> 'mm'."""
    cell = cell.strip()
    return cell[1:-1].strip() if cell[:1] + cell[-1:] in ("()", "[]") else cell


def _is_clock(cell: str) -> bool:
    return ":" in cell and _CLOCK.fullmatch(cell) is not None


def _with_unit(head: str, unit: str) -> str:
    return f"{head} [{unit}]" if head and unit not in _NONE and not _is_clock(unit) and is_unit(unit) else head
