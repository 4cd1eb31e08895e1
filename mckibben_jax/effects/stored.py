"""What energy is stored, and what the pressure does: joules as a function of the felt state."""

import equinox as eqx
import jax
import jax.numpy as jnp
from scipy import constants

from mckibben_jax.effect import Energy, Pulling, measured
from mckibben_jax.laws import braid, rubber
from mckibben_jax.laws.shape import shape
from mckibben_jax.muscle import Muscle
from mckibben_jax.parameter import as_scalar, parameter
from mckibben_jax.state import State


class IdealCylinder(Energy):
    """The gas does work as the braided cylinder's volume grows: E = -P V, which is the ideal law (eq 10)."""

    title = "Ideal cylinder"
    part = "gas"
    formula = "E = -P V, V = pi r^2 l, F = pi r0^2 P [3 (1 - eps)^2/tan^2(alpha0) - 1/sin^2(alpha0)]"
    source = "Tondu & Lopez 1995, 2000; Tondu 2012, eqs 6, 7 and 10"
    suspect = "always there"
    family = "gas"

    def energy(self, muscle: Muscle, state: State) -> jax.Array:
        return -state.pressure * shape(muscle, state).volume


class ConicalEnds(Energy):
    """The ends are cones, not a cylinder, and hold less gas: E = -P (V_cones - V_cylinder), cones k_c l0 eps long."""

    title = "Conical ends"
    part = "ends"
    formula = "E = -P (V_c - pi r^2 l), V_c = pi r^2 (l - 2 l_c) + (2/3) pi l_c (r^2 + r r0 + r0^2), l_c = k_c l0 eps"
    source = "shape of Tondu 2012, eq 25, by its volume"
    suspect = "even misfit proportional to pressure that grows with contraction, alike a tip correction"
    family = "ends"
    k_c: jax.Array = parameter(0.3, "1", "length of a cone over the stroke", range=(0.0, 1.0), starts=(0.1, 0.5))

    def energy(self, muscle: Muscle, state: State) -> jax.Array:
        form = shape(muscle, state)
        volume = braid.cone_cylinder_volume(form.contraction, form.length, form.radius, form.braid_angle, self.k_c)
        return -state.pressure * (volume - form.volume)


class ReducedLength(Energy):
    """The rounded ends take away active length as the muscle widens: V = pi r^2 (l - factor (r - r0))."""

    title = "Rounded ends"
    part = "ends"
    formula = "E = P pi r^2 factor (r - r0)"
    source = "Kothera et al. 2009; Tondu 2012, 'Tip effects'"
    suspect = "even misfit proportional to pressure, already at rest, larger in short muscles"
    family = "ends"
    factor: jax.Array = parameter(2.0, "1", "length lost over growth of the radius", range=(0.0, 6.0), starts=(1.0,))

    def energy(self, muscle: Muscle, state: State) -> jax.Array:
        form = shape(muscle, state)
        volume = braid.reduced_length_volume(form.contraction, form.length, form.radius, form.braid_angle, self.factor)
        return -state.pressure * (volume - form.volume)


class BladderNeoHookean(Energy):
    """The rubber wall is strained: a thick incompressible neo-Hookean tube, by its energy."""

    title = "Rubber wall, neo-Hookean"
    part = "bladder"
    formula = "E = (G/2) l0 int (I1 - 3) dA"
    source = "Treloar 1975; Klute & Hannaford 2000; Tondu 2012, eqs 21 and 29-32, exact thick wall"
    suspect = "even misfit that does not depend on pressure, zero at rest and growing with contraction"
    family = "bladder"
    needs = ("wall_thickness",)
    gives = ("rubber",)
    G: jax.Array = parameter(0.54e6, "Pa", "shear modulus of the rubber", range=(1e3, 2e7), starts=(0.3e6,))

    def energy(self, muscle: Muscle, state: State) -> jax.Array:
        return _thick_wall(muscle, state, self.G / 2, jnp.zeros_like(self.G))


