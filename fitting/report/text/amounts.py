"""Amounts for people: values with their unit, errors, shares."""

import math
from collections.abc import Iterable

from fitting import showing


def amount(value: float | None, unit: str, digits: int = 3) -> str:
    """A value with this many figures, and never fewer than it has before the point: '1063 N', not '1.06e+03 N'."""
    if value is None:
        return "-"
    if not math.isfinite(value):
        return "no number"
    _, size = showing.shown_in(unit, abs(value))
    shown = abs(float(f"{value / size:.{digits}g}"))
    before = math.floor(math.log10(shown)) + 1 if shown else 0
    return showing.show(value, unit, digits=before if digits < before <= 6 else digits)


def with_error(value: float, error: float, unit: str) -> tuple[str, str]:
    """A value as far as its error goes, and the error with two figures; each with its unit."""
    both = showing.show(value, unit, error if math.isfinite(error) and error > 0 else None, digits=5)
    if "+/-" not in both:
        return both, ""
    number, _, rest = both.partition(" +/- ")
    return f"{number} {rest.partition(' ')[2]}".strip(), rest


def places(values: Iterable[float], figures: int = 3) -> int:
    """Digits behind the point that show the largest of these with so many figures."""
    top = max((abs(value) for value in values if math.isfinite(value)), default=0.0)
    return max(0, figures - 1 - math.floor(math.log10(top))) if top > 0 else 0


def percent(share: float) -> str:
    """A share for people."""
    if 0.99 < share < 1:
        return f"{min(100 * share, 99.9):.1f} %"  # "100 %" would say that nothing is left
    return f"{amount(100 * share, '1', 2)} %"
