"""A parameter that ended at an end of its range, in words: where that is, and what the data allow."""

from fitting.least_squares.one_sided import ONE_SIDED, one_sided
from fitting.least_squares.record import Fit
from fitting.report.text.amounts import amount


def bound_text(fit: Fit, name: str) -> str:
    """Which end of its range a parameter lies at, and where that is."""
    entry, value = fit.layout.entry(name), fit.values[name]
    upper = entry.upper - value < value - entry.lower
    end = amount(entry.upper if upper else entry.lower, entry.unit)
    return f"the {'upper' if upper else 'lower'} end of its range, {end}"


def allowed_text(fit: Fit, name: str) -> str:
    """A sentence on what the data allow of a parameter that lies at its bound."""
    found, level = one_sided(fit).get(name), f"at a level of {100 * ONE_SIDED.level:g} %"
    if found is None:
        return "Its error means nothing."
    if found.limit is None:
        return f"Its error means nothing: these data allow every value of its range, {level}."
    which = "at least" if found.is_least else "at most"
    return f"Its error means nothing: it is {which} {_limit(fit, name)}, {level}."


def allowed_note(fit: Fit, name: str) -> str:
    """The same as a note in a table; nothing of a parameter inside its range."""
    if name not in fit.at_bound:
        return ""
    found = one_sided(fit).get(name)
    if found is None or found.limit is None:
        return "at its bound"
    return f"{'at least' if found.is_least else 'at most'} {_limit(fit, name)}"


def _limit(fit: Fit, name: str) -> str:
    found = one_sided(fit)[name]
    assert found.limit is not None
    return amount(found.limit, fit.layout.entry(name).unit, 2)
