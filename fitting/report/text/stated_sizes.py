"""Sizes that muscle.toml states with an error, beside what the fit made of them."""

from fitting import units
from fitting.least_squares.record import Fit
from fitting.least_squares.rests_on import rests_on
from fitting.report.settings import STATED, WARNING_TEXT
from fitting.report.text.amounts import amount, percent
from fitting.report.text.names import mark


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
        f"{mark(name)} = {amount(fit.values[name], fit.layout.entry(name).unit)} "
        f"({measured_cells(fit, name)[0]} was measured, {_apart(fit, name):.2g} errors apart)"
        for name in far
    ]
    return [f"The fit asks for {', '.join(sizes)}. A model that needs this is wrong somewhere."] if far else []


def rests_on_texts(fit: Fit) -> list[str]:
    """A sentence for each parameter that is mostly as uncertain as stated sizes are, the most so first."""
    shares = {name: {k: v for k, v in on.items() if v > STATED.part} for name, on in rests_on(fit).items()}
    own = {entry.name for entry in fit.layout.entries if entry.prior is not None}
    most = {name: on for name, on in shares.items() if name not in own and sum(on.values()) > STATED.most}
    return [_rests_on_text(name, on) for name, on in sorted(most.items(), key=lambda each: -sum(each[1].values()))]


def _rests_on_text(name: str, on: dict[str, float]) -> str:
    sizes = [f"{mark(size)} ({percent(share)})" for size, share in sorted(on.items(), key=lambda each: -each[1])]
    they = "that" if len(sizes) == 1 else "these"
    return (
        f"Most of the uncertainty of {mark(name)} comes from {' and '.join(sizes)}: measure {they} better; "
        "more recordings hardly help."
    )


def _apart(fit: Fit, name: str) -> float:
    prior = fit.layout.entry(name).prior
    assert prior is not None  # the callers have looked
    return abs(fit.values[name] - prior[0]) / prior[1]
