"""Declared parameters: default, unit, meaning and range stand together, once, at the field.

Fits, reports, documentation and tests read the declaration; nothing repeats it.
"""

import dataclasses
from typing import Any, NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np


class Declaration(NamedTuple):
    """What is known of a parameter before any measurement."""

    name: str
    default: float
    unit: str
    meaning: str
    lower: float
    upper: float
    starts: tuple[float, ...]
    is_level: bool = False


def as_scalar(value: Any) -> Any:
    """A float64 (or default-float) scalar: a Python float in a Module would be a constant, not a parameter."""
    if isinstance(value, (int, float, np.ndarray, np.generic)) and not isinstance(value, bool):
        return jnp.asarray(value, dtype=float)
    return value


def parameter(
    default: float,
    unit: str,
    meaning: str,
    range: tuple[float, float],
    starts: tuple[float, ...] = (),
    is_level: bool = False,
) -> Any:
    """Declare a parameter of an effect.

    `default` is a typical value, used where nothing is fitted; `range` bounds every fit; `starts` are the values a
    search begins from (the default alone when empty). All three are in `unit` ("1" for none), which is SI. Of most
    parameters 0 means that the effect is not there; `is_level` says that 0 is a value like any other.
    """
    lower, upper = range
    if not lower <= default <= upper:
        raise ValueError(f"default {default} of '{meaning}' lies outside its range {range}")
    metadata = {"declaration": (default, unit, meaning, lower, upper, starts or (default,), is_level)}
    return eqx.field(default=default, converter=as_scalar, metadata=metadata)


def parameters(thing: Any) -> tuple[Declaration, ...]:
    """The declared parameters of an effect (class or instance), in the order of declaration."""
    return tuple(
        Declaration(field.name, *field.metadata["declaration"])
        for field in dataclasses.fields(thing)
        if "declaration" in field.metadata
    )