class BladderMooneyRivlin(Energy):
    """The rubber wall is strained: a thick incompressible Mooney-Rivlin tube, by its energy."""

    title = "Rubber wall, Mooney-Rivlin"
    part = "bladder"
    formula = "E = l0 int [C10 (I1 - 3) + C01 (I2 - 3)] dA"
    source = "Klute & Hannaford 2000; Kothera et al. 2009; Tondu 2012, eqs 29-32, exact thick wall"
    suspect = "as the neo-Hookean bladder, with a wide range of contraction"
    family = "bladder"
    needs = ("wall_thickness",)
    gives = ("rubber",)
    C10: jax.Array = parameter(1.2e5, "Pa", "first Mooney-Rivlin constant", range=(0.0, 1e7), starts=(1e5,))
    C01: jax.Array = parameter(1e4, "Pa", "second Mooney-Rivlin constant", range=(0.0, 1e7), starts=(2e4,))

    def energy(self, muscle: Muscle, state: State) -> jax.Array:
        return _thick_wall(muscle, state, self.C10, self.C01)


class BladderOgden(Energy):
    """The rubber wall is strained: a thick incompressible tube of rubber after Ogden, by its energy.

    With n = 2 it is neo-Hookean rubber, with n = -2 the second Mooney-Rivlin constant alone. The more negative n is,
    the sooner the wall of a muscle that shortens stops resisting more.
    """

    title = "Rubber wall, Ogden"
    part = "bladder"
    formula = "E = (2 G/n^2) l0 int [lambda1^n + lambda2^n + (lambda1 lambda2)^(-n) - 3] dA"
    source = "Ogden 1972, one term; thick wall as Tondu 2012, eqs 29-32"
    suspect = "as the neo-Hookean bladder, where its pull hardly grows after the first percents of contraction"
    family = "bladder"
    needs = ("wall_thickness",)
    gives = ("rubber",)
    G: jax.Array = parameter(0.54e6, "Pa", "shear modulus of the rubber", range=(1e3, 2e7), starts=(0.3e6, 1.5e6))
    n: jax.Array = parameter(-4.0, "1", "exponent of the stretches", range=(-12, 4), starts=(-7, 1))

    def energy(self, muscle: Muscle, state: State) -> jax.Array:
        braid_radius, axial = shape(muscle, state).braid_radius, 1 - state.contraction
        rest, inner, outer = muscle.radius, muscle.inner_radius, muscle.outer_radius
        return muscle.length * rubber.thick_ogden_energy(braid_radius, axial, rest, inner, outer, self.G, self.n)


class BladderThinMooneyRivlin(Energy):
    """The rubber wall is strained: a Mooney-Rivlin wall that follows the braid through its whole thickness."""

    title = "Rubber wall, thin Mooney-Rivlin"
    part = "bladder"
    formula = "E = l0 A [C10 (I1 - 3) + C01 (I2 - 3)], lambda1 = r/r0, lambda2 = 1 - eps"
    source = "Kothera et al. 2009; Hocking & Wereley 2013; Tondu 2012, eq 32 corrected"
    suspect = "as the thick Mooney-Rivlin bladder, for thin walls"
    family = "bladder"
    needs = ("wall_thickness",)
    gives = ("rubber",)
    C10: jax.Array = parameter(1.2e5, "Pa", "first Mooney-Rivlin constant", range=(0.0, 1e7), starts=(1e5,))
    C01: jax.Array = parameter(1e4, "Pa", "second Mooney-Rivlin constant", range=(0.0, 1e7), starts=(2e4,))

    def energy(self, muscle: Muscle, state: State) -> jax.Array:
        hoop = shape(muscle, state).braid_radius / muscle.radius
        area = rubber.wall_area(muscle.outer_radius, measured(muscle, "wall_thickness") / muscle.outer_radius)
        return muscle.length * rubber.thin_wall_energy(hoop, 1 - state.contraction, area, self.C10, self.C01)


