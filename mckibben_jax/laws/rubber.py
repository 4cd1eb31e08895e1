"""The rubber tube: stresses, stored energy and the elastic forces that follow (eqs 21, 22, 26-32).

Stretches are present over rest dimensions: `hoop_stretch` lambda1, `axial_stretch` lambda2 = l/l0 = 1 - eps,
`radial_stretch` lambda3 = 1/(lambda1 lambda2), for rubber keeps its volume. `wall_ratio` h0 = t0/r0, whole wall over
the outer radius at rest. `c10`, `c01` (Pa) are the Mooney-Rivlin constants; neo-Hookean rubber of shear modulus G has
c10 = G/2, c01 = 0. Energies are per metre of REST length (J/m), so that a force is minus their slope in the
contraction. Forces (N) are what the rubber ADDS to the pull: negative against contraction, zero at rest. Braid
outside the tube unless said otherwise.
"""

from collections.abc import Callable

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike

from mckibben_jax.laws.braid import ideal_force, radius_ratio, slope, tan_angle

# What is left of the squared bore, relative to rest, when the wall energy stops growing: a tube cannot close further.
_CLOSED = 1e-6
_HENCKY = 1e-3  # exponents nearer to zero are taken as this: the law goes on smoothly there, its formula does not
_NODES, _WEIGHTS = (part.tolist() for part in np.polynomial.legendre.leggauss(5))  # exact to 1e-7 for 0.28 radii
# Hardness (IRHD) and shear modulus (MPa) of natural rubbers; 45 and 65 are the two of Tondu 2012.
_HARDNESS = np.array([30.0, 35.0, 40.0, 45.0, 50.0, 55.0, 60.0, 65.0, 70.0, 75.0])
_MODULUS = np.array([0.30, 0.37, 0.45, 0.54, 0.64, 0.81, 1.06, 1.37, 1.73, 2.22])


# Material ------------------------------------------------------------------------------------------------------------


def shear_modulus(c10: ArrayLike, c01: ArrayLike) -> Array:
    """Shear modulus at small strain, Pa: G = 2 (C10 + C01). Tondu 2012, eq 30."""
    return 2 * (jnp.asarray(c10) + c01)


def shear_modulus_of_hardness(hardness: ArrayLike) -> Array:
    """Shear modulus (Pa) of natural rubber by its hardness (IRHD): 45 is 0.54 MPa, 65 is 1.37 MPa.

    Interpolates a table in log G; 30 to 75 IRHD, held constant outside. Hardness is read to 2 degrees, which is 8 %
    in G. Tondu 2012, text before eq 24; other rows Lindley, Engineering Design with Natural Rubber.
    """
    return 1e6 * jnp.exp(jnp.interp(jnp.asarray(hardness, dtype=float), _HARDNESS, np.log(_MODULUS)))


def treloar_stresses(
    hoop_stretch: ArrayLike, axial_stretch: ArrayLike, radial_stretch: ArrayLike, shear_modulus: ArrayLike
) -> tuple[Array, Array]:
    """Hoop and axial true stress above the radial one, Pa: G (l1^2 - l3^2), G (l2^2 - l3^2). Tondu 2012, eq 21."""
    l1, l2, l3 = jnp.square(hoop_stretch), jnp.square(axial_stretch), jnp.square(radial_stretch)
    return shear_modulus * (l1 - l3), shear_modulus * (l2 - l3)


def thin_wall_stresses(
    hoop_stretch: ArrayLike, axial_stretch: ArrayLike, shear_modulus: ArrayLike
) -> tuple[Array, Array]:
    """Hoop and axial stress of a thin wall (no radial stress), Pa: eq 21 with l3 = 1/(l1 l2). Tondu 2012, eq 22."""
    return treloar_stresses(hoop_stretch, axial_stretch, 1 / (hoop_stretch * axial_stretch), shear_modulus)


def _invariants(hoop_stretch: ArrayLike, axial_stretch: ArrayLike) -> tuple[Array, Array]:
    # I1 - 3 and I2 - 3 of incompressible rubber
    l1, l2 = jnp.square(hoop_stretch), jnp.square(axial_stretch)
    return l1 + l2 + 1 / (l1 * l2) - 3, 1 / l1 + 1 / l2 + l1 * l2 - 3


