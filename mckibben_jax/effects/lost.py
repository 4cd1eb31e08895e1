"""What is lost to motion: the size and direction of dry friction, and drag."""

from typing import ClassVar

import jax
import jax.numpy as jnp

from mckibben_jax.effect import Loss, Lost, measured
from mckibben_jax.laws import biology, textile
from mckibben_jax.laws.shape import path, shape
from mckibben_jax.memory import Memory, follow
from mckibben_jax.muscle import Muscle
from mckibben_jax.parameter import parameter
from mckibben_jax.state import State


def _pressing(state: State) -> jax.Array:
    # strands under vacuum do not press on each other, and friction is never negative
    return jnp.maximum(state.pressure, 0.0)


def _contact_load(muscle: Muscle, state: State) -> jax.Array:
    return shape(muscle, state).contact_surface * _pressing(state)


def _speed(muscle: Muscle, state: State) -> jax.Array:
    return muscle.length * state.rate


class CoulombFriction(Lost):
    """Strands rub on each other in proportion to the load between them: friction grows by f_s S P."""

    knows_rates = False
    title = "Coulomb friction of the strands"
    part = "strands"
    formula = "F_f -> F_f + f_s S P, S = 2 pi r0 l0 sin(2 alpha0)/sin(2 alpha)"
    source = "Davis & Caldwell 2006; Tondu 2012, eq 36 with f_s standing for f_s/S_scale"
    suspect = "odd misfit proportional to pressure, the same at every speed"
    family = "friction"
    gives = ("friction",)
    f_s: jax.Array = parameter(0.015, "1", "friction coefficient over scale factor", range=(0.0, 0.5))

    def lose(self, muscle: Muscle, state: State, loss: Loss) -> Loss:
        return loss.replace(size=loss.size + textile.coulomb_friction(_contact_load(muscle, state), self.f_s))


class TextileFriction(Lost):
    """Textile strands: friction grows less than the load, by f_s L (S P / L)^beta with L = 1 kN."""

    knows_rates = False
    title = "Textile friction of the strands"
    part = "strands"
    formula = "F_f -> F_f + f_s L (S P/L)^beta, S = 2 pi r0 l0 sin(2 alpha0)/sin(2 alpha)"
    source = "Howell, Mieszkis & Tabor 1959; Tondu 2012, eq 40"
    suspect = "hysteresis that is too wide at low pressure and too narrow at high pressure under Coulomb's law"
    family = "friction"
    gives = ("friction",)
    fixed = (f"{textile.UNIT_LOAD:g} N",)
    f_s: jax.Array = parameter(0.02, "1", "friction at a contact load of 1 kN", range=(0.0, 0.5))
    beta: jax.Array = parameter(0.72, "1", "exponent of the load", range=(0.2, 1.5), starts=(0.8,))

    def lose(self, muscle: Muscle, state: State, loss: Loss) -> Loss:
        friction = textile.power_law_friction(_contact_load(muscle, state), self.f_s, self.beta)
        return loss.replace(size=loss.size + friction)


class HertzFriction(Lost):
    """Strands touch on small round spots that grow with the load: friction grows by f_s S P / S_scale, as P^(4/3)."""

    knows_rates = False
    title = "Hertz friction of the strands"
    part = "strands"
    formula = "F_f -> F_f + f_s S P/S_scale, S_scale = (1/2) (8/3)^(1/3) [E/((1 - nu^2) P)]^(1/3)"
    source = "Davis & Caldwell 2006; Tondu 2012, eqs 36-39"
    suspect = "hysteresis that is too narrow at high pressure under Coulomb's law"
    family = "friction"
    needs = ("strand_modulus", "strand_poisson")
    gives = ("friction",)
    f_s: jax.Array = parameter(0.2, "1", "friction coefficient of the strands", range=(0.0, 5.0))

    def lose(self, muscle: Muscle, state: State, loss: Loss) -> Loss:
        friction = textile.hertz_friction(
            _pressing(state), shape(muscle, state).contact_surface, self.f_s, measured(muscle, "strand_modulus"),
            measured(muscle, "strand_poisson"),
        )  # fmt: skip
        return loss.replace(size=loss.size + friction)


class SchulteFriction(Lost):
    """The whole cylinder rubs, strand on strand and strand on bladder: friction grows by 2 pi r l P (f_s + f_st)."""

    knows_rates = False
    title = "Schulte's friction of the cylinder"
    part = "strands"
    formula = "F_f -> F_f + 2 pi r l P f"
    source = "Schulte 1961; Tondu 2012, eq 33"
    suspect = "odd misfit proportional to pressure that follows the cylinder's surface over contraction"
    family = "friction"
    gives = ("friction",)
    f: jax.Array = parameter(0.01, "1", "sum of both friction coefficients", range=(0.0, 0.5))

    def lose(self, muscle: Muscle, state: State, loss: Loss) -> Loss:
        radius, length = shape(muscle, state).braid_radius, muscle.length * (1 - state.contraction)
        return loss.replace(size=loss.size + textile.schulte_friction(_pressing(state), radius, length, self.f))


