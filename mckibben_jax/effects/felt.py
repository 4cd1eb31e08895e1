"""What the braid really feels of the contraction and pressure that the rig reports."""

import jax
import jax.numpy as jnp
from scipy import constants

from mckibben_jax.effect import INSTRUMENT, Felt, Pull, measured
from mckibben_jax.effects.behind_spring import PLACE, near_by, standing
from mckibben_jax.laws import braid, working_pressure
from mckibben_jax.laws.shape import shape, volume_and_growth
from mckibben_jax.memory import Memory, follow
from mckibben_jax.muscle import Muscle
from mckibben_jax.parameter import parameter
from mckibben_jax.state import State


class PressureOffset(Felt):
    """The pressure gauge reads P_off too high: true pressure = reading - P_off."""

    knows_rates = False
    title = "Wrong zero of the pressure gauge"
    part = "pressure gauge"
    formula = "P -> P - P_off"
    source = INSTRUMENT
    misreads = ("pressure", "zero")
    suspect = "even misfit that follows the force per pressure; a vented muscle does not read zero"
    P_off: jax.Array = parameter(1e3, "Pa", "reading at zero pressure", range=(-5e4, 5e4), starts=(0.0,))

    def felt(self, muscle: Muscle, state: State, pull: Pull) -> State:
        return state.replace(pressure=state.pressure - self.P_off)


class PressureGain(Felt):
    """The pressure gauge reads too much in proportion: true pressure = reading / (1 + g)."""

    knows_rates = False
    title = "Wrong gain of the pressure gauge"
    part = "pressure gauge"
    formula = "P -> P/(1 + g)"
    source = INSTRUMENT
    misreads = ("pressure", "gain")
    suspect = "even misfit proportional to the force of the gas; hides in the radius and the braid angle"
    g: jax.Array = parameter(0.01, "1", "relative error of the gauge", range=(-0.3, 0.3), starts=(0.0,))

    def felt(self, muscle: Muscle, state: State, pull: Pull) -> State:
        return state.replace(pressure=state.pressure / (1 + self.g))


class ContractionOffset(Felt):
    """The muscle was not at rest where its length was set to zero: true contraction = reading - eps_off."""

    knows_rates = False
    title = "Wrong zero of the rest length"
    part = "position gauge"
    formula = "eps -> eps - eps_off"
    source = INSTRUMENT
    misreads = ("position", "zero")
    suspect = "even misfit proportional to pressure and to the slope of the force over contraction"
    eps_off: jax.Array = parameter(2e-3, "1", "reading at rest", range=(-0.05, 0.05), starts=(0.0,))

    def felt(self, muscle: Muscle, state: State, pull: Pull) -> State:
        return state.replace(contraction=state.contraction - self.eps_off)


class SupplyLag(Felt, Memory):
    """The pressure in the muscle follows the pressure at the port, first order: tau dP_m/dt = P - P_m."""

    states_rates = True
    family = "supply"
    knows_rates = False
    title = "Lag of the supply pressure"
    part = "supply"
    formula = "P -> P_m, tau dP_m/dt = P - P_m"
    source = "first-order filling of a volume through a line; the time constant of Richer & Hurmuzlu 2000, linearised"
    suspect = "inflating and deflating differ although the muscle stands still, the more the faster the pressure moves"
    tau: jax.Array = parameter(0.05, "s", "time constant of filling", range=(1e-4, 5.0), starts=(0.02, 0.3))

    def start(self, muscle: Muscle, state: State) -> jax.Array:
        return state.pressure

    def advance(self, muscle: Muscle, memory: jax.Array, before: State, after: State) -> jax.Array:
        return follow(memory, before.pressure, after.pressure, (after.time - before.time) / self.tau)

    def felt(self, muscle: Muscle, state: State, pull: Pull) -> State:
        rate = (state.pressure - state.memory) / self.tau
        return state.replace(pressure=state.memory, pressure_rate=rate)


