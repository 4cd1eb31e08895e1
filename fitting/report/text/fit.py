"""A fit: values with their errors, and what to be wary of."""

from rich.console import RenderableType
from rich.text import Text

from fitting.least_squares.record import Fit
from fitting.report.results import shown_names
from fitting.report.text.amounts import amount, with_error
from fitting.report.text.layout import columns, line, lines, spaced


def fit_warnings(fit: Fit) -> list[str]:
    """What the user must know about a fit before trusting its numbers."""
    words = [] if fit.converged else ["The search did not converge: the values below are not to be trusted."]
    words += [f"{name} lies at an end of its range: its error means nothing." for name in fit.at_bound]
    words += [f"{', '.join(g)} can make up for each other: the data fix them only together." for g in tied_groups(fit)]
    if fit.held:
        words.append(f"Held, because these data cannot see them: {', '.join(fit.held)}.")
    return words + [f"Search: {failure}" for failure in fit.failures]


def tied_groups(fit: Fit) -> list[list[str]]:
    """Parameters that are tied, directly or through others."""
    groups: list[set[str]] = []
    for name, others in fit.tied.items():
        joined = {name, *others}
        for group in [group for group in groups if group & joined]:
            groups.remove(group)
            joined |= group
        groups.append(joined)
    return [sorted(group) for group in groups]


def fit_report(fit: Fit) -> list[RenderableType]:
    """Values, errors, bounds, and what to be wary of."""
    table = columns("parameter", "value", "+/- robust", "+/- i.i.d.", "range", "note")
    table.columns[0].overflow, table.columns[0].no_wrap = "ellipsis", True
    for name in shown_names(fit):
        table.add_row(name, *_parameter(fit, name))
    return [spaced(table), Text(), *lines("WARNING", fit_warnings(fit), "yellow"), line("SEARCH", fit.starts)]


def _parameter(fit: Fit, name: str) -> tuple[str, ...]:
    note = "at its bound" if name in fit.at_bound else "tied" if name in fit.tied else ""
    note = "held: not visible" if name in fit.held else note if name in fit.free else "fixed"
    return *value_cells(fit, name), " .. ".join(range_cells(fit, name)), note


def value_cells(fit: Fit, name: str) -> tuple[str, str, str]:
    """A parameter's value, its robust error, and its error were samples independent; no errors where it is fixed."""
    unit = fit.layout.entries[fit.layout.names.index(name)].unit
    value, robust = with_error(fit.values[name], fit.error(name), unit)
    return value, robust, amount(fit.error(name, robust=False), unit, 2) if name in fit.free else ""


def range_cells(fit: Fit, name: str) -> tuple[str, str]:
    """The ends of a parameter's range."""
    entry = fit.layout.entries[fit.layout.names.index(name)]
    return amount(entry.lower, entry.unit), amount(entry.upper, entry.unit)
