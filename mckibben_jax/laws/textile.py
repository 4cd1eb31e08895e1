"""Friction of strands on strands (eqs 33, 36-40, 48): its size in N, always to be taken against the motion.

`load` is the normal force that presses the strands together, S P (N): contact surface times pressure.
"""

import jax.numpy as jnp
from jaxtyping import Array, ArrayLike

# Power laws are written per kilonewton so that a coefficient keeps its meaning when the exponent changes.
UNIT_LOAD = 1000.0
# Below this size a power law is replaced by the straight line of exponent 1: its slope stays finite at no load.
_LIGHT = 1e-9


def _power(x: ArrayLike, exponent: ArrayLike) -> Array:
    # |x|^exponent with the sign of x; the inner guard keeps every derivative finite at 0
    x = jnp.asarray(x, dtype=float)
    heavy = jnp.abs(x) > _LIGHT
    return x * jnp.where(heavy, jnp.abs(jnp.where(heavy, x, 1.0)) ** (exponent - 1), 1.0)


# Size of dry friction ------------------------------------------------------------------------------------------------


def coulomb_friction(load: ArrayLike, coefficient: ArrayLike) -> Array:
    """Dry friction (N) in proportion to the load: f L, f the review's f_s/S_scale. Tondu 2012, eq 36."""
    return coefficient * jnp.asarray(load)


def power_law_friction(load: ArrayLike, coefficient: ArrayLike, exponent: ArrayLike) -> Array:
    """Textile friction (N): f L1 (L/L1)^beta with L1 = 1 kN, that is C L^beta with C = f L1^(1 - beta).

    `exponent` beta < 1 for yarns (0.67 to 0.96), 1 is Coulomb. Below 1 uN of load, where the law's slope would grow
    without bound, Coulomb's line is taken. Odd in the load. Tondu 2012, eq 40 (Howell et al. 1959).
    """
    return coefficient * UNIT_LOAD * _power(jnp.asarray(load) / UNIT_LOAD, exponent)


def textile_constant(coefficient: ArrayLike, exponent: ArrayLike) -> Array:
    """C of eq 40 in N^(1 - beta), from the coefficient of `power_law_friction`. Tondu 2012, eq 40."""
    return coefficient * UNIT_LOAD ** (1 - jnp.asarray(exponent))


def schulte_friction(pressure: ArrayLike, radius: ArrayLike, length: ArrayLike, coefficient: ArrayLike) -> Array:
    """Friction (N) over the whole cylinder: 2 pi r l P (f_s + f_st), present `radius` and `length` (m).

    `coefficient` is f_s + f_st. The area is larger than the strands' contact, and strands stick to the bladder: kept as
    a rival. Tondu 2012, eq 33 (Schulte 1961).
    """
    return 2 * jnp.pi * radius * length * pressure * coefficient


def hertz_friction(
    pressure: ArrayLike, contact_surface: ArrayLike, coefficient: ArrayLike, strand_modulus: ArrayLike,
    strand_poisson: ArrayLike,
) -> Array:  # fmt: skip
    """Friction (N) on the share of the contact surface (m^2) that Hertz contact leaves: f_s S P / S_scale.

    Grows as P^(4/3). Takes a ratio of lengths for one of areas and has no transmission from strand to stroke.
    Tondu 2012, eqs 36 and 39 with 38 (Davis and Caldwell 2006).
    """
    return coefficient * contact_surface * pressure * hertz_share(pressure, strand_modulus, strand_poisson)


def crossing_friction(pressure: ArrayLike, radius: ArrayLike, angle: ArrayLike, mu_radius: ArrayLike) -> Array:
    """Friction (N) of strands that turn on each other where they cross: (4/3) pi P r mu R_c/tan(alpha).

    Present `radius` r (m) and braid `angle` (rad); `mu_radius` = friction coefficient times contact radius of a
    crossing (m). A disc of radius R_c under the load N resists turning with the moment (2/3) mu N R_c. Each family of
    strands carries half of the pressure, so the loads of all crossings add up to pi r l P; the strands turn by 2 d
    alpha when the muscle shortens by l tan(alpha) d alpha: moment times angle equals force times stroke. Independent
    of length, unlike eq 36. Not in Tondu 2012.
    """
    return 4 / 3 * jnp.pi * pressure * radius * mu_radius / jnp.tan(angle)