class PressureDrop(Felt):
    """A muscle that grows fast starves: the line cannot fill it in time, P - tau (P + 1 atm) (dV/dt)/V.

    V = pi r^2 l; dV/dt follows the motion alone, at the pressure of the port.
    """

    title = "Pressure drop in the supply"
    part = "supply"
    formula = "P -> P - tau (P + P_atm) (1/V) dV/dt, V = pi r^2 l"
    source = "Richer & Hurmuzlu 2000, linearised about the port pressure"
    suspect = "odd misfit that grows with speed and does not vanish with the gauge pressure"
    fixed = (f"{constants.atmosphere:g} Pa",)
    tau: jax.Array = parameter(5e-3, "s", "time constant of filling", range=(0.0, 0.5), starts=(0.02,))

    def felt(self, muscle: Muscle, state: State, pull: Pull) -> State:
        present, growth = volume_and_growth(muscle, state)
        absolute = state.pressure + constants.atmosphere
        return state.replace(pressure=state.pressure - self.tau * absolute * growth / present)


class DeadBand(Felt):
    """The first P_th of the pressure only brings the bladder to the braid: max(P - P_th, 0)."""

    knows_rates = False
    title = "Dead band of the bladder"
    part = "bladder"
    formula = "P -> max(P - P_th, 0)"
    source = "Colbrunn et al. 2001; Sangian et al. 2015; Tondu 2012, 'working pressure'"
    suspect = "too much force at every pressure, by the same amount of pressure"
    P_th: jax.Array = parameter(1e4, "Pa", "threshold pressure", range=(0.0, 2e5))

    def felt(self, muscle: Muscle, state: State, pull: Pull) -> State:
        return state.replace(pressure=jnp.maximum(state.pressure - self.P_th, 0.0))


class RadialGap(Felt):
    """The bladder is narrower than the braid and must balloon before it touches: a dead band set by its own rubber.

    P_th is the pressure in a free thin tube of the outer radius r0 (1 - gap) when it has grown to r0.
    """

    knows_rates = False
    title = "Gap between bladder and braid"
    part = "bladder"
    formula = "P -> max(P - P_th, 0), P_th = P_free(1/(1 - gap))"
    source = "Delson et al. 2005; Davis et al. 2003; Tondu 2012, beside fig. 8(a)"
    suspect = "as a dead band, where the bladder at rest is known to be loose in the braid"
    needs = ("wall_thickness", "shear_modulus")
    gap: jax.Array = parameter(0.05, "1", "gap over the braid's radius", range=(0.0, 0.3), starts=(0.02, 0.15))

    def felt(self, muscle: Muscle, state: State, pull: Pull) -> State:
        bladder = muscle.radius * (1 - self.gap)
        wall_ratio = measured(muscle, "wall_thickness") / bladder
        contact = working_pressure.free_tube_pressure(
            muscle.radius / bladder, wall_ratio, measured(muscle, "shear_modulus")
        )
        return state.replace(pressure=jnp.maximum(state.pressure - contact, 0.0))


class SeriesCompliance(Felt):
    """End fittings, cable and rig give way: the muscle is shorter than the rig says, by F/k_s.

    The muscle stands where rig and spring agree, eps = reading + F(eps)/(k_s l0), with F the frictionless pull at the
    muscle's own state. Dry friction holds it within a band around there: where the path turns, the braid
    sticks until friction has changed sides (`mckibben_jax.laws.sticking`), which is the hysteresis of a held muscle.
    """

    knows_rates = False
    title = "Compliant fittings and rig"
    part = "fittings"
    formula = "eps -> eps + F/(k_s l0)"
    source = "rig property; statics of a spring in series"
    suspect = "misfit that grows with the square of the pressure, largest near rest; hysteresis of a held length"
    states_rates = True
    k_s: jax.Array = parameter(2e5, "N/m", "stiffness in series", range=(1e4, 1e8))

    def spring(self, muscle: Muscle) -> jax.Array:
        return self.k_s * muscle.length

    def felt(self, muscle: Muscle, state: State, pull: Pull) -> State:
        give = self.spring(muscle)
        own_pull = lambda *at: pull(state.replace(**dict(zip(PLACE, at, strict=True))))  # noqa: E731
        stands = standing(own_pull, state, jax.lax.stop_gradient(give))
        near = near_by(own_pull, stands, state, pull.rates_matter)
        steepness = jax.lax.stop_gradient(1 - near.slope / give)  # of what has to vanish
        # a Newton step gives the root its derivatives
        off = -(near.contraction - state.contraction - near.pull / give) / steepness
        slope, drift = near.slope + off * near.bend, near.drift + off * near.drift_slope
        return state.replace(contraction=near.contraction + off, rate=(state.rate + drift / give) / (1 - slope / give))


