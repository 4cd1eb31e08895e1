"""The braid as a network of pantographs: kinematics, pressure force, shapes, strand contact (eqs 3-20, 25, 34, 35).

Arguments that recur: `contraction` eps = (l0 - l)/l0, positive when shorter; `radius` r0 (m) and `braid_angle` alpha0
(rad, from the long axis) where the braid lies at rest; `length` l0 (m) at rest; `pressure` P (Pa, gauge). Forces (N)
are positive when the muscle pulls. Nothing is clipped: beyond the end of the stroke a force is negative. Arrays
broadcast.
"""

from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
import optimistix as optx
from jaxtyping import Array, ArrayLike

# Square of the radius ratio where the strands are as good as straight; no cylinder lies beyond it.
_STRAIGHT = 1e-12
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(64)


def slope(law: Callable[[Array], Array], at: ArrayLike) -> Array:
    """Derivative of an elementwise law at every point of an array, in one forward pass."""
    at = jnp.asarray(at, dtype=float)
    return jax.jvp(law, (at,), (jnp.ones_like(at),))[1]


def zero_between(law: Callable[[Array], Array], low: ArrayLike, high: ArrayLike) -> Array:
    """Where a scalar law changes sign between `low` and `high`, differentiable in whatever the law closes over."""
    low, high = jnp.asarray(low, dtype=float), jnp.asarray(high, dtype=float)
    solver = optx.Bisection(rtol=1e-15, atol=1e-15, flip="detect")
    bracket = {"lower": low, "upper": high}
    middle = (low + high) / 2
    return optx.root_find(lambda x, _: law(x), solver, middle, options=bracket, max_steps=100, throw=False).value


# Kinematics ----------------------------------------------------------------------------------------------------------


def _radius_ratio_squared(contraction: ArrayLike, braid_angle: ArrayLike) -> Array:
    # (r/r0)^2 of eq 9, written so that it is exactly 1 at rest and needs no trigonometry per sample
    return 1 + contraction * (2 - contraction) / jnp.tan(braid_angle) ** 2


def radius_ratio(contraction: ArrayLike, braid_angle: ArrayLike) -> Array:
    """Radius of the braid over its radius at rest, f(eps).

    r/r0 = sqrt(1 - cos^2(alpha0) (1 - eps)^2) / sin(alpha0). Inextensible strands, cylinder. Stretched until the
    strands lie straight (cos(alpha0)(1 - eps) > 1) there is no cylinder; 1e-6 is returned there, with gradient 0.
    Tondu 2012, eqs 3 and 9.
    """
    squared = _radius_ratio_squared(contraction, braid_angle)
    braided = squared > _STRAIGHT
    return jnp.sqrt(jnp.where(braided, squared, _STRAIGHT))


def cos_angle(contraction: ArrayLike, braid_angle: ArrayLike) -> Array:
    """Cosine of the present braid angle: cos(alpha) = cos(alpha0) (1 - eps). Tondu 2012, eq 8."""
    return jnp.cos(braid_angle) * (1 - contraction)


def tan_angle(contraction: ArrayLike, braid_angle: ArrayLike) -> Array:
    """Tangent of the present braid angle: tan(alpha) = tan(alpha0) (r/r0) / (1 - eps). Tondu 2012, eq 8."""
    return jnp.tan(braid_angle) * radius_ratio(contraction, braid_angle) / (1 - contraction)


def angle(contraction: ArrayLike, braid_angle: ArrayLike) -> Array:
    """Present braid angle from the long axis, rad. Tondu 2012, eq 8."""
    sine = jnp.sin(braid_angle) * radius_ratio(contraction, braid_angle)
    return jnp.arctan2(sine, cos_angle(contraction, braid_angle))


def cord_length(length: ArrayLike, braid_angle: ArrayLike) -> Array:
    """Length of one strand from end to end, m: B = l0/cos(alpha0). Tondu 2012, eq 13."""
    return length / jnp.cos(braid_angle)


def turns(length: ArrayLike, radius: ArrayLike, braid_angle: ArrayLike) -> Array:
    """Turns of one strand around the muscle: N = l0 tan(alpha0)/(2 pi r0). Tondu 2012, eq 13."""
    return length * jnp.tan(braid_angle) / (2 * jnp.pi * radius)


def network_length(side: ArrayLike, columns: ArrayLike, angle: ArrayLike) -> Array:
    """Length of a network of m columns of pantographs of side s, m: l = 2 m s cos(alpha). Tondu 2012, eq 15."""
    return 2 * columns * side * jnp.cos(angle)


