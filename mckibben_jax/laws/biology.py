"""Muscle as biology sees it: the generic active spring (eqs 1, 2), Voigt and Hill models (eqs 41-47).

`position` x = l0 eps (m), upwards and positive when shorter; `velocity` its rate (m/s); forces in N, masses in kg.
"""

import jax.numpy as jnp
from jaxtyping import Array, ArrayLike

# Ratio a/F0 of two braids at 5 bar and its range in animals; Tondu 2012, eq 46 and the text beside it.
CURVATURE_RAYON, CURVATURE_IRON, CURVATURE_ANIMAL = 0.12, 0.54, (0.12, 0.4)


def linear_spring_force(contraction: ArrayLike, largest_force: ArrayLike, largest_contraction: ArrayLike) -> Array:
    """Pull (N) of a linear active spring at full activation: F_max (1 - eps/eps_max). Tondu 2012, eq 1.

    Its stiffness is F_max/(eps_max l0) in N/m.
    """
    return largest_force * (1 - contraction / largest_contraction)


def generic_force(activation: ArrayLike, spring_force: ArrayLike, resistance: ArrayLike) -> Array:
    """Pull (N) of any artificial muscle: u F_spring(eps) - F_res, activation u from 0 to 1.

    `resistance` (N, positive against contraction) holds friction and elasticity. Tondu 2012, eqs 1 and 2.
    """
    return activation * spring_force - resistance


def hill_force(velocity: ArrayLike, isometric_force: ArrayLike, a: ArrayLike, b: ArrayLike) -> Array:
    """Pull (N) at steady shortening: F = F0 - F_V, the solution of (F + a) V = (F0 - F) b. Tondu 2012, eqs 43, 45."""
    return isometric_force - hill_viscous_force(velocity, isometric_force, a, b)


def hill_viscous_force(velocity: ArrayLike, isometric_force: ArrayLike, a: ArrayLike, b: ArrayLike) -> Array:
    """What shortening costs (N, positive, against the motion): F_V = (F0 + a) V/(V + b).

    Shortening only: 0 for V <= 0, where Hill's law says nothing; at V = 0 the slope is the one-sided (F0 + a)/b.
    `a` in N, `b` in m/s, b > 0. Tondu 2012, eq 45.
    """
    shortening = jnp.where(jnp.asarray(velocity) >= 0, velocity, 0.0)
    return (isometric_force + a) * shortening / (shortening + b)


def hill_velocity_ratio(force_ratio: ArrayLike, curvature: ArrayLike) -> Array:
    """V/V_max at a load w = F/F0: r (1 - w)/(w + r), r = a/F0 = b/V_max the `curvature`. Tondu 2012, eq 44."""
    return curvature * (1 - force_ratio) / (force_ratio + curvature)


def largest_velocity(isometric_force: ArrayLike, a: ArrayLike, b: ArrayLike) -> Array:
    """Unloaded shortening velocity (m/s): V_max = F0 b/a. Tondu 2012, after eq 43."""
    return isometric_force * b / a


def voigt_acceleration(
    position: ArrayLike, velocity: ArrayLike, contractile_force: ArrayLike, mass: ArrayLike, damping: ArrayLike,
    stiffness: ArrayLike, gravity: ArrayLike = 9.80665,
) -> Array:  # fmt: skip
    """Acceleration (m/s^2, upwards) of a load on contractile element, spring (N/m) and damper (N s/m) in parallel.

    M x'' + B x' + K x = F_ce - M g. Tondu 2012, eq 41 (Reynolds et al. 2003).
    """
    return (contractile_force - stiffness * position - damping * velocity) / mass - gravity


def lifted_acceleration(force: ArrayLike, mass: ArrayLike, gravity: ArrayLike = 9.80665) -> Array:
    """Acceleration (m/s^2, upwards) of a load that a muscle lifts: x'' = F_dyn/M - g. Tondu 2012, eq 42."""
    return force / mass - gravity


def coulomb_acceleration(
    position: ArrayLike, velocity: ArrayLike, pull_at_rest: ArrayLike, stroke: ArrayLike, kinetic_friction: ArrayLike,
    mass: ArrayLike, gravity: ArrayLike = 9.80665,
) -> Array:  # fmt: skip
    """Acceleration (m/s^2, upwards) of a load on a linear active spring with constant kinetic friction (N).

    x'' = [u F_max (1 - x/(l0 eps_max)) - F_k sign(x')]/M - g; `pull_at_rest` = u F_max (N), `stroke` = l0 eps_max (m).
    sign(0) = 0 here; a muscle at rest sticks. No steady velocity follows from it. Tondu 2012, eq 47.
    """
    pull = linear_spring_force(position, pull_at_rest, stroke)
    return lifted_acceleration(pull - kinetic_friction * jnp.sign(velocity), mass, gravity)


def release_velocity(
    load: ArrayLike, pull_at_rest: ArrayLike, stroke: ArrayLike, kinetic_friction: ArrayLike, mass: ArrayLike
) -> Array:
    """Velocity (m/s) at the one instant without acceleration after a release from rest at x = 0: eq 47 solved.

    V = (u F_max - F_k - M g)/sqrt(K M), K = u F_max/(l0 eps_max), load M g (N). Not linear in the load: it goes as
    (1 - w)/sqrt(w) with w = M g/(u F_max - F_k), and looks like Hill's hyperbola without any viscosity. Tondu 2012,
    eq 47.
    """
    stiffness = pull_at_rest / stroke
    return (pull_at_rest - kinetic_friction - load) / jnp.sqrt(stiffness * mass)
