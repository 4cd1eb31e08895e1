"""What the braid really feels of the contraction and pressure that the rig reports."""

import jax
import jax.numpy as jnp
import optimistix as optx

from mckibben_jax.effect import Felt, Pull
from mckibben_jax.memory import Memory, follow
from mckibben_jax.muscle import Muscle
from mckibben_jax.parameter import parameter
from mckibben_jax.state import State


class PressureOffset(Felt):
    """The pressure gauge reads P_off too high: true pressure = reading - P_off."""

    source = "instrument"
    suspect = "even misfit that follows the force per pressure; a vented muscle does not read zero"
    P_off: jax.Array = parameter(1e3, "Pa", "reading at zero pressure", range=(-5e4, 5e4), starts=(0.0,))

    def felt(self, muscle: Muscle, state: State, pull: Pull) -> State:
        return state.replace(pressure=state.pressure - self.P_off)


class SupplyLag(Felt, Memory):
    """The pressure in the muscle follows the pressure at the port, first order: tau dP_m/dt = P - P_m."""

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


class DeadBand(Felt):
    """The first P_th of the pressure only brings the bladder to the braid: max(P - P_th, 0)."""

    source = "Colbrunn et al. 2001; Sangian et al. 2015; Tondu 2012, 'working pressure'"
    suspect = "too much force at every pressure, by the same amount of pressure"
    P_th: jax.Array = parameter(1e4, "Pa", "threshold pressure", range=(0.0, 2e5))

    def felt(self, muscle: Muscle, state: State, pull: Pull) -> State:
        return state.replace(pressure=jnp.maximum(state.pressure - self.P_th, 0.0))


class SeriesCompliance(Felt):
    """End fittings, cable and rig give way: the muscle is shorter than the rig says, by F/k_s.

    The muscle stands where rig and spring agree, eps = reading + F(eps)/(k_s l0), with F the frictionless pull at the
    muscle's own state.
    """

    source = "rig property; statics of a spring in series"
    suspect = "misfit that grows with the square of the pressure and is largest near rest"
    k_s: jax.Array = parameter(2e5, "N/m", "stiffness in series", range=(1e4, 1e8))

    def felt(self, muscle: Muscle, state: State, pull: Pull) -> State:
        def gap(contraction: jax.Array, stiffness: jax.Array) -> jax.Array:
            given = pull(state.replace(contraction=contraction)) / (stiffness * muscle.length)
            return contraction - state.contraction - given

        solver = optx.Newton(rtol=1e-10, atol=1e-12)
        found = optx.root_find(gap, solver, state.contraction, args=self.k_s, max_steps=30, throw=False)
        return state.replace(contraction=found.value)


class Tip(Felt):
    """The ends do not open fully: the braid contracts k times as much as the muscle's length says."""

    source = "Tondu & Lopez 2000; Tondu 2012, 'Tip effects'"
    suspect = "even misfit proportional to pressure that grows with contraction; less stroke than the ideal law"
    family = "tip"
    k: jax.Array = parameter(1.15, "1", "ratio of braid to muscle contraction", range=(0.5, 2.0), starts=(1.1,))

    def felt(self, muscle: Muscle, state: State, pull: Pull) -> State:
        return state.replace(contraction=self.k * state.contraction)
