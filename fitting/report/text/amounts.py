"""Amounts for people: values with their unit, errors, shares."""

import math
from collections.abc import Iterable

from fitting import showing


def amount(value: float | None, unit: str, digits: int = 3) -> str:
    """A value with so many figures, as `showing.show` gives it; a dash for none."""
    if value is None:
        return "-"
    if not math.isfinite(value):
        return "no number"
    return showing.show(value, unit, digits=digits)


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