def network_circumference(side: ArrayLike, rows: ArrayLike, angle: ArrayLike) -> Array:
    """Circumference of a network of n rows of pantographs, m: 2 pi r = 2 n s sin(alpha). Tondu 2012, eq 15."""
    return 2 * rows * side * jnp.sin(angle)


def largest_contraction(braid_angle: ArrayLike) -> Array:
    """Contraction where the ideal force vanishes: 1 - 1/(sqrt(3) cos(alpha0)). Tondu 2012, eq 11.

    The root multiplies the cosine; the braid angle is then atan(sqrt(2)) = 54.74 deg whatever the muscle.
    """
    return 1 - 1 / (jnp.sqrt(3.0) * jnp.cos(braid_angle))


def largest_angle() -> Array:
    """Braid angle where the ideal force vanishes, rad: atan(sqrt(2)), for any muscle. Tondu 2012, eq 11."""
    return jnp.arctan(jnp.sqrt(2.0))


def largest_radius(radius: ArrayLike, braid_angle: ArrayLike) -> Array:
    """Radius where the ideal force vanishes, m: sqrt(2/3) r0/sin(alpha0). Tondu 2012, eq 11."""
    return jnp.sqrt(2 / 3) * radius / jnp.sin(braid_angle)


def contraction_at_45_degrees(braid_angle: ArrayLike) -> Array:
    """Contraction where the contact surface of the strands is least: 1 - 1/(sqrt(2) cos(alpha0)). Tondu 2012, eq 35."""
    return 1 - 1 / (jnp.sqrt(2.0) * jnp.cos(braid_angle))


# What pressure delivers ----------------------------------------------------------------------------------------------


def force_from_volume(
    volume: Callable[[Array], Array], contraction: ArrayLike, pressure: ArrayLike, length: ArrayLike
) -> Array:
    """Force (N) of any frictionless shape without elasticity: F = (P/l0) dV/d eps = -P dV/dl.

    `volume` (m^3) is a function of the contraction alone. Assumes nothing but energy: the work of the pressure goes
    into the load. Every other pressure force here is checked against it. Tondu 2012, eqs 4, 6, 7.
    """
    return pressure / length * slope(volume, contraction)


def virtual_work(
    force: ArrayLike, contraction: ArrayLike, pressure: ArrayLike, length: ArrayLike, radius: ArrayLike,
    braid_angle: ArrayLike,
) -> Array:  # fmt: skip
    """Work (J) left over when a cylinder shortens by d eps = 1: zero for the force in equilibrium.

    2 pi r l P dr/d eps - pi r^2 P l0 - F l0. Tondu 2012, eq 4 with dl = -l0 d eps.
    """
    present = radius * radius_ratio(contraction, braid_angle)
    growth = radius * slope(lambda eps: radius_ratio(eps, braid_angle), contraction)
    side = 2 * jnp.pi * present * length * (1 - contraction) * pressure * growth
    return side - jnp.pi * present**2 * pressure * length - force * length


def force_from_radius(
    ratio: Callable[[Array], Array], contraction: ArrayLike, pressure: ArrayLike, radius: ArrayLike
) -> Array:
    """Force (N) of a cylinder whose radius follows r/r0 = f(eps): pi r0^2 P [2(1 - eps) f f' - f^2].

    The dot of the review is d/d eps. Tondu 2012, eq 5.
    """
    present = ratio(jnp.asarray(contraction, dtype=float))
    growth = slope(ratio, contraction)
    return jnp.pi * radius**2 * pressure * (2 * (1 - contraction) * present * growth - present**2)


def ideal_force(contraction: ArrayLike, pressure: ArrayLike, radius: ArrayLike, braid_angle: ArrayLike) -> Array:
    """Pull (N) of the ideal cylinder: F = pi r0^2 P [a(1 - eps)^2 - b], a = 3/tan^2(alpha0), b = 1/sin^2(alpha0).

    Cylinder over its whole length, inextensible strands, no wall, no friction. Positive up to `largest_contraction`,
    negative beyond. Tondu 2012, eq 10 (maximum at eps = 0: eq 11).
    """
    a, b = 3 / jnp.tan(braid_angle) ** 2, 1 / jnp.sin(braid_angle) ** 2
    return jnp.pi * radius**2 * pressure * (a * (1 - contraction) ** 2 - b)


