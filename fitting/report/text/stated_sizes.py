"""Sizes that muscle.toml states with an error, beside what the fit made of them."""

from fitting import units
from fitting.least_squares.record import Fit
from fitting.report.settings import WARNING_TEXT
from fitting.report.text.amounts import amount


def measured_cells(fit: Fit, name: str) -> tuple[str, str]:
    """What was measured, with its error, and how many of these errors the fitted value is away; empty if not stated."""
    entry = fit.layout.entry(name)
    if entry.prior is None:
        return "", ""
    mean, error = entry.prior
    return units.show(mean, entry.unit, error), f"{_apart(fit, name):.1f} errors" if name in fit.free else ""


def denied_texts(fit: Fit) -> list[str]:
    """A warning of all stated sizes that the fit denies, the farthest first."""
    stated = [name for name in fit.free if fit.layout.entry(name).prior is not None]
    far = sorted((name for name in stated if _apart(fit, name) > WARNING_TEXT.apart), key=lambda n: -_apart(fit, n))
    sizes = [
        f"{name} = {amount(fit.values[name], fit.layout.entry(name).unit)} "
        f"({measured_cells(fit, name)[0]} was measured, {_apart(fit, name):.2g} errors apart)"
        for name in far
    ]
    return [f"The fit asks for {', '.join(sizes)}. A model that needs this is wrong somewhere."] if far else []


def _apart(fit: Fit, name: str) -> float:
    prior = fit.layout.entry(name).prior
    assert prior is not None  # the callers have looked
    return abs(fit.values[name] - prior[0]) / prior[1]
