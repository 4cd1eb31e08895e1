"""Compressed air: what it takes from the supply to fill a muscle, and how long that takes. Isothermal ideal gas."""

import jax.numpy as jnp
from jaxtyping import Array, ArrayLike

from mckibben_jax.laws.valve import REFERENCE_PRESSURE

ATMOSPHERE = 101325.0  # Pa, absolute
CRITICAL_RATIO = 0.3  # outlet over inlet pressure below which the flow of a common valve is choked
CONDUCTANCE = 1e-8  # m^3/(s Pa): 1 dm^3/(s bar), a small valve


def supply_energy(pressure: ArrayLike, volume: ArrayLike, volume_at_rest: ArrayLike) -> Array:
    """Energy (J) of the air drawn from a supply at gauge `pressure` (Pa) to fill `volume` (m^3).

    (P_abs V - P_atm V_rest) ln(P_abs/P_atm): what isothermal expansion of the air to the atmosphere could give, which
    is the least that compressing it takes. The air that was in the muscle at rest (`volume_at_rest`) is not drawn.
    Cai, Kawashima & Kagawa 2006, J. Fluids Eng. 128:402 (power of flowing compressed air).
    """
    present = jnp.asarray(pressure) + ATMOSPHERE
    return (present * volume - ATMOSPHERE * volume_at_rest) * jnp.log(present / ATMOSPHERE)


def filling_time(pressure: ArrayLike, volume: ArrayLike, conductance: ArrayLike, share: ArrayLike = 0.9) -> Array:
    """Time (s) in which a constant `volume` (m^3) fills from the atmosphere to a `share` of gauge `pressure` (Pa).

    Through a valve of sonic `conductance` C (m^3/(s Pa)) from a supply at that pressure p_s (absolute):
    V dp/dt = C p_s p_ref w(p/p_s), w = 1 up to the critical ratio b and sqrt(1 - ((p/p_s - b)/(1 - b))^2) beyond. So
    t = V/(C p_ref) [g(p/p_s) - g(p_atm/p_s)] with g(x) = x, beyond b: b + (1 - b) asin((x - b)/(1 - b)).
    Flow law: ISO 6358-1:2013, with b = 0.3.
    """
    supply = jnp.asarray(pressure) + ATMOSPHERE
    ends = _filled((ATMOSPHERE + share * jnp.asarray(pressure)) / supply) - _filled(ATMOSPHERE / supply)
    return volume / (conductance * REFERENCE_PRESSURE) * ends


def _filled(ratio: ArrayLike) -> Array:
    beyond = jnp.maximum(jnp.asarray(ratio) - CRITICAL_RATIO, 0.0) / (1 - CRITICAL_RATIO)
    return jnp.minimum(ratio, CRITICAL_RATIO) + (1 - CRITICAL_RATIO) * jnp.arcsin(beyond)
