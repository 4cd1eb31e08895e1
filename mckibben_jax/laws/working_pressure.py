"""What the wall asks of the pressure and what it can bear: eqs 23 and 24, stresses through a thick wall, life.

Words and units as in `rubber`: `wall_ratio` h0 = t0/r0, stretches present over rest, `c10`, `c01` in Pa, pressures in
Pa.
"""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike

from mckibben_jax.laws import rubber
from mckibben_jax.laws.braid import radius_ratio, tan_angle, zero_between

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(32)
# Latex bladders that failed at these largest contractions after so many cycles; Klute and Hannaford 1998 in Tondu 2012.
_FATIGUE_CONTRACTION, _FATIGUE_CYCLES = (0.25, 0.05), (4320.0, 17620.0)


# Pressure to fill the braid ------------------------------------------------------------------------------------------


def _thin_pressure(hoop: ArrayLike, axial: ArrayLike, wall_ratio: ArrayLike, shear_modulus: ArrayLike) -> Array:
    # s1 t/r_i of eq 22 with t/r_i = h0/((1 - h0) l1^2 l2)
    thickness = wall_ratio / ((1 - jnp.asarray(wall_ratio)) * jnp.square(hoop) * axial)
    return rubber.thin_wall_stresses(hoop, axial, shear_modulus)[0] * thickness


def minimum_pressure_thin(
    contraction: ArrayLike, braid_angle: ArrayLike, wall_ratio: ArrayLike, shear_modulus: ArrayLike
) -> Array:
    """Pressure (Pa) that presses a thin neo-Hookean tube against the braid: s1 t/r_i.

    P (1 - h0)/(G h0) = (1/lambda2)(1 - 1/(lambda1^4 lambda2^2)), lambda1 of the bore by the thin root, lambda2 = 1 -
    eps. The tube follows the braid over the whole stroke from its value at `largest_contraction`. Tondu 2012, eq 23
    with lambda2 squared.
    """
    hoop = rubber.thin_inner_stretch(contraction, braid_angle, wall_ratio)
    return _thin_pressure(hoop, 1 - contraction, wall_ratio, shear_modulus)


def minimum_pressure_thin_printed(
    contraction: ArrayLike, braid_angle: ArrayLike, wall_ratio: ArrayLike, shear_modulus: ArrayLike
) -> Array:
    """Eq 23 as printed (Pa), lambda2 not squared: not s1 t/r_i, and not the thin limit of the exact wall."""
    hoop = rubber.thin_inner_stretch(contraction, braid_angle, wall_ratio)
    axial = 1 - contraction
    return shear_modulus * wall_ratio / (1 - wall_ratio) / axial * (1 - 1 / (hoop**4 * axial))


def _hoop_integral(start: ArrayLike, end: ArrayLike, axial_stretch: ArrayLike, k: ArrayLike) -> Array:
    # int (s_theta - s_r)/r dr per 2 (C10 + C01 lz^2), between squared rest radii; lz r^2 = R^2 + k. Written with
    # log1p and one quotient, since the two logarithms of the usual form nearly cancel in a thin wall.
    gap = end - start
    logarithm = jnp.log1p(k * gap / (start * (end + k)))
    return (logarithm + k * gap / ((start + k) * (end + k))) / (2 * axial_stretch)


def minimum_pressure(
    contraction: ArrayLike, braid_angle: ArrayLike, wall_ratio: ArrayLike, c10: ArrayLike, c01: ArrayLike
) -> Array:
    """Pressure (Pa) that presses a thick Mooney-Rivlin tube against the braid: int (s_theta - s_r)/r dr over the wall.

    2 (C10 + C01 lz^2) {[ln(r0/r_i0) - ln(r/r_i)]/lz + K/(2 lz^2) (1/r^2 - 1/r_i^2)}, lz = 1 - eps, K = r_i0^2 - lz
    r_i^2. The wall keeps this much of the pressure, the braid gets the rest. Addition to Tondu 2012, eq 23.
    """
    axial = 1 - jnp.asarray(contraction)
    bore = jnp.square(1 - jnp.asarray(wall_ratio))
    k = rubber.open_bore(axial * radius_ratio(contraction, braid_angle) ** 2 - 1, bore)
    return 2 * (c10 + c01 * axial**2) * _hoop_integral(bore, 1.0, axial, k)


