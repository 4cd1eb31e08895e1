"""Values of a model file that its data do not allow: a search would move them to the nearest end without a word."""

from collections.abc import Mapping
from pathlib import Path

from fitting import showing
from fitting.errors import InputError
from fitting.problem.unknowns import Unknowns


def check_allowed(layout: Unknowns, known: Mapping[str, float], file: Path) -> None:
    """Refuse a value (SI, by full name) outside the range that the measurements leave open."""
    for name, lower, upper in zip(layout.names, layout.lower, layout.upper, strict=True):
        value = known.get(name)
        slack = 1e-6 * (upper - lower)
        if value is not None and not lower - slack <= value <= upper + slack:
            unit = layout.entry(name).unit
            ends = f"{showing.show(lower, unit)} to {showing.show(upper, unit)}"
            problem = f"{name} = {showing.show(value, unit)} lies outside what was measured of the muscle, {ends}"
            raise InputError(problem, file, cure="take the value of the fit, or measure again")
