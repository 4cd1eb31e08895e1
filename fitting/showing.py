"""Values shown to people: in the unit an engineer reads them in, or in the one that the data's owner measures in."""

import math
import re
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from itertools import islice

from fitting.units import bases, factor, spelled

# A user's own units ---------------------------------------------------------------------------------------------------

# SI unit -> the unit that values are shown in, where the data's owner measures in another than the usual one. A context
# variable, so that two browser tabs, each in a thread of its own, do not mix. Files and JSON do not look at it.
_OWN: ContextVar[Mapping[str, str] | None] = ContextVar("own_units", default=None)
_USUAL_BASES = ("pascal", "newton", "meter")
_MODULUS = 1e7  # Pa: beyond, it is no gas pressure but the modulus of a strand, which nobody gives in bar


@contextmanager
def spoken(own: Mapping[str, str]) -> Iterator[None]:
    """Within this block values are shown in these units: SI unit ("Pa", "N", "m") -> the user's own ("psi")."""
    before = _OWN.set(own)
    try:
        yield
    finally:
        _OWN.reset(before)


def own_units(stated: Iterable[Mapping[str, str]]) -> dict[str, str]:
    """For `spoken`: the units that the owner of data sets reads values in, from those that files are given in.

    Left out: where the usual unit (kPa, N, mm) serves as well, and where files do not agree.
    """
    found: dict[str, set[str | None]] = {}
    for given in stated:
        for si, unit in given.items():
            found.setdefault(si, set()).add(_unless_usual(unit))
    return {si: unit for si, (unit, *others) in found.items() if unit and not others}


def _unless_usual(unit: str) -> str | None:
    written = spelled(unit)
    of_base = any(base in _USUAL_BASES for base in bases(written))
    return None if of_base and written != "MPa" else written


def _own_of(si: str, size: float) -> str | None:
    """A user's own unit for what is declared in `si`, which may be composed ("N s/m"); None where it is the usual."""
    own = _OWN.get()
    if not own or (si == "Pa" and size >= _MODULUS):
        return None
    name = re.sub(r"[A-Za-z]+", lambda part: own.get(part[0], part[0]), si)
    return name if name != si else None


# Values ---------------------------------------------------------------------------------------------------------------


def shown_in(si: str, size: float = 0.0) -> tuple[str, float]:
    """The unit an engineer reads values of this size in, and how much of `si` one of it is."""
    own = _own_of(si, size)
    if own:
        return own, factor(own, si)
    if si == "Pa":
        return ("kPa", 1e3) if size < 1e6 else ("MPa", 1e6) if size < 1e9 else ("GPa", 1e9)
    table = {"m": ("mm", 1e-3), "rad": ("deg", math.pi / 180), "m/s": ("mm/s", 1e-3), "N/m": ("N/mm", 1e3),
             "1": ("", 1.0)}  # fmt: skip
    if si == "s" and 0 < size < 1:
        return "ms", 1e-3
    return table.get(si, (si, 1.0))


def show(value: float, si: str, error: float | None = None, unit: str | None = None, digits: int = 4) -> str:
    """A value for people: '7.02 +/- 0.02 mm'; the uncertainty with two figures, the value as far as that goes.

    Without an uncertainty it has so many `digits`, and never fewer than before the point: '1063 N', not '1.06e+03 N'.
    The text can be read back by `to_si` and `measured`. `unit` imposes another unit than the usual one.
    """
    value = float(value)
    name, size = (unit, factor(unit, si)) if unit else shown_in(si, abs(value))
    tail = f" {name}" if name else ""
    if error is None or not math.isfinite(error) or error <= 0:
        return f"{figures(value / size, digits)}{tail}"
    places = max(0, 1 - math.floor(math.log10(error / size)))
    return f"{value / size:.{places}f} +/- {error / size:.{places}f}{tail}"


def figures(value: float, digits: int = 2) -> str:
    """A number with so many digits, and never fewer than before the point, up to a million."""
    shown = abs(float(f"{value:.{digits}g}"))
    before = math.floor(math.log10(shown)) + 1 if 0 < shown < math.inf else 0
    return f"{value:.{before if digits < before <= 6 else digits}g}"


def write(value: float, si: str) -> str:
    """A value for a file, in the usual unit, exact to ten figures: reading it back changes nothing that matters."""
    with spoken({}):
        return show(float(value), si, digits=10)


def numbered_rows(rows: Iterable[int], most: int = 3) -> str:
    """'row 17', 'rows 17, 18, 21, ...': where to look in a file."""
    named = [str(row) for row in islice(rows, most + 1)]
    more = ["..."] if len(named) > most else []
    return f"row{'s' * (len(named) > 1)} {', '.join(named[:most] + more)}"


def counted(count: int, what: str) -> str:
    """A number of things: "1 run", "2 runs", "3,500 samples"."""
    return f"{count:,} {what}{'' if count == 1 else 's'}"