def free_tube_axial_stretch(circumferential_stretch: ArrayLike) -> Array:
    """Axial stretch of a thin closed tube without braid, axial stress half the hoop stress.

    2 l1^2 l2^4 - l1^4 l2^2 - 1 = 0, so l2^2 = [l1^4 + sqrt(l1^8 + 8 l1^2)]/(4 l1^2). Beside Tondu 2012, fig. 8(a).
    """
    squared = jnp.square(circumferential_stretch)
    return jnp.sqrt((squared + jnp.sqrt(squared**2 + 8 / squared)) / 4)


def free_tube_pressure(circumferential_stretch: ArrayLike, wall_ratio: ArrayLike, shear_modulus: ArrayLike) -> Array:
    """Pressure (Pa) in a thin neo-Hookean tube without braid, free to lengthen.

    P (1 - h0)/(G h0) = (1/l2)(1 - 1/(l1^4 l2^2)), l2 of `free_tube_axial_stretch`. Rises to 0.7499 at l1 = 1.5769 and
    falls after: the tube balloons. Beside Tondu 2012, fig. 8(a) (Johnson, Soden 1966).
    """
    axial = free_tube_axial_stretch(circumferential_stretch)
    return _thin_pressure(circumferential_stretch, axial, wall_ratio, shear_modulus)


def held_tube_pressure(circumferential_stretch: ArrayLike, wall_ratio: ArrayLike, shear_modulus: ArrayLike) -> Array:
    """Pressure (Pa) in a thin neo-Hookean tube without braid, held at its length: P (1-h0)/(G h0) = 1 - 1/l1^4.

    Rises for ever towards 1: no ballooning. Beside Tondu 2012, fig. 8(a).
    """
    return _thin_pressure(circumferential_stretch, 1.0, wall_ratio, shear_modulus)


def ballooning_stretch() -> Array:
    """Circumferential stretch where the pressure in a free thin neo-Hookean tube is greatest: 1.57687, for any tube."""
    return zero_between(jax.grad(lambda stretch: free_tube_pressure(stretch, 0.5, 1.0)), 1.2, 2.5)


# What it bears -------------------------------------------------------------------------------------------------------


def burst_pressure(
    contraction: ArrayLike, braid_angle: ArrayLike, wall_ratio: ArrayLike, breaking_stress: ArrayLike
) -> Array:
    """Pressure (Pa) that brings the hoop stress P r_i/t to the breaking stress.

    sigma_b h0/((1 - h0) lambda1^2 lambda2). Thin wall; least at the end of the stroke. Lets the rubber carry all of the
    pressure, though the braid takes most of it: cautious. Tondu 2012, eq 24 (sigma_b of 45 IRHD natural rubber is 28
    MPa, not 280).
    """
    hoop = rubber.thin_inner_stretch(contraction, braid_angle, wall_ratio)
    return breaking_stress * wall_ratio / ((1 - wall_ratio) * hoop**2 * (1 - contraction))


def smallest_braid_angle(breaking_elongation: ArrayLike) -> Array:
    """Least braid angle at rest (rad) whose widest cylinder does not break the rubber: asin(sqrt(2/3)/(1 + e)).

    e is the elongation at break: 6.8 for 45 IRHD natural rubber gives 6 deg, 4.2 gives 9 deg. The outer surface counts;
    the bore of a thick wall is stretched more. Tondu 2012, eq 11 and text before eq 21.
    """
    return jnp.arcsin(jnp.sqrt(2 / 3) / (1 + jnp.asarray(breaking_elongation)))


def fatigue_cycles(contraction: ArrayLike) -> Array:
    """Cycles to failure of a latex bladder by the largest contraction of each: a power law through two points.

    4320 cycles at 25 %, 17 620 at 5 %, slope -0.873. Other rubbers and wall thicknesses differ. Tondu 2012, after eq 24
    (Klute and Hannaford 1998).
    """
    (first, second), (many, most) = _FATIGUE_CONTRACTION, _FATIGUE_CYCLES
    exponent = jnp.log(most / many) / jnp.log(second / first)
    return many * (jnp.asarray(contraction) / first) ** exponent


# Stresses through a thick wall ---------------------------------------------------------------------------------------


