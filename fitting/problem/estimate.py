"""A parameter's value as it is passed on: with its unit, and how it came to be."""

from enum import StrEnum
from typing import NamedTuple


class ParameterState(StrEnum):
    """How a parameter came by its value; the words stand in model files and in JSON."""

    FITTED = "fitted"
    FIXED = "fixed"
    HELD = "held"  # it was to vary, but the data do not constrain it


class Estimate(NamedTuple):
    """A parameter's value and its standard error in its own SI unit; the error is NaN where it did not vary."""

    value: float
    error: float
    unit: str
