"""The muscle of Reynolds et al. (2003): spring, damper and contractile element in parallel, each affine in pressure.

M x'' + B x' + K x = F_ce - M g (Tondu 2012, eq 41), x upwards and positive when shorter. Identified by a "bellringer":
the load is suddenly reduced at constant pressure and the muscle swings to where it then rests.
"""

import jax.numpy as jnp
from jaxtyping import Array, ArrayLike


def affine(pressure: ArrayLike, at_rest: ArrayLike, per_pascal: ArrayLike) -> Array:
    """Any of B, K, F_ce at a gauge pressure (Pa): its value without pressure, and what a pascal adds."""
    return jnp.asarray(at_rest) + jnp.asarray(per_pascal) * pressure


def free_motion(
    time: ArrayLike, start: ArrayLike, rest: ArrayLike, mass: ArrayLike, damping: ArrayLike, stiffness: ArrayLike
) -> Array:
    """Position (m) of a load let go from rest at `start` (m) that comes to rest at `rest` (m); eq 41 solved.

    mass in kg, damping in N s/m, stiffness in N/m, time in s >= 0; swings below the critical damping 2 sqrt(K M).
    """
    slowing = damping / (2 * mass)
    square = stiffness / mass - slowing**2
    swing = jnp.sqrt(jnp.maximum(square, 1e-12))
    crawl = jnp.sqrt(jnp.maximum(-square, 1e-12))
    fast, slow = jnp.exp((crawl - slowing) * time), jnp.exp((-crawl - slowing) * time)
    above = (fast + slow) / 2 + slowing / crawl * (fast - slow) / 2
    below = jnp.exp(-slowing * time) * (jnp.cos(swing * time) + slowing / swing * jnp.sin(swing * time))
    return rest + (start - rest) * jnp.where(square > 0, below, above)


def rest_position(load: ArrayLike, contractile_force: ArrayLike, stiffness: ArrayLike) -> Array:
    """Where a load (N) hangs at last, m: (F_ce - M g)/K."""
    return (contractile_force - load) / stiffness
