"""What is lost to motion: the size and direction of dry friction, and drag."""

import jax
import jax.numpy as jnp

from mckibben_jax import biology, textile
from mckibben_jax.effect import Loss, Lost
from mckibben_jax.memory import Memory, follow
from mckibben_jax.muscle import Muscle
from mckibben_jax.parameter import parameter
from mckibben_jax.shape import path, shape
from mckibben_jax.state import State

REFERENCE_LOAD = 1e3  # N, fixed: with it beta = 1 is Coulomb's law and f_s has no dimension


def _contact_load(muscle: Muscle, state: State) -> jax.Array:
    return shape(muscle, state).contact_surface * state.pressure


def _speed(muscle: Muscle, state: State) -> jax.Array:
    return muscle.length * state.rate


class CoulombFriction(Lost):
    """Strands rub on each other in proportion to the load between them: size + f_s S P."""

    source = "Davis & Caldwell 2006; Tondu 2012, eq 36 with f_s standing for f_s/S_scale"
    suspect = "odd misfit proportional to pressure, the same at every speed"
    family = "friction"
    gives = ("friction",)
    f_s: jax.Array = parameter(0.015, "1", "friction coefficient over scale factor", range=(0.0, 0.5))

    def lose(self, muscle: Muscle, state: State, loss: Loss) -> Loss:
        return loss.replace(size=loss.size + textile.coulomb_friction(_contact_load(muscle, state), self.f_s))


class TextileFriction(Lost):
    """Textile strands: friction grows less than the load, size + f_s L (S P / L)^beta with L = 1 kN."""

    source = "Howell, Mieszkis & Tabor 1959; Tondu 2012, eq 40"
    suspect = "hysteresis that is too wide at low pressure and too narrow at high pressure under Coulomb's law"
    family = "friction"
    gives = ("friction",)
    f_s: jax.Array = parameter(0.02, "1", "friction at a contact load of 1 kN", range=(0.0, 0.5))
    beta: jax.Array = parameter(0.72, "1", "exponent of the load", range=(0.2, 1.5), starts=(0.8,))

    def lose(self, muscle: Muscle, state: State, loss: Loss) -> Loss:
        load = _contact_load(muscle, state) / REFERENCE_LOAD
        return loss.replace(size=loss.size + REFERENCE_LOAD * textile.power_law_friction(load, self.f_s, self.beta))


class ConstantFriction(Lost):
    """Friction that does not know the pressure: size + F_c, beside whatever friction is there."""

    source = "Chou & Hannaford 1996"
    suspect = "odd misfit that is the same at every pressure, contraction and speed"
    gives = ("friction",)
    F_c: jax.Array = parameter(5.0, "N", "friction without pressure", range=(0.0, 200.0))

    def lose(self, muscle: Muscle, state: State, loss: Loss) -> Loss:
        return loss.replace(size=loss.size + self.F_c)


class KineticFriction(Lost):
    """Friction changes with speed: size times ratio + (1 - ratio) exp(-|v|/v_s)."""

    source = "Tondu & Lopez 2000; Tondu 2012, eq 48 with |v|"
    suspect = "the width of the loops changes with speed"
    needs = ("friction",)
    ratio: jax.Array = parameter(2.0, "1", "fast over slow friction, f_k/f_s", range=(0.05, 20.0), starts=(0.7, 1.5))
    v_s: jax.Array = parameter(0.05, "m/s", "speed of the change", range=(1e-4, 1.0), starts=(5e-3, 0.05))

    def lose(self, muscle: Muscle, state: State, loss: Loss) -> Loss:
        return loss.replace(size=loss.size * textile.kinetic_factor(_speed(muscle, state), self.ratio, self.v_s))


class Presliding(Lost, Memory):
    """After a reversal the strands first bend before they slip: direction z with dz/dx = (1 - sgn(dx) z)/x_s (Dahl)."""

    source = "Canudas de Wit et al. 1995; Vo-Minh et al. 2011 (presliding in McKibben muscles)"
    suspect = "rounded corners after each reversal; minor loops thinner than major ones"
    family = "presliding"
    needs = ("friction",)
    x_s: jax.Array = parameter(2e-3, "m", "distance over which friction turns", range=(1e-5, 0.1), starts=(1e-3, 5e-3))

    def start(self, muscle: Muscle, state: State) -> jax.Array:
        return jnp.zeros_like(state.contraction)

    def advance(self, muscle: Muscle, memory: jax.Array, before: State, after: State) -> jax.Array:
        moved = path(muscle, after) - path(muscle, before)
        towards = jnp.sign(moved)
        return towards + (memory - towards) * jnp.exp(-jnp.abs(moved) / self.x_s)

    def lose(self, muscle: Muscle, state: State, loss: Loss) -> Loss:
        return loss.replace(direction=state.memory)


class ViscousDamping(Lost):
    """Drag in proportion to speed: B v."""

    source = "Reynolds et al. 2003; Tondu 2012, eq 41"
    suspect = "odd misfit that grows with speed"
    B: jax.Array = parameter(200.0, "N s/m", "damping constant", range=(0.0, 1e5))

    def lose(self, muscle: Muscle, state: State, loss: Loss) -> Loss:
        return loss.replace(drag=loss.drag + self.B * _speed(muscle, state))


class Hill(Lost):
    """Shortening costs force as in skeletal muscle: (F0 + a) v/(v + b), only while contracting."""

    source = "Hill 1938; Kerscher et al. 2006; Tondu 2012, eqs 43-46"
    suspect = "misfit of the contracting branch alone that grows with speed and levels off"
    a_over_F0: jax.Array = parameter(0.12, "1", "Hill's a over the isometric force", range=(0.01, 5.0), starts=(0.3,))
    b: jax.Array = parameter(0.3, "m/s", "Hill's b", range=(1e-3, 100.0), starts=(1.0,))

    def lose(self, muscle: Muscle, state: State, loss: Loss) -> Loss:
        isometric = jnp.maximum(shape(muscle, state).ideal_force(state.pressure), 0.0)
        shortening = jnp.maximum(_speed(muscle, state), 0.0)
        cost = biology.hill_viscous_force(shortening, isometric, self.a_over_F0 * isometric, self.b)
        return loss.replace(drag=loss.drag + cost)


class Creep(Lost, Memory):
    """A Maxwell branch: drag K1 (x - y) whose dashpot follows, tau dy/dt = x - y."""

    source = "Minh et al. 2010; the standard linear solid"
    suspect = "force drifts during a hold; the loop depends on speed, most at one speed"
    K1: jax.Array = parameter(500.0, "N/m", "stiffness of the branch", range=(0.0, 1e5))
    tau: jax.Array = parameter(5.0, "s", "relaxation time", range=(0.01, 1e4), starts=(1.0, 20.0))

    def start(self, muscle: Muscle, state: State) -> jax.Array:
        return muscle.length * state.contraction

    def advance(self, muscle: Muscle, memory: jax.Array, before: State, after: State) -> jax.Array:
        steps = (after.time - before.time) / self.tau
        return follow(memory, muscle.length * before.contraction, muscle.length * after.contraction, steps)

    def lose(self, muscle: Muscle, state: State, loss: Loss) -> Loss:
        return loss.replace(drag=loss.drag + self.K1 * (muscle.length * state.contraction - state.memory))