def rivlin_energy(hoop_stretch: ArrayLike, axial_stretch: ArrayLike, coefficients: ArrayLike) -> Array:
    """Energy per volume (J/m^3): sum over i, j of C_ij (I1 - 3)^i (I2 - 3)^j, C_00 = 0. Tondu 2012, eq 29.

    `coefficients` is the matrix C_ij in Pa; its leading row and column are i = 0 and j = 0.
    """
    first, second = _invariants(hoop_stretch, axial_stretch)
    coefficients = jnp.asarray(coefficients)
    rows, columns = coefficients.shape
    terms = [coefficients[i, j] * first**i * second**j for i in range(rows) for j in range(columns)]
    return jnp.sum(jnp.stack(terms), axis=0)


def mooney_rivlin_energy(hoop_stretch: ArrayLike, axial_stretch: ArrayLike, c10: ArrayLike, c01: ArrayLike) -> Array:
    """Energy per volume (J/m^3): C10 (I1 - 3) + C01 (I2 - 3). Tondu 2012, eq 30."""
    first, second = _invariants(hoop_stretch, axial_stretch)
    return c10 * first + c01 * second


def ogden_energy(
    hoop_stretch: ArrayLike, axial_stretch: ArrayLike, shear_modulus: ArrayLike, exponent: ArrayLike
) -> Array:
    """Energy per volume (J/m^3) of one term: (2 G/n^2)(l1^n + l2^n + l3^n - 3), G at small strain. Ogden 1972.

    n = 2 is neo-Hookean rubber, n = -2 the second Mooney-Rivlin constant alone (C01 = G/2), n = 0 Hencky's law, which
    is the limit. The more negative n is, the sooner the resistance of a tube that widens stops growing.
    """
    n = jnp.where(jnp.abs(exponent) < _HENCKY, _HENCKY, exponent)
    hoop, axial = jnp.exp(n * jnp.log(hoop_stretch)), jnp.exp(n * jnp.log(axial_stretch))
    return 2 * shear_modulus / jnp.square(n) * (hoop + axial + 1 / (hoop * axial) - 3)


def mooney_rivlin_stresses(
    hoop_stretch: ArrayLike, axial_stretch: ArrayLike, c10: ArrayLike, c01: ArrayLike
) -> tuple[Array, Array]:
    """Hoop and axial stress above the radial one, Pa: 2 (l1^2 - l3^2)(C10 + l2^2 C01), 2 (l2^2 - l3^2)(C10 + l1^2 C01).

    True stress. Tondu 2012, eq 31; c10 = G/2, c01 = 0 is eq 21.
    """
    l1, l2 = jnp.square(hoop_stretch), jnp.square(axial_stretch)
    l3 = 1 / (l1 * l2)
    return 2 * (l1 - l3) * (c10 + l2 * c01), 2 * (l2 - l3) * (c10 + l1 * c01)


# The wall under the braid --------------------------------------------------------------------------------------------


def inner_radius(contraction: ArrayLike, radius: ArrayLike, braid_angle: ArrayLike, wall_ratio: ArrayLike) -> Array:
    """Present radius of the bore (m) of incompressible rubber: r_i^2 = r^2 - r0^2 (1 - (1 - h0)^2)/(1 - eps).

    Exact. A bore that would have closed is returned as 1e-3 r0 (1 - h0). Tondu 2012, note 4 without its approximation.
    """
    squared = radius_ratio(contraction, braid_angle) ** 2 - wall_ratio * (2 - wall_ratio) / (1 - contraction)
    rest = (1 - wall_ratio) ** 2
    return radius * jnp.sqrt(jnp.where(squared > _CLOSED * rest, squared, _CLOSED * rest))


def thin_inner_stretch(contraction: ArrayLike, braid_angle: ArrayLike, wall_ratio: ArrayLike) -> Array:
    """Stretch of the bore r_i/r_i0 where r_i (r - r_i)(1 - eps) = r_i0 t0: lambda1 of eq 23.

    lambda1 = lambda/(2(1 - h0)) [1 + sqrt(1 - 4 h0 (1 - h0)/(lambda^2 lambda2))], lambda = r/r0. Thin wall: 1 at rest
    only for h0 < 1/2; where the root is not real (lambda^2 lambda2 < 4 h0 (1 - h0)) it is taken as 0.
    Tondu 2012, eq 23.
    """
    ratio = radius_ratio(contraction, braid_angle)
    squared = 1 - 4 * wall_ratio * (1 - wall_ratio) / (ratio**2 * (1 - contraction))
    root = jnp.where(squared > 0, jnp.sqrt(jnp.where(squared > 0, squared, 1.0)), 0.0)
    return ratio / (2 * (1 - wall_ratio)) * (1 + root)


