"""What stands in the cells of tables, the same on the terminal and on the page."""

from collections.abc import Sequence

from fitting import units
from fitting.comparison.compare import Row
from fitting.least_squares.fit import Fit
from fitting.report.sentences import places, rounded, with_error


def error_cells(rows: Sequence[Row], unit: str) -> tuple[str, list[tuple[str, ...]]]:
    """The unit that errors are shown in, and of each row: group, samples, rms, mean, largest; all to the same digit."""
    name, size = units.shown_in(unit, max(row.rmse for row in rows))
    after = places(row.rmse / size for row in rows)
    shown = lambda row: (f"{value / size:z.{after}f}" for value in (row.rmse, row.bias, row.largest))  # noqa: E731
    return name, [(row.label, str(row.count), *shown(row)) for row in rows]


def value_cells(fit: Fit, name: str) -> tuple[str, str, str]:
    """A parameter's value, its robust error, and its error were samples independent; no errors where it is fixed."""
    unit = fit.layout.entries[fit.layout.names.index(name)].unit
    value, robust = with_error(fit.values[name], fit.error(name), unit)
    return value, robust, rounded(fit.error(name, robust=False), unit, 2) if name in fit.free else ""


def range_cells(fit: Fit, name: str) -> tuple[str, str]:
    """The ends of a parameter's range."""
    entry = fit.layout.entries[fit.layout.names.index(name)]
    return rounded(entry.lower, entry.unit), rounded(entry.upper, entry.unit)
