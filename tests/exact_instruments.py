"""Fits as if every reading were to be trusted, for closed forms that know of noise alone."""

from dataclasses import replace

from fitting.instruments.errors import InstrumentErrors
from fitting.least_squares.record import Fit


def trusting(found: Fit) -> Fit:
    """The same fit with instruments that do not err."""
    return replace(found, errors=InstrumentErrors.none(found.samples.run))