def inner_radius_thin(
    contraction: ArrayLike, radius: ArrayLike, braid_angle: ArrayLike, wall_ratio: ArrayLike
) -> Array:
    """Present radius of the bore (m) by the thin-wall incompressibility of eq 23. Tondu 2012, eq 23 and note 4."""
    return radius * (1 - wall_ratio) * thin_inner_stretch(contraction, braid_angle, wall_ratio)


def open_bore(k: ArrayLike, inner_squared: ArrayLike) -> Array:
    """k of lz r_m^2 = R^2 + k (m^2), kept where the bore, squared radius `inner_squared` at rest, is still open."""
    return jnp.where(inner_squared + k > _CLOSED * inner_squared, k, (_CLOSED - 1) * inner_squared)


def wall_area(radius: ArrayLike, wall_ratio: ArrayLike) -> Array:
    """Cross-section of the whole wall at rest, m^2: pi (r0^2 - r_i0^2)."""
    return jnp.pi * jnp.square(radius) * wall_ratio * (2 - wall_ratio)


def thin_wall_energy(
    hoop_stretch: ArrayLike, axial_stretch: ArrayLike, wall_area: ArrayLike, c10: ArrayLike, c01: ArrayLike
) -> Array:
    """Energy (J per metre of rest length) of a wall that is stretched alike through its thickness: area times W.

    `wall_area` at rest (m^2). With the braid's own r/r0 for the hoop this is the energy of eq 32, with the stretch of
    the bore and the area 2 pi r_i0 t0 that of eq 28 corrected. At h0 = 0.28 the former misses a third of
    `thick_wall_energy`.
    """
    return wall_area * mooney_rivlin_energy(hoop_stretch, axial_stretch, c10, c01)


def thick_wall_energy(
    braid_radius: ArrayLike, axial_stretch: ArrayLike, rest_radius: ArrayLike, inner_radius: ArrayLike,
    outer_radius: ArrayLike, c10: ArrayLike, c01: ArrayLike,
) -> Array:  # fmt: skip
    """Energy (J per metre of rest length) of a thick incompressible Mooney-Rivlin tube.

    int W(lambda_theta, lz) 2 pi R dR from `inner_radius` to `outer_radius` (rest, m), the material surface that rests
    at `rest_radius` being held at `braid_radius` (m): on the wall, inside it, or outside. With lz r_m^2 = R^2 + k,
    k = lz r_b^2 - R_b^2, hoop stretch r_m/R and radial stretch 1/(lz r_m/R), the integrals are
        int (I1 - 3) 2 R dR = (lz - 1)^2 (lz + 2)/lz A + (k/lz) L,      A = R_o^2 - R_i^2,
        int (I2 - 3) 2 R dR = (lz - 1)^2 (2 lz + 1)/lz^2 A + lz k L,    L = ln[1 + k A/(R_i^2 (R_o^2 + k))].
    Needs an open bore, R_i^2 + k > 0; beyond, L keeps its last value and the derivatives are finite. Zero with zero
    slope at rest, exact to second order there. Tondu 2012, after eq 32 (Rivlin).
    """
    inner, outer = jnp.square(inner_radius), jnp.square(outer_radius)
    area = outer - inner
    k = axial_stretch * jnp.square(braid_radius) - jnp.square(rest_radius)
    held = open_bore(k, inner)
    logarithm = k * jnp.log1p(held * area / (inner * (outer + held)))
    squeeze = (axial_stretch - 1) ** 2 * area
    first = squeeze * (axial_stretch + 2) / axial_stretch + logarithm / axial_stretch
    second = squeeze * (2 * axial_stretch + 1) / axial_stretch**2 + logarithm * axial_stretch
    return jnp.pi * (c10 * first + c01 * second)


