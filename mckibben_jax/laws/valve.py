"""Air through a valve into a volume: flow by ISO 6358, and how far a volume fills in a given time.

Pressures are absolute here. The air keeps the temperature of the reference air of ISO 8778 (293.15 K at 1 bar), so that
R T times a mass flow is the reference pressure times a volume flow of reference air.
"""

import jax.numpy as jnp
from jaxtyping import Array, ArrayLike

REFERENCE_PRESSURE = 1e5  # Pa, absolute (ISO 8778)
REFERENCE_DENSITY = 1.185  # kg/m^3 (ISO 8778)
LAMINAR = 0.999  # pressure ratio from which the flow is laminar: in proportion to the pressure difference


def flow_factor(ratio: ArrayLike, critical: ArrayLike) -> Array:
    """Flow over choked flow at a downstream over upstream pressure `ratio` <= 1 (ISO 6358-1:2013).

    1 up to the `critical` ratio b, beyond it sqrt(1 - ((ratio - b)/(1 - b))^2), and from 0.999 on in proportion to the
    pressure difference.
    """
    ratio = jnp.asarray(ratio)
    quarter = jnp.clip((ratio - critical) / (1 - critical), 0.0, _laminar_sine(critical))
    return jnp.sqrt(1 - quarter**2) * jnp.clip((1 - ratio) / (1 - LAMINAR), 0.0, 1.0)


def mass_flow(upstream: ArrayLike, downstream: ArrayLike, conductance: ArrayLike, critical: ArrayLike) -> Array:
    """Mass flow (kg/s) through a valve of sonic `conductance` C (m^3/(s Pa)): C rho0 p1 times the flow factor."""
    upstream = jnp.asarray(upstream)
    return conductance * REFERENCE_DENSITY * upstream * flow_factor(downstream / upstream, critical)


def filled(pressure: ArrayLike, port: ArrayLike, stride: ArrayLike, critical: ArrayLike) -> Array:
    """Pressure (Pa) of a constant volume after it was open to a `port` of constant pressure (Pa), either way.

    `stride` is time over the time constant V/(n C p0), with n the polytropic exponent of the air inside. The pressure
    ratio r follows dr/dstride = flow factor while filling (p = r port) and r times that while emptying (p = port/r):
    choked, subsonic and laminar one after the other in closed form, but for emptying below the speed of sound, where
    the midpoint rule takes its place.
    """
    pressure, port, stride = jnp.asarray(pressure), jnp.asarray(port), jnp.asarray(stride)
    empties = pressure > port
    ratio = jnp.where(empties, port, pressure) / jnp.where(empties, pressure, port)
    ratio, stride = _choked(ratio, stride, critical, empties)
    ratio, stride = _subsonic(ratio, stride, critical, empties)
    slope = jnp.sqrt(1 - _laminar_sine(critical) ** 2) / (1 - LAMINAR)
    ratio = 1 - (1 - ratio) * jnp.exp(-slope * stride)
    return jnp.where(empties, port / ratio, ratio * port)


def _choked(ratio: Array, stride: Array, critical: ArrayLike, empties: Array) -> tuple[Array, Array]:
    """Ratio after the part of the stride in which the flow is choked, and what is left of the stride."""
    below = jnp.minimum(ratio, critical)
    needed = jnp.where(empties, jnp.log(critical / below), critical - below)
    spent = jnp.minimum(stride, needed)
    after = jnp.where(empties, below * jnp.exp(spent), below + spent)
    after = jnp.where(spent < needed, after, critical)
    return jnp.where(ratio < critical, after, ratio), stride - jnp.where(ratio < critical, spent, 0.0)


def _subsonic(ratio: Array, stride: Array, critical: ArrayLike, empties: Array) -> tuple[Array, Array]:
    """The same between the critical ratio and laminar flow, along the angle whose sine is (r - b)/(1 - b)."""
    last = jnp.arcsin(_laminar_sine(critical))
    angle = jnp.arcsin(jnp.clip((ratio - critical) / (1 - critical), 0.0, _laminar_sine(critical)))
    halfway = jnp.minimum(angle + stride * ratio / (1 - critical) / 2, last)
    speed = jnp.where(empties, critical + (1 - critical) * jnp.sin(halfway), 1.0) / (1 - critical)
    spent = jnp.where(ratio < critical, 0.0, jnp.minimum(stride, (last - angle) / speed))
    after = critical + (1 - critical) * jnp.sin(angle + speed * spent)
    subsonic = (ratio >= critical) & (ratio < LAMINAR)
    return jnp.where(subsonic, after, ratio), stride - spent


def _laminar_sine(critical: ArrayLike) -> Array:
    return (LAMINAR - jnp.asarray(critical)) / (1 - critical)