class BladderSchulte(Pulling):
    """The wall resists shortening and widening by two linear tensions, which have no common energy."""

    knows_rates = False
    title = "Rubber wall, Schulte"
    part = "bladder"
    formula = "F -> F + 2 pi k_e r (l - l0) - 4 pi^2 k_e r (r - r0)/tan^2(alpha)"
    source = "Schulte 1961; Tondu 2012, eq 26 with l - l0 for l"
    suspect = "as the neo-Hookean bladder, when neither wall nor rubber were measured"
    family = "bladder"
    gives = ("rubber",)
    k_e: jax.Array = parameter(5e3, "Pa", "stiffness of the wall", range=(0.0, 1e6), starts=(3e3,))

    def force(self, muscle: Muscle, state: State) -> jax.Array:
        return rubber.schulte_elastic_force(
            state.contraction, muscle.length, muscle.radius, muscle.braid_angle, self.k_e
        )


class StrandBending(Energy):
    """The strands are wound tighter as the braid angle grows: opposing force c_b (sin alpha - sin alpha_f)/tan alpha.

    `alpha_f` (rad) is the angle at which the strands were formed; None, as at rest; 0 for straight strands.
    """

    title = "Bending of the strands"
    part = "strands"
    formula = "E = (c_b/2) B [sin(alpha) - sin(alpha_f)]^2"
    source = "bending energy of a helix, (1/2) n EI L (change of curvature)^2"
    suspect = "even misfit without pressure, where there is hardly any rubber"
    c_b: jax.Array = parameter(20.0, "N", "bending stiffness n EI / r90^2", range=(0.0, 1e3))
    alpha_f: jax.Array | None = eqx.field(default=None, converter=as_scalar)

    def energy(self, muscle: Muscle, state: State) -> jax.Array:
        form = shape(muscle, state)
        formed = muscle.braid_angle if self.alpha_f is None else self.alpha_f
        cord = braid.cord_length(form.length, form.braid_angle)
        return 0.5 * self.c_b * cord * (jnp.sin(form.angle) - jnp.sin(formed)) ** 2


class LinearSpring(Energy):
    """A spring in parallel pulls back in proportion to the stroke: K l0 eps."""

    title = "Spring in parallel"
    part = "fittings"
    formula = "E = (K/2) (l0 eps)^2, F -> F - K l0 eps"
    source = "Hooke's law; Tondu 2012, eq 41"
    suspect = "even misfit without pressure that grows in a straight line from rest"
    K: jax.Array = parameter(300.0, "N/m", "stiffness in parallel", range=(0.0, 1e6))

    def energy(self, muscle: Muscle, state: State) -> jax.Array:
        return 0.5 * self.K * (muscle.length * state.contraction) ** 2


class Weight(Energy):
    """Dead weight hangs between the muscle and the load cell: m g less."""

    title = "Dead weight"
    part = "fittings"
    formula = "E = m g l0 eps, F -> F - m g"
    source = "rig property; standard gravity"
    suspect = "even misfit that is the same everywhere, and changes sides when the rig is turned over"
    fixed = (f"{constants.g:g} m/s^2",)
    m: jax.Array = parameter(0.3, "kg", "mass of fitting and cable", range=(0.0, 100.0), starts=(0.1,))

    def energy(self, muscle: Muscle, state: State) -> jax.Array:
        return self.m * constants.g * muscle.length * state.contraction


class EndStop(Energy):
    """The bladder jams near the end of the stroke: a spring K that acts beyond the contraction eps_s."""

    title = "End stop"
    part = "bladder"
    formula = "E = (K/2) l0^2 max(eps - eps_s, 0)^2, F -> F - K l0 max(eps - eps_s, 0)"
    source = "Davis et al. 2003 (minimum angle); Delson et al. 2005"
    suspect = "even misfit without pressure that starts sharply late in the stroke"
    K: jax.Array = parameter(5e3, "N/m", "stiffness of the stop", range=(0.0, 1e6))
    eps_s: jax.Array = parameter(0.2, "1", "where it begins", range=(0.0, 0.45), starts=(0.1, 0.15, 0.2, 0.25))

    def energy(self, muscle: Muscle, state: State) -> jax.Array:
        beyond = jnp.maximum(state.contraction - self.eps_s, 0.0)
        return 0.5 * self.K * (muscle.length * beyond) ** 2