def thick_ogden_energy(
    braid_radius: ArrayLike, axial_stretch: ArrayLike, rest_radius: ArrayLike, inner_radius: ArrayLike,
    outer_radius: ArrayLike, shear_modulus: ArrayLike, exponent: ArrayLike,
) -> Array:  # fmt: skip
    """Energy (J per metre of rest length) of a thick incompressible tube of rubber after Ogden, one term.

    int W(lambda_theta, lz) 2 pi R dR as in `thick_wall_energy`, by Gauss points in R^2, for there is no closed form.
    Needs an open bore; beyond, it keeps its last value. Zero with zero slope at rest. Ogden 1972.
    """
    inner, outer = jnp.square(inner_radius), jnp.square(outer_radius)
    k = open_bore(axial_stretch * jnp.square(braid_radius) - jnp.square(rest_radius), inner)
    rings = 0.5 * (inner + outer) + 0.5 * (outer - inner) * jnp.asarray(_NODES)
    hoop = jnp.sqrt((rings + k) / (rings * axial_stretch))
    energies = ogden_energy(hoop, jnp.asarray(axial_stretch), shear_modulus, exponent)
    return jnp.pi * (outer - inner) * jnp.sum(0.5 * jnp.asarray(_WEIGHTS) * energies)


# Elastic forces ------------------------------------------------------------------------------------------------------


def elastic_force(energy: Callable[[Array], Array], contraction: ArrayLike) -> Array:
    """Elastic force (N), dE/dl, of any `energy` (J per metre of rest length) given as a function of contraction."""
    return -slope(energy, contraction)


def thin_elastic_force(
    contraction: ArrayLike, radius: ArrayLike, braid_angle: ArrayLike, wall_ratio: ArrayLike, shear_modulus: ArrayLike
) -> Array:
    """Elastic force (N) of a thin neo-Hookean wall, dE/dl with E = 2 pi r_i0 t0 l0 (G/2)(I1 - 3).

    To leading order 2 pi r_i t (s2 - s1/tan^2(alpha)): the hoop part, handed on by the braid, dominates. At
    eps = 0.1, 20 deg, h0 = 0.1 it is 16 times the printed eq 28. Tondu 2012, eq 28 corrected.
    """

    def energy(eps: Array) -> Array:
        hoop = thin_inner_stretch(eps, braid_angle, wall_ratio)
        area = 2 * jnp.pi * jnp.square(radius) * wall_ratio * (1 - wall_ratio)
        return thin_wall_energy(hoop, 1 - eps, area, jnp.asarray(shear_modulus) / 2, 0.0)

    return elastic_force(energy, contraction)


def concise_elastic_force(
    contraction: ArrayLike, radius: ArrayLike, braid_angle: ArrayLike, wall_ratio: ArrayLike, c10: ArrayLike,
    c01: ArrayLike,
) -> Array:  # fmt: skip
    """Elastic force (N) of a Mooney-Rivlin wall that follows the braid, r/r0, through its whole thickness.

    (V_b/l0){C10 [2x(1-c) - 2x(1+c-2cx^2)/(x^2+cx^2(1-x^2))^2] + C01 [2x(1+c-2cx^2) - 2/x^3 + 2cx/(1+c(1-x^2))^2]} with
    x = 1 - eps, c = 1/tan^2(alpha0), V_b = pi (r0^2 - r_i0^2) l0 the volume of the wall. Tondu 2012, eq 32 with 1/l0
    and the last sign corrected, and the AXIAL stretch where it writes lambda1 (Kothera et al. 2009).
    """

    def energy(eps: Array) -> Array:
        return thin_wall_energy(radius_ratio(eps, braid_angle), 1 - eps, wall_area(radius, wall_ratio), c10, c01)

    return elastic_force(energy, contraction)


def thick_elastic_force(
    contraction: ArrayLike, radius: ArrayLike, braid_angle: ArrayLike, wall_ratio: ArrayLike, c10: ArrayLike,
    c01: ArrayLike,
) -> Array:  # fmt: skip
    """Elastic force (N) of a Mooney-Rivlin wall of any thickness under a braid: dE/dl of `thick_wall_energy`.

    Exact for a cylinder; G/2, 0 for c10, c01 is neo-Hookean. Tondu 2012, after eq 32.
    """

    def energy(eps: Array) -> Array:
        present = radius * radius_ratio(eps, braid_angle)
        return thick_wall_energy(present, 1 - eps, radius, radius * (1 - wall_ratio), radius, c10, c01)

    return elastic_force(energy, contraction)