def ideal_force_schulte(angle: ArrayLike, pressure: ArrayLike, right_angle_radius: ArrayLike) -> Array:
    """The ideal pull (N) by the present braid angle: pi r90^2 P (3 cos^2(alpha) - 1), r90 = r0/sin(alpha0).

    The same law as `ideal_force` in Schulte's variables. Tondu 2012, eq 12.
    """
    return jnp.pi * right_angle_radius**2 * pressure * (3 * jnp.cos(angle) ** 2 - 1)


def ideal_force_gaylord(length: ArrayLike, pressure: ArrayLike, cord_length: ArrayLike, turns: ArrayLike) -> Array:
    """The ideal pull (N) by the present `length` l (m): P (3 l^2 - B^2)/(4 pi N^2).

    The same law as `ideal_force` in Gaylord's variables; l = lambda2 l0, which the review's formula calls mu.
    Tondu 2012, eq 14.
    """
    return pressure * (3 * length**2 - cord_length**2) / (4 * jnp.pi * turns**2)


def tip_force(
    contraction: ArrayLike, pressure: ArrayLike, radius: ArrayLike, braid_angle: ArrayLike, factor: ArrayLike
) -> Array:
    """The ideal pull (N) when the braid contracts `factor` times as much as the muscle: F10(k eps, P).

    Empirical, k = 1.1 to 1.4. Tondu 2012, 'Tip effects' (Tondu and Lopez 2000).
    """
    return ideal_force(factor * contraction, pressure, radius, braid_angle)


def axial_share(angle: ArrayLike) -> Array:
    """Axial over circumferential force of the network, f/f_c = 1/tan(alpha). Tondu 2012, eq 16."""
    return 1 / jnp.tan(angle)


def braid_force(
    contraction: ArrayLike, pressure: ArrayLike, radius: ArrayLike, braid_angle: ArrayLike, inner_radius: ArrayLike
) -> Array:
    """Axial force (N) of the braid that carries the circumferential force of a bore of present `inner_radius` (m).

    2 pi r_i r P/tan^2(alpha) = n f, n the rows of the network (the review's middle step "2 n f" is twice that).
    Assumes that the wall carries no hoop stress. Tondu 2012, eq 17.
    """
    present = radius * radius_ratio(contraction, braid_angle)
    return 2 * jnp.pi * inner_radius * present * pressure / tan_angle(contraction, braid_angle) ** 2


def real_force_printed(
    contraction: ArrayLike, pressure: ArrayLike, radius: ArrayLike, braid_angle: ArrayLike, inner_radius: ArrayLike
) -> Array:
    """Pull (N) of the review's "real" cylinder: (2 pi r_i r/tan^2(alpha) - pi r_i^2) P, present `inner_radius` (m).

    Not energy-consistent: the wall is taken to carry neither hoop nor axial stress, and 2 to 3 % of P dV is missing
    at a wall of 7 to 10 %. A wall without stiffness leaves exactly `ideal_force`. Tondu 2012, eq 18.
    """
    return braid_force(contraction, pressure, radius, braid_angle, inner_radius) - jnp.pi * inner_radius**2 * pressure


def real_force_thin_printed(
    contraction: ArrayLike, pressure: ArrayLike, radius: ArrayLike, braid_angle: ArrayLike, wall_ratio: ArrayLike
) -> Array:
    """`real_force_printed` (N) to first order in the wall: F10 - pi r0^2 P 2 h0 (2c^2 - 1)/[(1 - eps)(1 - c^2)].

    c = cos(alpha). Crosses the ideal law at 45 deg; breaks energy conservation like its parent. Tondu 2012, eqs 19 and
    20 (eps = 0; the losses of 9 and 8 % beside it need h0 = 0.1, not 0.01).
    """
    c2 = cos_angle(contraction, braid_angle) ** 2
    loss = 2 * wall_ratio * (2 * c2 - 1) / ((1 - contraction) * (1 - c2))
    return ideal_force(contraction, pressure, radius, braid_angle) - jnp.pi * radius**2 * pressure * loss


# Shapes --------------------------------------------------------------------------------------------------------------


def cylinder_volume(contraction: ArrayLike, length: ArrayLike, radius: ArrayLike, braid_angle: ArrayLike) -> Array:
    """Volume inside the braid, cylinder to the ends, m^3: pi r^2 l. Tondu 2012, after eq 7."""
    return jnp.pi * radius**2 * _radius_ratio_squared(contraction, braid_angle) * length * (1 - contraction)