def kinetic_factor(speed: ArrayLike, ratio: ArrayLike, speed_scale: ArrayLike) -> Array:
    """Kinetic over static friction: q + (1 - q) exp(-|v|/v_s), q = f_k/f_s the fast limit.

    The review prints v without bars, which blows up for v < 0. Its ratio f_k/f_s = 7 is friction that RISES with speed.
    `speed` and `speed_scale` in m/s. Tondu 2012, eq 48.
    """
    # v sign(v) for |v|: its slope at rest is 0, halfway between the two sides
    return ratio + (1 - ratio) * jnp.exp(-speed * jnp.sign(speed) / speed_scale)


def kinetic_coefficient(
    speed: ArrayLike, static_coefficient: ArrayLike, kinetic_coefficient: ArrayLike, speed_scale: ArrayLike
) -> Array:
    """Coefficient of kinetic friction: f_k + (f_s - f_k) exp(-|v|/v_s). Tondu 2012, eq 48."""
    return static_coefficient * kinetic_factor(speed, kinetic_coefficient / static_coefficient, speed_scale)


# Contact of two strands ----------------------------------------------------------------------------------------------


def hertz_modulus(strand_modulus: ArrayLike, strand_poisson: ArrayLike) -> Array:
    """Contact modulus of two like strands, Pa: E* = E/(2(1 - nu^2)). Tondu 2012, after eq 37."""
    return strand_modulus / (2 * (1 - strand_poisson**2))


def sphere_contact_radius(
    pressure: ArrayLike, strand_width: ArrayLike, strand_modulus: ArrayLike, strand_poisson: ArrayLike
) -> Array:
    """Radius (m) of the contact of two strands taken as spheres: [(3/8) F_c (D/2)/E*]^(1/3), F_c = P D^2.

    Small against the strand. Tondu 2012, eq 37 (Davis and Caldwell 2006; Hertz).
    """
    modulus = hertz_modulus(strand_modulus, strand_poisson)
    return jnp.cbrt(3 / 8 * pressure * strand_width**3 / 2 / modulus)


def sphere_contact_area(
    pressure: ArrayLike, strand_width: ArrayLike, strand_modulus: ArrayLike, strand_poisson: ArrayLike
) -> Array:
    """Area (m^2) of the contact of two strands taken as spheres: pi r_c^2. Tondu 2012, eq 37."""
    return jnp.pi * sphere_contact_radius(pressure, strand_width, strand_modulus, strand_poisson) ** 2


def cylinder_contact_area(
    pressure: ArrayLike, strand_width: ArrayLike, angle: ArrayLike, strand_modulus: ArrayLike, strand_poisson: ArrayLike
) -> Array:
    """Area (m^2) of the contact of two strands taken as parallel cylinders that touch along their crossing: 2 b L.

    The line of contact is the long diagonal of the crossing's rhombus, L = D/sin(alpha) or D/cos(alpha), whichever is
    longer, under the crossing's load P D^2/sin(2 alpha). Hertz for cylinders of diameter D (radius D/4 of the pair):
    b = sqrt(4 q R/(pi E')) with q the load per length and R = D/4; E' = E/(2(1 - nu^2)).
    Derived from the assumption that Tondu 2012 names (Doumit et al. 2009, fig. 11): crossing strands are not
    parallel, so the area is an upper bound; it grows as P^(1/2) where spheres give P^(2/3).
    """
    line = strand_width / jnp.minimum(jnp.sin(angle), jnp.cos(angle))
    load = pressure * strand_width**2 / jnp.sin(2 * angle)
    modulus = hertz_modulus(strand_modulus, strand_poisson)
    half_width = jnp.sqrt(4 * load / line * strand_width / 4 / (jnp.pi * modulus))
    return 2 * half_width * line


def hertz_share(pressure: ArrayLike, strand_modulus: ArrayLike, strand_poisson: ArrayLike) -> Array:
    """1/S_scale: contact diameter over strand width, 2 r_c/D = 2 [(3/8) P (1 - nu^2)/E]^(1/3); 0 without pressure.

    Straight below P/E = 1e-9 (some Pa), so that its slope is finite at no pressure. Tondu 2012, eq 38.
    """
    strain = pressure * (1 - strand_poisson**2) / strand_modulus
    return 2 * (3 / 8) ** (1 / 3) * _power(strain, 1 / 3)


def hertz_scale(pressure: ArrayLike, strand_modulus: ArrayLike, strand_poisson: ArrayLike) -> Array:
    """S_scale = D/(2 r_c) = 0.5 (8/3)^(1/3) [E/((1 - nu^2) P)]^(1/3), independent of the strand's width.

    A ratio of lengths; that of areas is D^2/(pi r_c^2) = (4/pi) S_scale^2. Infinite at no pressure. Tondu 2012, eq 38.
    """
    return 1 / hertz_share(pressure, strand_modulus, strand_poisson)