class WallShielding(Pulling):
    """The printed law of a wall that carries nothing, as a difference to the ideal cylinder (eq 18); breaks energy."""

    knows_rates = False
    title = "Wall that carries nothing (as printed)"
    part = "bladder"
    formula = "F = P [2 pi r_i r/tan^2(alpha) - pi r_i^2]"
    source = "Ferraresi et al. 2001; Tondu 2012, eq 18"
    suspect = "only to compare with the review: less force near rest in proportion to pressure and wall"
    needs = ("wall_thickness",)
    rival = True

    def force(self, muscle: Muscle, state: State) -> jax.Array:
        form, wall_ratio = shape(muscle, state), measured(muscle, "wall_thickness") / muscle.radius
        bore = rubber.inner_radius(form.contraction, form.radius, form.braid_angle, wall_ratio)
        printed = braid.real_force_printed(
            form.contraction, state.pressure, form.radius, form.braid_angle, bore
        )  # fmt: skip
        return printed - form.ideal_force(state.pressure)


class ConicalEndsPrinted(Pulling):
    """The printed law of conical ends, as a difference to the ideal cylinder (eq 25); breaks energy conservation."""

    knows_rates = False
    title = "Conical ends (as printed)"
    part = "ends"
    formula = "F = pi r0^2 P {-1 + 2 (1 - eps)/tan^2(alpha0) [1 - eps + (k_c eps/3) (r0/r - 4)]}"
    source = "Tondu 2012, eq 25"
    suspect = "only to compare with the review"
    family = "ends"
    rival = True
    k_c: jax.Array = parameter(0.3, "1", "length of a cone over the stroke", range=(0.0, 1.0), starts=(0.1, 0.5))

    def force(self, muscle: Muscle, state: State) -> jax.Array:
        form = shape(muscle, state)
        printed = braid.cone_force_printed(
            form.contraction, state.pressure, form.radius, form.braid_angle, self.k_c
        )  # fmt: skip
        return printed - form.ideal_force(state.pressure)


class BladderAxialPrinted(Pulling):
    """The printed law of a thin wall, axial stress alone and of the wrong sign (eq 28); not the slope of its energy."""

    knows_rates = False
    title = "Thin wall under axial stress (as printed)"
    part = "bladder"
    formula = "F -> F - pi t0^2 G [1 - 1/(lambda1^2 (1 - eps)^4)] [1/lambda1^2 + 2 (1 - h0) (1 - eps)/h0]"
    source = "Tondu 2012, eqs 27 and 28"
    suspect = "only to compare with the review"
    family = "bladder"
    needs = ("wall_thickness",)
    gives = ("rubber",)
    rival = True
    G: jax.Array = parameter(0.54e6, "Pa", "shear modulus of the rubber", range=(1e3, 2e7), starts=(0.3e6,))

    def force(self, muscle: Muscle, state: State) -> jax.Array:
        wall_ratio = measured(muscle, "wall_thickness") / muscle.radius
        return rubber.axial_elastic_force_printed(
            state.contraction, muscle.radius, muscle.braid_angle, wall_ratio, self.G
        )


def _thick_wall(muscle: Muscle, state: State, c10: jax.Array, c01: jax.Array) -> jax.Array:
    braid_radius = shape(muscle, state).braid_radius
    per_length = rubber.thick_wall_energy(
        braid_radius, 1 - state.contraction, muscle.radius, muscle.inner_radius, muscle.outer_radius, c10, c01
    )
    return muscle.length * per_length
