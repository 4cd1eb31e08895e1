"""What energy is stored, and what the pressure does: joules as a function of the felt state."""

import jax
import jax.numpy as jnp

from mckibben_jax import rubber
from mckibben_jax.effect import Energy
from mckibben_jax.muscle import Muscle
from mckibben_jax.parameter import parameter
from mckibben_jax.shape import shape
from mckibben_jax.state import State


class IdealCylinder(Energy):
    """The gas does work as the braided cylinder's volume grows: E = -P V, which is the ideal law (eq 10)."""

    source = "Tondu & Lopez 1995, 2000; Tondu 2012, eqs 6, 7 and 10"
    suspect = "always there"
    family = "gas"

    def energy(self, muscle: Muscle, state: State) -> jax.Array:
        return -state.pressure * shape(muscle, state).volume


class BladderNeoHookean(Energy):
    """The rubber wall is strained: a thick incompressible neo-Hookean tube, by its energy."""

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

    source = "Klute & Hannaford 2000; Kothera et al. 2009; Tondu 2012, eqs 29-32, exact thick wall"
    suspect = "as the neo-Hookean bladder, with a wide range of contraction"
    family = "bladder"
    needs = ("wall_thickness",)
    gives = ("rubber",)
    C10: jax.Array = parameter(1.2e5, "Pa", "first Mooney-Rivlin constant", range=(0.0, 1e7), starts=(1e5,))
    C01: jax.Array = parameter(1e4, "Pa", "second Mooney-Rivlin constant", range=(0.0, 1e7), starts=(2e4,))

    def energy(self, muscle: Muscle, state: State) -> jax.Array:
        return _thick_wall(muscle, state, self.C10, self.C01)


class EndStop(Energy):
    """The bladder jams near the end of the stroke: a spring K that acts beyond the contraction eps_s."""

    source = "Davis et al. 2003 (minimum angle); Delson et al. 2005; effect 28 of the catalogue"
    suspect = "even misfit without pressure that starts sharply late in the stroke"
    K: jax.Array = parameter(5e3, "N/m", "stiffness of the stop", range=(0.0, 1e6))
    eps_s: jax.Array = parameter(0.2, "1", "contraction where it begins", range=(0.0, 0.45), starts=(0.1, 0.15, 0.2, 0.25))

    def energy(self, muscle: Muscle, state: State) -> jax.Array:
        beyond = jnp.maximum(state.contraction - self.eps_s, 0.0)
        return 0.5 * self.K * (muscle.length * beyond) ** 2


def _thick_wall(muscle: Muscle, state: State, c10: jax.Array, c01: jax.Array) -> jax.Array:
    braid_radius = shape(muscle, state).braid_radius
    per_length = rubber.thick_wall_energy(
        braid_radius, 1 - state.contraction, muscle.radius, muscle.inner_radius, muscle.outer_radius, c10, c01
    )
    return muscle.length * per_length