def wall_stresses(
    rest_radius: ArrayLike, contraction: ArrayLike, pressure: ArrayLike, radius: ArrayLike, braid_angle: ArrayLike,
    wall_ratio: ArrayLike, c10: ArrayLike, c01: ArrayLike,
) -> tuple[Array, Array, Array]:  # fmt: skip
    """Radial, hoop and axial true stress (Pa, tension positive) where the rubber rests at `rest_radius` (m).

    Balance ds_r/dr = (s_theta - s_r)/r with s_r = -P at the bore, stress differences of eq 31. At the outer surface
    s_r = -(P - P_min): what is left for the braid. Tondu 2012, after eq 32.
    """
    axial = 1 - jnp.asarray(contraction)
    present = radius * radius_ratio(contraction, braid_angle)
    here, bore = jnp.square(rest_radius), jnp.square(radius * (1 - jnp.asarray(wall_ratio)))
    k = rubber.open_bore(axial * present**2 - jnp.square(radius), bore)
    hoop_stretch = jnp.sqrt((here + k) / (axial * here))
    hoop, along = rubber.mooney_rivlin_stresses(hoop_stretch, axial, c10, c01)
    radial = 2 * (c10 + c01 * axial**2) * _hoop_integral(bore, here, axial, k) - pressure
    return radial, hoop + radial, along + radial


def wall_axial_force(
    contraction: ArrayLike, pressure: ArrayLike, radius: ArrayLike, braid_angle: ArrayLike, wall_ratio: ArrayLike,
    c10: ArrayLike, c01: ArrayLike,
) -> Array:  # fmt: skip
    """Axial force (N, tension positive) in the rubber wall: 2 pi int s_z r dr, 32-point quadrature of `wall_stresses`.

    With dA = pi d(r^2) = pi d(R^2)/lz. Equals F - 2 pi r^2 (P - P_min)/tan^2(alpha) + pi r_i^2 P, F of
    `thick_wall_force`.
    """
    contraction, pressure, radius, braid_angle, wall_ratio, c10, c01 = (
        jnp.asarray(x, dtype=float)[..., None]
        for x in (contraction, pressure, radius, braid_angle, wall_ratio, c10, c01)
    )
    outer, inner = radius**2, (radius * (1 - wall_ratio)) ** 2
    squared = (outer + inner) / 2 + (outer - inner) / 2 * _NODES
    stress = wall_stresses(
        jnp.sqrt(squared), contraction, pressure, radius, braid_angle, wall_ratio, c10, c01
    )[2]  # fmt: skip
    return jnp.pi * jnp.sum(stress * (outer - inner) / 2 * _WEIGHTS / (1 - contraction), axis=-1)


def fibre_reinforced_force(
    contraction: ArrayLike, pressure: ArrayLike, radius: ArrayLike, braid_angle: ArrayLike, wall_ratio: ArrayLike,
    c10: ArrayLike, c01: ArrayLike,
) -> Array:  # fmt: skip
    """Pull (N) of a rubber tube reinforced by two families of inextensible fibres, by the balance of stresses.

    Assumptions named for Liu and Rahn (2003): inextensible fibres at +-alpha on a cylinder, Mooney-Rivlin rubber at
    large strain in polar coordinates (their own paper takes the wall as a membrane, which is the limit of a thin one).
    Fibres of tension T per width of net give the resultants n_theta = T sin^2(alpha), n_z = T cos^2(alpha). Hoop
    balance with what the wall leaves of the pressure, n_theta = (P - P_min) r, gives the net's axial force
    2 pi r n_z = 2 pi r^2 (P - P_min)/tan^2(alpha). With the axial stress of the wall and the pressure on the bore's
    end, F = 2 pi r^2 (P - P_min)/tan^2(alpha) + 2 pi int s_z r dr - pi r_i^2 P.
    The same as `rubber.thick_wall_force`, which comes from energy alone. Addition to Tondu 2012, after eq 32.
    """
    present = radius * radius_ratio(contraction, braid_angle)
    bore = rubber.inner_radius(contraction, radius, braid_angle, wall_ratio)
    left = pressure - minimum_pressure(contraction, braid_angle, wall_ratio, c10, c01)
    net = 2 * jnp.pi * present**2 * left / tan_angle(contraction, braid_angle) ** 2
    wall = wall_axial_force(contraction, pressure, radius, braid_angle, wall_ratio, c10, c01)
    return net + wall - jnp.pi * bore**2 * pressure
