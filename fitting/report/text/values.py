"""The cells of a table that say what a parameter's value is, how well it is known, and where it may lie."""

from fitting import showing
from fitting.least_squares.record import Fit
from fitting.report.text.amounts import amount, with_error

WIDER = "unknown"  # an error


def value_cells(fit: Fit, name: str) -> tuple[str, str, str]:
    """A parameter's value, its robust error, and its error were samples independent; no errors where it is fixed.

    An error that is wider than the range is none: it comes from slopes that say next to nothing there.
    """
    entry, value, independent = fit.layout.entry(name), fit.values[name], fit.error(name, robust=False)
    widest = entry.upper - entry.lower
    if fit.error(name) > widest:
        return amount(value, entry.unit), WIDER, WIDER if independent > widest else amount(independent, entry.unit, 2)
    shown, robust = with_error(value, fit.error(name), entry.unit)
    return shown, robust, amount(independent, entry.unit, 2) if name in fit.free else ""


def range_cells(fit: Fit, name: str) -> tuple[str, str]:
    """The ends of a parameter's range, in the unit in which its value is read."""
    entry = fit.layout.entry(name)
    unit, _ = showing.shown_in(entry.unit, abs(fit.values[name]))
    return tuple(showing.show(end, entry.unit, unit=unit or None, digits=3) for end in (entry.lower, entry.upper))
