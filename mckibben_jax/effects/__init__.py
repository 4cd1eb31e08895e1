"""The library of effects: a plain tuple, in the order in which they act within their stage."""

from mckibben_jax.effect import Effect
from mckibben_jax.effects.felt import (
    ContractionOffset,
    DeadBand,
    PressureDrop,
    PressureGain,
    PressureOffset,
    RadialGap,
    SeriesCompliance,
    StrandStretch,
    SupplyLag,
    Tip,
    TipPressure,
)
from mckibben_jax.effects.lost import (
    BladderHysteresis,
    ConstantFriction,
    CoulombFriction,
    Creep,
    CrossingFriction,
    HertzFriction,
    Hill,
    KineticFriction,
    MaxwellSlip,
    Mullins,
    Presliding,
    SchulteFriction,
    TextileFriction,
    ViscousDamping,
)
from mckibben_jax.effects.read import ForceGain, ForceOffset, Slack, TimeDelay
from mckibben_jax.effects.stored import (
    BladderAxialPrinted,
    BladderMooneyRivlin,
    BladderNeoHookean,
    BladderOgden,
    BladderSchulte,
    BladderThinMooneyRivlin,
    ConicalEnds,
    ConicalEndsPrinted,
    EndStop,
    IdealCylinder,
    LinearSpring,
    ReducedLength,
    StrandBending,
    WallShielding,
    Weight,
)
from mckibben_jax.effects.supply import LiquidLine, SupplyDelay, SupplyOrifice

FELT = (
    PressureOffset,
    PressureGain,
    ContractionOffset,
    SupplyLag,
    PressureDrop,
    DeadBand,
    RadialGap,
    SeriesCompliance,
    Tip,
    TipPressure,
    StrandStretch,
)
STORED = (
    IdealCylinder,
    ConicalEnds,
    ReducedLength,
    BladderNeoHookean,
    BladderMooneyRivlin,
    BladderOgden,
    BladderThinMooneyRivlin,
    BladderSchulte,
    StrandBending,
    EndStop,
    LinearSpring,
    Weight,
    WallShielding,
    ConicalEndsPrinted,
    BladderAxialPrinted,
)
LOST = (
    CoulombFriction,
    TextileFriction,
    HertzFriction,
    SchulteFriction,
    CrossingFriction,
    ConstantFriction,
    KineticFriction,
    BladderHysteresis,
    Presliding,
    MaxwellSlip,
    ViscousDamping,
    Hill,
    Creep,
    Mullins,
)
READ = (Slack, ForceGain, ForceOffset, TimeDelay)
SUPPLIES: tuple[type[Effect], ...] = (SupplyOrifice, LiquidLine, SupplyDelay)  # by name only
LIBRARY: tuple[type[Effect], ...] = FELT + STORED + LOST + READ
_BEHIND = FELT.index(SupplyLag) + 1
ORDER = (*FELT[:_BEHIND], *SUPPLIES[:2], *FELT[_BEHIND:], *STORED, *LOST, *READ, SupplyDelay)
