"""The braid's shape at a felt state: the one place where strand stretch meets the kinematics of the network."""

import equinox as eqx
import jax
import jax.numpy as jnp

from mckibben_jax.laws import braid
from mckibben_jax.muscle import Muscle
from mckibben_jax.state import State

STANDSTILL = 1e-15  # m/s: what rounding makes of a standstill; a static point is approached at some 1e-10


class Shape(eqx.Module):
    """A braid whose strands are stretched is a similar braid, 1 + stretch times as large at the same angle.

    Its own contraction counts from its own length, so that every law of the rigid network holds unchanged.
    """

    contraction: jax.Array
    length: jax.Array
    radius: jax.Array
    braid_angle: jax.Array
    size: jax.Array

    @property
    def braid_radius(self) -> jax.Array:
        """Radius of the braid now, m (eq 9)."""
        return self.radius * braid.radius_ratio(self.contraction, self.braid_angle)

    @property
    def angle(self) -> jax.Array:
        """Braid angle now, rad (eq 8)."""
        return braid.angle(self.contraction, self.braid_angle)

    @property
    def volume(self) -> jax.Array:
        """Volume of the cylinder inside the braid, m^3."""
        return braid.cylinder_volume(self.contraction, self.length, self.radius, self.braid_angle)

    @property
    def contact_surface(self) -> jax.Array:
        """Contact surface between the strands, m^2 (eq 35); as many crossings as before, of strands as wide."""
        length, radius = self.length / self.size, self.radius / self.size
        return braid.contact_surface(self.contraction, length, radius, self.braid_angle)

    def ideal_force(self, pressure: jax.Array) -> jax.Array:
        """Force of the ideal cylinder, N (eq 10)."""
        return braid.ideal_force(self.contraction, pressure, self.radius, self.braid_angle)

    @property
    def path(self) -> jax.Array:
        """How far the strands have turned, as a length l0 (1 - cos alpha / cos alpha0), m."""
        return self.length * self.contraction


def shape(muscle: Muscle, state: State) -> Shape:
    """The shape of the muscle's braid at a felt state."""
    size = 1 + state.stretch
    contraction = 1 - (1 - state.contraction) / size
    return Shape(contraction, muscle.length * size, muscle.radius * size, muscle.braid_angle, size)


def volume_and_growth(muscle: Muscle, state: State) -> tuple[jax.Array, jax.Array]:
    """Volume inside the braid, m^3, and how fast it grows with the motion, m^3/s."""

    def volume(contraction: jax.Array, stretch: jax.Array) -> jax.Array:
        return shape(muscle, state.replace(contraction=contraction, stretch=stretch)).volume

    return jax.jvp(volume, (state.contraction, state.stretch), (state.rate, state.stretch_rate))


def path(muscle: Muscle, state: State) -> jax.Array:
    """The path that friction between strands follows: the stroke when strands are rigid, m."""
    return muscle.length * (1 - (1 - state.contraction) / (1 + state.stretch))


def path_rate(muscle: Muscle, state: State) -> jax.Array:
    """Speed along that path, m/s."""
    moved = jax.jvp(
        lambda c, s: path(muscle, state.replace(contraction=c, stretch=s)),
        (state.contraction, state.stretch),
        (state.rate, state.stretch_rate),
    )
    return moved[1]


def direction_of_path(muscle: Muscle, state: State) -> jax.Array:
    """Direction of the motion along that path: 1, -1, or 0 at a standstill, whatever rounding makes of it."""
    rate = path_rate(muscle, state)
    return jnp.sign(jnp.where(jnp.abs(rate) < STANDSTILL, 0.0, rate))