class CrossingFriction(Lost):
    """Strands turn on each other where they cross: friction grows by (4/3) pi mu_R P r / tan(alpha) at any length."""

    knows_rates = False
    title = "Friction at the crossings of strands"
    part = "strands"
    formula = "F_f -> F_f + (4/3) pi mu_R P r/tan(alpha)"
    source = "virtual work of discs that turn on each other, derived here"
    suspect = "odd misfit proportional to pressure that does not grow with the muscle's length"
    family = "friction"
    gives = ("friction",)
    mu_R: jax.Array = parameter(1.5e-4, "m", "friction coefficient times contact radius", range=(0.0, 0.02))

    def lose(self, muscle: Muscle, state: State, loss: Loss) -> Loss:
        form = shape(muscle, state)
        friction = textile.crossing_friction(_pressing(state), form.braid_radius, form.angle, self.mu_R)
        return loss.replace(size=loss.size + friction)


class ConstantFriction(Lost):
    """Friction that does not know the pressure: F_c more than whatever friction is there."""

    knows_rates = False
    title = "Constant friction"
    part = "strands"
    formula = "F_f -> F_f + F_c"
    source = "Chou & Hannaford 1996"
    suspect = "odd misfit that is the same at every pressure, contraction and speed"
    gives = ("friction",)
    F_c: jax.Array = parameter(5.0, "N", "friction without pressure", range=(0.0, 200.0))

    def lose(self, muscle: Muscle, state: State, loss: Loss) -> Loss:
        return loss.replace(size=loss.size + self.F_c)


class BladderHysteresis(Lost):
    """The rubber gives back less than it took, at any speed: friction grows by eta_b |pull of the rubber|."""

    knows_rates = False
    title = "Rubber hysteresis"
    part = "bladder"
    formula = "F_f -> F_f + eta_b |F_rubber|"
    source = "Vo-Minh et al. 2011; structural damping"
    suspect = "odd misfit without pressure, zero at rest, that follows the rubber over contraction"
    needs = ("rubber",)
    gives = ("friction",)
    eta_b: jax.Array = parameter(0.06, "1", "share of the rubber's pull", range=(0.0, 0.5))

    def lose(self, muscle: Muscle, state: State, loss: Loss) -> Loss:
        return loss.replace(size=loss.size + self.eta_b * jnp.abs(loss.elastic))


class KineticFriction(Lost):
    """Friction changes with speed: it is multiplied by ratio + (1 - ratio) exp(-|v|/v_s)."""

    title = "Friction that depends on speed"
    part = "strands"
    formula = "F_f -> F_f [ratio + (1 - ratio) exp(-|v|/v_s)]"
    source = "Tondu & Lopez 2000; Tondu 2012, eq 48 with |v|"
    suspect = "the width of the loops changes with speed"
    needs = ("friction",)
    ratio: jax.Array = parameter(2.0, "1", "fast over slow friction, f_k/f_s", range=(0.05, 20.0), starts=(0.7, 1.5))
    v_s: jax.Array = parameter(0.05, "m/s", "speed of the change", range=(1e-4, 1.0), starts=(5e-3, 0.05))

    def lose(self, muscle: Muscle, state: State, loss: Loss) -> Loss:
        return loss.replace(size=loss.size * textile.kinetic_factor(_speed(muscle, state), self.ratio, self.v_s))


class Presliding(Lost, Memory):
    """After a reversal the strands first bend before they slip: direction z with dz/dx = (1 - sgn(dx) z)/x_s (Dahl)."""

    knows_rates = False
    title = "Presliding of the strands"
    part = "strands"
    formula = "F_f sign(v) -> F_f z, dz/dx = [1 - z sign(v)]/x_s"
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