def thick_wall_force(
    contraction: ArrayLike, pressure: ArrayLike, radius: ArrayLike, braid_angle: ArrayLike, wall_ratio: ArrayLike,
    c10: ArrayLike, c01: ArrayLike,
) -> Array:  # fmt: skip
    """Frictionless pull (N) of a cylinder with a thick wall: ideal force at the OUTER radius plus the elastic force.

    Equals the full balance of stresses: rubber that keeps its volume gives the pressure the outer volume to work on.
    """
    elastic = thick_elastic_force(contraction, radius, braid_angle, wall_ratio, c10, c01)
    return ideal_force(contraction, pressure, radius, braid_angle) + elastic


def schulte_elastic_force(
    contraction: ArrayLike, length: ArrayLike, radius: ArrayLike, braid_angle: ArrayLike, stiffness: ArrayLike
) -> Array:
    """Elastic force (N) of a wall of linear stiffness k_e (Pa).

    2 pi k_e r (l - l0) - 4 pi^2 k_e r (r - r0)/tan^2(alpha). Axial tension k_e (l - l0) and hoop tension k_e 2 pi (r
    - r0) per width, by virtual work; the two have no common potential. Tondu 2012, eq 26 with l - l0 for l (Schulte
    1961).
    """
    shortening = -2 * jnp.pi * stiffness * length * contraction * radius * radius_ratio(contraction, braid_angle)
    return shortening + _schulte_hoop(contraction, radius, braid_angle, stiffness)


def _schulte_hoop(contraction: ArrayLike, radius: ArrayLike, braid_angle: ArrayLike, stiffness: ArrayLike) -> Array:
    ratio = radius_ratio(contraction, braid_angle)
    widening = 4 * jnp.pi**2 * stiffness * jnp.square(radius) * ratio * (ratio - 1)
    return -widening / tan_angle(contraction, braid_angle) ** 2


# As printed ----------------------------------------------------------------------------------------------------------


def schulte_elastic_force_printed(
    contraction: ArrayLike, length: ArrayLike, radius: ArrayLike, braid_angle: ArrayLike, stiffness: ArrayLike
) -> Array:
    """Eq 26 as printed (N), with 2 pi k_e r l: 2 pi k_e r0 l0 at rest instead of nothing. Tondu 2012, eq 26."""
    corrected = schulte_elastic_force(contraction, length, radius, braid_angle, stiffness)
    return corrected + 2 * jnp.pi * stiffness * radius * radius_ratio(contraction, braid_angle) * length


def axial_elastic_force_printed(
    contraction: ArrayLike, radius: ArrayLike, braid_angle: ArrayLike, wall_ratio: ArrayLike, shear_modulus: ArrayLike
) -> Array:
    """The review's elastic force (N) of a thin wall: -pi (r^2 - r_i^2) s2, thin r_i.

    Its sign is wrong where the wall is in axial tension, and the hoop part is missing: its work is 0.05 (20 deg) and
    -0.04 (30 deg) of the energy of the same rubber at the end of the stroke, h0 = 0.1. Tondu 2012, eqs 27 and 28.
    """
    hoop = thin_inner_stretch(contraction, braid_angle, wall_ratio)
    _, axial_stress = thin_wall_stresses(hoop, 1 - contraction, shear_modulus)
    outer = radius * radius_ratio(contraction, braid_angle)
    inner = radius * (1 - wall_ratio) * hoop
    return -jnp.pi * (outer**2 - inner**2) * axial_stress


def concise_elastic_force_printed(
    contraction: ArrayLike, braid_angle: ArrayLike, wall_volume: ArrayLike, c10: ArrayLike, c01: ArrayLike
) -> Array:
    """Eq 32 as printed, its lambda1 read as the axial stretch: JOULES, and -4 c C01 V_b at rest. Tondu 2012, eq 32.

    `wall_volume` V_b in m^3. For the corrected force: `concise_elastic_force`.
    """
    x, c = 1 - jnp.asarray(contraction), 1 / jnp.tan(braid_angle) ** 2
    bend = 1 + c - 2 * c * x**2
    first = 2 * x * (1 - c) - 2 * x * bend / (x**2 + c * x**2 * (1 - x**2)) ** 2
    second = 2 * x * bend - 2 / x**3 - 2 * c * x / (1 + c * (1 - x**2)) ** 2
    return wall_volume * (c10 * first + c01 * second)