class Tip(Felt):
    """The ends do not open fully: the braid contracts k times as much as the muscle's length says.

    A bare net whose ends are held does so by its shape alone: `mckibben_jax.laws.ends.held_ends_factor` is its k.
    """

    knows_rates = False
    title = "Tip correction"
    part = "ends"
    formula = "eps -> k eps"
    source = "Tondu & Lopez 2000; Tondu 2012, 'Tip effects'"
    suspect = "even misfit proportional to pressure that grows with contraction; less stroke than the ideal law"
    family = "tip"
    k: jax.Array = parameter(1.15, "1", "ratio of braid to muscle contraction", range=(0.5, 2.0), starts=(1.1,))

    def felt(self, muscle: Muscle, state: State, pull: Pull) -> State:
        return state.replace(contraction=self.k * state.contraction)


class TipPressure(Felt):
    """The ends open more or less with pressure: the braid contracts b_k + a_k exp(-P/P_k) times as much as the muscle.

    a_k of either sign; 0 leaves the plain tip correction.
    """

    knows_rates = False
    title = "Tip correction that depends on pressure"
    part = "ends"
    formula = "eps -> [b_k + a_k exp(-P/P_k)] eps"
    source = "Tondu & Lopez 2000; Tondu 2012, 'Tip effects'"
    suspect = "as a tip correction that differs from pressure to pressure, most below 1 bar"
    family = "tip"
    b_k: jax.Array = parameter(1.15, "1", "ratio of contractions at high pressure", range=(0.5, 2.0), starts=(1.1,))
    a_k: jax.Array = parameter(0.1, "1", "what vanishing pressure adds", range=(-0.5, 0.5), starts=(-0.05, 0.05))
    P_k: jax.Array = parameter(1e5, "Pa", "pressure of the change", range=(1e4, 1e6), starts=(6e4, 2e5))

    def felt(self, muscle: Muscle, state: State, pull: Pull) -> State:
        factor = self.b_k + self.a_k * jnp.exp(-state.pressure / self.P_k)
        return state.replace(contraction=factor * state.contraction)


class StrandStretch(Felt):
    """The strands give way under the tension that carries the pressure: cords of length B (1 + T/EA).

    T = 2 pi r^2 P/(tan^2(alpha) cos(alpha)) is the tension of all strands of the unstretched cord, EA their stiffness.
    """

    knows_rates = False
    title = "Strands that stretch"
    part = "strands"
    formula = "B -> B (1 + T/EA), T = 2 pi r^2 P/[tan^2(alpha) cos(alpha)]"
    source = "Davis et al. 2003; Tondu 2012, eqs 14 and 17"
    suspect = "even misfit that grows with the square of the pressure and hardly with contraction"
    EA: jax.Array = parameter(2e5, "N", "stiffness of all strands together", range=(1e4, 1e8))

    def felt(self, muscle: Muscle, state: State, pull: Pull) -> State:
        rigid = shape(muscle, state.replace(stretch=jnp.zeros_like(state.stretch)))
        axial = braid.braid_force(
            rigid.contraction, state.pressure, rigid.radius, rigid.braid_angle, rigid.braid_radius
        )
        tension = axial / braid.cos_angle(rigid.contraction, rigid.braid_angle)
        return state.replace(stretch=tension / self.EA)