class MaxwellSlip(Lost, Memory):
    """Strands stick and slip one after the other: direction is the mean of n springs that slip at different distances.

    Element i of equal share moves by dx/X_i and slips at -1 and 1, X_i = x_s spread^((2i - n + 1)/(n - 1)). Its memory
    is not local: after a nested loop it returns to where it left.
    """

    knows_rates = False
    title = "Stick and slip of the strands"
    part = "strands"
    formula = "F_f sign(v) -> (F_f/n) sum z_i, dz_i/dx = 1/X_i, |z_i| <= 1, X_i = x_s spread^((2 i - n + 1)/(n - 1))"
    source = "Al-Bender, Lampaert & Swevers 2005; Vo-Minh et al. 2011"
    suspect = "rounded corners after each reversal; minor loops that close on themselves"
    family = "presliding"
    needs = ("friction",)
    elements: ClassVar[int] = 4
    x_s: jax.Array = parameter(4e-3, "m", "distance at which the middle slips", range=(1e-5, 0.1), starts=(2e-3, 8e-3))
    spread: jax.Array = parameter(3.0, "1", "longest distance over the middle", range=(1.0, 30.0), starts=(2.0, 6.0))

    def start(self, muscle: Muscle, state: State) -> jax.Array:
        return jnp.zeros(self.elements)

    def advance(self, muscle: Muscle, memory: jax.Array, before: State, after: State) -> jax.Array:
        moved = path(muscle, after) - path(muscle, before)
        order = jnp.linspace(-1.0, 1.0, self.elements)
        return jnp.clip(memory + moved / (self.x_s * self.spread**order), -1.0, 1.0)

    def lose(self, muscle: Muscle, state: State, loss: Loss) -> Loss:
        return loss.replace(direction=jnp.mean(state.memory, axis=-1))


class ViscousDamping(Lost):
    """Drag in proportion to speed: B v."""

    title = "Viscous damping"
    part = "muscle"
    formula = "F -> F - B v"
    source = "Reynolds et al. 2003; Tondu 2012, eq 41"
    suspect = "odd misfit that grows with speed"
    B: jax.Array = parameter(200.0, "N s/m", "damping constant", range=(0.0, 1e5))

    def lose(self, muscle: Muscle, state: State, loss: Loss) -> Loss:
        return loss.replace(drag=loss.drag + self.B * _speed(muscle, state))


class Hill(Lost):
    """Shortening costs force as in skeletal muscle: (F0 + a) v/(v + b), only while contracting."""

    title = "Hill's law of shortening"
    part = "muscle"
    formula = "F -> F - F0 (1 + a_over_F0) v/(v + b), v > 0"
    source = "Hill 1938; Kerscher et al. 2006; Tondu 2012, eqs 43-46"
    suspect = "misfit of the contracting branch alone that grows with speed and levels off"
    gives = ("force-velocity curve",)
    a_over_F0: jax.Array = parameter(0.12, "1", "Hill's a over the isometric force", range=(0.01, 5.0), starts=(0.3,))
    b: jax.Array = parameter(0.3, "m/s", "Hill's b", range=(1e-3, 100.0), starts=(1.0,))

    def lose(self, muscle: Muscle, state: State, loss: Loss) -> Loss:
        isometric = jnp.maximum(shape(muscle, state).ideal_force(state.pressure), 0.0)
        shortening = jnp.maximum(_speed(muscle, state), 0.0)
        cost = biology.hill_viscous_force(shortening, isometric, self.a_over_F0 * isometric, self.b)
        return loss.replace(drag=loss.drag + cost)


class Creep(Lost, Memory):
    """A Maxwell branch: drag K1 (x - y) whose dashpot follows, tau dy/dt = x - y."""

    knows_rates = False
    title = "Creep"
    part = "bladder"
    formula = "F -> F - K1 (x - y), tau dy/dt = x - y"
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


class Mullins(Lost, Memory):
    """Rubber that was once stretched further pulls less: drag m (pull of the rubber) (1 - exp(-(top - eps)/w)).

    `top` is the largest contraction so far; the share m of the rubber's pull is gone well below it.
    """

    knows_rates = False
    title = "Mullins effect of the rubber"
    part = "bladder"
    formula = "F -> F - m F_rubber {1 - exp[-(eps_top - eps)/w]}"
    source = "Mullins 1969; Ogden & Roxburgh 1999, after their damage function"
    suspect = "the first cycle differs from the next ones up to the same contraction"
    needs = ("rubber",)
    m: jax.Array = parameter(0.15, "1", "share of the rubber's pull that goes", range=(0.0, 0.9))
    w: jax.Array = parameter(0.05, "1", "contraction over which it goes", range=(1e-3, 0.5), starts=(0.02,))

    def start(self, muscle: Muscle, state: State) -> jax.Array:
        return state.contraction

    def advance(self, muscle: Muscle, memory: jax.Array, before: State, after: State) -> jax.Array:
        return jnp.maximum(memory, after.contraction)

    def lose(self, muscle: Muscle, state: State, loss: Loss) -> Loss:
        softened = self.m * -jnp.expm1((state.contraction - state.memory) / self.w)
        return loss.replace(drag=loss.drag + softened * loss.elastic)
