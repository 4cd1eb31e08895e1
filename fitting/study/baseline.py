"""The model to begin with where no other is named: the gas in the braid, and strands that rub."""

from mckibben_jax.effect import Effect
from mckibben_jax.effects import CoulombFriction, IdealCylinder

BASELINE: tuple[type[Effect], ...] = (IdealCylinder, CoulombFriction)


def baseline() -> tuple[Effect, ...]:
    """The baseline's effects with their declared values."""
    return tuple(kind() for kind in BASELINE)