def cone_cylinder_volume(
    contraction: ArrayLike, length: ArrayLike, radius: ArrayLike, braid_angle: ArrayLike, cone_ratio: ArrayLike
) -> Array:
    """Volume (m^3) of a cylinder between two cones that narrow to the fittings, each l_c = k_c l0 eps long.

    pi r^2 (l - 2 l_c) + (2 pi l_c/3)(r^2 + r r0 + r0^2). The cones meet at eps = 1/(1 + 2 k_c). Tondu 2012, shape of
    eq 25; its force by `force_from_volume` is always below the cylinder's, near rest by 4 k_c eps pi r0^2
    P/tan^2(alpha0).
    """
    present = radius * radius_ratio(contraction, braid_angle)
    cone = cone_ratio * length * contraction
    ends = 2 / 3 * jnp.pi * cone * (present**2 + present * radius + radius**2)
    return jnp.pi * present**2 * (length * (1 - contraction) - 2 * cone) + ends


def reduced_length_volume(
    contraction: ArrayLike, length: ArrayLike, radius: ArrayLike, braid_angle: ArrayLike, factor: ArrayLike
) -> Array:
    """Volume (m^3) of a cylinder whose ends take away some of its length: pi r^2 (l - factor (r - r0)).

    factor = 2 for quarter-circle ends. Kothera et al. 2009; Tondu 2012, 'Tip effects'.
    """
    present = radius * radius_ratio(contraction, braid_angle)
    return jnp.pi * present**2 * (length * (1 - contraction) - factor * (present - radius))


def cone_force(
    contraction: ArrayLike, pressure: ArrayLike, radius: ArrayLike, braid_angle: ArrayLike, cone_ratio: ArrayLike
) -> Array:
    """Pull (N) of the cylinder with conical ends, by its volume: independent of length. Tondu 2012, eq 25 corrected."""

    def volume(eps: Array) -> Array:
        return cone_cylinder_volume(eps, 1.0, radius, braid_angle, cone_ratio)

    return force_from_volume(volume, contraction, pressure, 1.0)


def cone_force_printed(
    contraction: ArrayLike, pressure: ArrayLike, radius: ArrayLike, braid_angle: ArrayLike, cone_ratio: ArrayLike
) -> Array:
    """Pull (N) of the cylinder with conical ends as the review has it; breaks energy conservation.

    pi r0^2 P {-1 + 2(1-eps)/tan^2(alpha0) [1 - eps + (k_c eps/3)(r0/r - 4)]}. The axial push of the pressure on the
    moving cones, pi (r^2 - r0^2) P, and the change of the cones' length are left out, so the work delivered is 2 to 4
    times P dV. Valid for eps <= 1/(1 + 2 k_c). Tondu 2012, eq 25.
    """
    ends = cone_ratio * contraction / 3 * (1 / radius_ratio(contraction, braid_angle) - 4)
    bracket = 2 * (1 - contraction) / jnp.tan(braid_angle) ** 2 * (1 - contraction + ends) - 1
    return jnp.pi * radius**2 * pressure * bracket


def largest_cone_ratio(braid_angle: ArrayLike) -> Array:
    """Largest k_c whose cones do not meet within the ideal stroke: (1 - eps_max)/(2 eps_max). Tondu 2012, eq 25."""
    stroke = largest_contraction(braid_angle)
    return (1 - stroke) / (2 * stroke)


def delivered_work(force: Callable[[Array], Array], length: ArrayLike, contraction: ArrayLike) -> Array:
    """Work (J) that a force law, a function of contraction alone, delivers from rest to a scalar `contraction`.

    l0 int F d eps by 64-point Gauss-Legendre quadrature.
    """
    half = jnp.asarray(contraction, dtype=float) / 2
    return length * half * jnp.sum(_WEIGHTS * force(half * (1 + _NODES)))


# Contact of strands --------------------------------------------------------------------------------------------------


def contact_surface(contraction: ArrayLike, length: ArrayLike, radius: ArrayLike, braid_angle: ArrayLike) -> Array:
    """Contact surface (m^2) of the two families of strands: 2 pi r0 l0 (r0/r)(l0/l) = 2 pi r0 l0 sin(2 a0)/sin(2 a).

    Flat strands of constant width that cover the muscle fully at rest. Falls until 45 deg, rises after.
    Tondu 2012, eqs 34 and 35.
    """
    return 2 * jnp.pi * radius * length / (radius_ratio(contraction, braid_angle) * (1 - contraction))


def rhombus_area(strand_width: ArrayLike, angle: ArrayLike) -> Array:
    """Area (m^2) where two crossing strips of width D overlap: D^2/sin(2 alpha). Tondu 2012, eq 34."""
    return strand_width**2 / jnp.sin(2 * angle)
