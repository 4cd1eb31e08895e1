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
    found = one_sided(fit).get(name)
    if found is None:
        return "Its standard error means nothing."
    if found.is_beyond:
        return "These data ask for a value beyond that end, and its standard error means nothing."
    if found.limit is None:
        return "These data allow every value of the range, and its standard error means nothing."
    return (
        f"These data say with a confidence of {100 * ONE_SIDED.level:g} % that its value is {_limit(fit, name)}; its "
        "standard error means nothing."
    )


def allowed_note(fit: Fit, name: str) -> str:
    """The same as a note in a table; nothing of a parameter inside its range."""
    if name not in fit.at_bound:
        return ""
    found = one_sided(fit).get(name)
    return "at its bound" if found is None or found.limit is None else _limit(fit, name)


def _limit(fit: Fit, name: str) -> str:
    found = one_sided(fit)[name]
    which = "at least" if found.is_least else "at most"
    return f"{which} {amount(found.limit, fit.layout.entry(name).unit, 2)}"
