"""The library of effects: a plain tuple, in the order in which they act within their stage."""

from mckibben_jax.effect import Effect
from mckibben_jax.effects.felt import DeadBand, PressureOffset, SeriesCompliance, SupplyLag, Tip
from mckibben_jax.effects.lost import (
    ConstantFriction,
    CoulombFriction,
    Creep,
    Hill,
    KineticFriction,
    Presliding,
    TextileFriction,
    ViscousDamping,
)
from mckibben_jax.effects.read import ForceOffset
from mckibben_jax.effects.stored import BladderMooneyRivlin, BladderNeoHookean, EndStop, IdealCylinder

FELT = (PressureOffset, SupplyLag, DeadBand, SeriesCompliance, Tip)
STORED = (IdealCylinder, BladderNeoHookean, BladderMooneyRivlin, EndStop)
LOST = (
    CoulombFriction,
    TextileFriction,
    ConstantFriction,
    KineticFriction,
    Presliding,
    ViscousDamping,
    Hill,
    Creep,
)
READ = (ForceOffset,)
LIBRARY: tuple[type[Effect], ...] = FELT + STORED + LOST + READ

__all__ = ["FELT", "LIBRARY", "LOST", "READ", "STORED", *(effect.__name__ for effect in LIBRARY)]
