"""Sizes that muscle.toml states with an error beside what the fit made of them, and what the fit's errors rest on."""

from fitting import showing
from fitting.least_squares.record import Fit
from fitting.least_squares.rests_on import rests_on, rests_on_instruments
from fitting.report.settings import STATED, WARNING_TEXT
from fitting.report.text.amounts import amount, percent
from fitting.report.text.instrument_answers import known_to_text
from fitting.report.text.names import mark


def measured_cells(fit: Fit, name: str) -> tuple[str, str]:
    """What was measured, with its error, and how many of these errors the fitted value is away; empty if not stated."""
    entry = fit.layout.entry(name)
    if entry.prior is None:
        return "", ""
    mean, error = entry.prior
    return showing.show(mean, entry.unit, error), f"{_apart(fit, name):.1f} errors" if name in fit.free else ""


def denied_texts(fit: Fit) -> list[str]:
    """A warning of all stated sizes that the fit denies, the farthest first."""
    stated = [name for name in fit.free if fit.layout.entry(name).prior is not None]
    far = sorted((name for name in stated if _apart(fit, name) > WARNING_TEXT.apart), key=lambda n: -_apart(fit, n))
    sizes = [
        f"{mark(name)} = {amount(fit.values[name], fit.layout.entry(name).unit)} "
        f"({measured_cells(fit, name)[0]} was measured, {showing.figures(_apart(fit, name))} errors apart)"
        for name in far
    ]
    return [f"The fit asks for {', '.join(sizes)}. A model that needs this is wrong somewhere."] if far else []


def rests_on_texts(fit: Fit) -> list[str]:
    """A sentence for each parameter that is mostly as uncertain as stated sizes and instruments are, the most first."""
    own = {entry.name for entry in fit.layout.entries if entry.prior is not None}
    instruments = rests_on_instruments(fit)
    found: list[tuple[float, str]] = []
    for name, sizes in rests_on(fit).items():
        parts = [(share, mark(size)) for size, share in sizes.items() if name not in own]
        parts += [(share, known_to_text(source)) for source, share in instruments[name].items()]
        parts = sorted((part for part in parts if part[0] > STATED.part), reverse=True)
        total = sum(share for share, _ in parts)
        if total > STATED.most:
            found.append((total, _rests_on_text(name, parts)))
    said = [text for _, text in sorted(found, key=lambda each: -each[0])]
    return [*said, "Measure better what is named; more recordings hardly help."] if said else []


def _rests_on_text(name: str, parts: list[tuple[float, str]]) -> str:
    named = [f"{text} ({percent(share)} of it)" for share, text in parts]
    return f"Most of the uncertainty of {mark(name)} comes from {' and '.join(named)}."


def _apart(fit: Fit, name: str) -> float:
    prior = fit.layout.entry(name).prior
    assert prior is not None  # the callers have looked
    return abs(fit.values[name] - prior[0]) / prior[1]
