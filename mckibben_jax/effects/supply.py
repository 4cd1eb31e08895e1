"""What lies between the pressure that was set and the muscle: dead time, a valve, a line full of liquid.

They are used by name. `diagnose` does not look for them: only a recording whose pressure jumps shows them, and a gas is
no straight line in time, so that their memory is as good as the sampling and not exact as the library's.
"""

from typing import ClassVar

import jax
import jax.numpy as jnp
from scipy import constants

from mckibben_jax.effect import Felt, Pull, Read
from mckibben_jax.laws import valve
from mckibben_jax.laws.shape import volume_and_growth
from mckibben_jax.memory import Memory, delayed
from mckibben_jax.muscle import Muscle
from mckibben_jax.parameter import parameter
from mckibben_jax.state import State

ONLY_WHEN_NAMED = "a candidate only when named: it shows where the pressure jumps"


class SupplyOrifice(Felt, Memory):
    """Air reaches the muscle through a valve: flow by ISO 6358 from the port's pressure, polytropic gas in the muscle.

    V dp/dt = n (C p0 p1 w - p dV/dt) with p1 the higher of both absolute pressures, w the flow factor, negative while
    the muscle empties, and V that of the muscle and V_d.
    """

    states_rates = True
    title = "Supply of gas through a valve"
    part = "supply"
    formula = "P -> p - P_atm, (V + V_d) dp/dt = n (C p0 p1 w(b) - p dV/dt)"
    source = "ISO 6358-1:2013; Richer & Hurmuzlu 2000 (polytropic gas in a changing volume)"
    suspect = "after a step of the set-point the muscle fills at a steady rate at first, the longer the larger it is"
    family = "supply"
    on_request: ClassVar[str] = ONLY_WHEN_NAMED
    fixed = (f"{constants.atmosphere:g} Pa",)
    C: jax.Array = parameter(2e-8, "m^3/(s Pa)", "sonic conductance", range=(1e-10, 1e-6), starts=(1e-8, 5e-8))
    b: jax.Array = parameter(0.3, "1", "critical pressure ratio", range=(0.05, 0.6))
    n: jax.Array = parameter(1.2, "1", "polytropic exponent, 1 isothermal, 1.4 adiabatic", range=(1.0, 1.4))
    V_d: jax.Array = parameter(1e-5, "m^3", "volume of line and fittings", range=(0.0, 1e-2))

    def start(self, muscle: Muscle, state: State) -> jax.Array:
        return state.pressure

    def advance(self, muscle: Muscle, memory: jax.Array, before: State, after: State) -> jax.Array:
        first, last = (volume_and_growth(muscle, state)[0] + self.V_d for state in (before, after))
        middle = (first + last) / 2
        port = _absolute((before.pressure + after.pressure) / 2)
        stride = self.n * self.C * valve.REFERENCE_PRESSURE * (after.time - before.time) / middle
        squeezed = _absolute(memory) * (first / middle) ** self.n
        pressure = valve.filled(squeezed, port, stride, self.b) * (middle / last) ** self.n
        return pressure - constants.atmosphere

    def felt(self, muscle: Muscle, state: State, pull: Pull) -> State:
        volume, growth = volume_and_growth(muscle, state)
        inside, port = _absolute(state.memory), _absolute(state.pressure)
        higher, lower = jnp.maximum(inside, port), jnp.minimum(inside, port)
        flow = jnp.sign(port - inside) * self.C * higher * valve.flow_factor(lower / higher, self.b)
        rise = self.n * (valve.REFERENCE_PRESSURE * flow - inside * growth) / (volume + self.V_d)
        return state.replace(pressure=state.memory, pressure_rate=rise)


def _absolute(gauge: jax.Array) -> jax.Array:
    return jnp.maximum(gauge + constants.atmosphere, 1.0)  # of a vacuum nothing flows


class LiquidLine(Felt):
    """The muscle is filled with a liquid through a line that resists: P - R dV/dt, no gas law."""

    title = "Supply line filled with liquid"
    part = "supply"
    formula = "P -> P - R dV/dt"
    source = "Hagen-Poiseuille flow; virtual work of an incompressible filling"
    suspect = "a muscle filled with liquid that moves as if damped, more so where its volume changes faster"
    family = "supply"
    on_request: ClassVar[str] = ONLY_WHEN_NAMED
    R: jax.Array = parameter(1e9, "Pa s/m^3", "resistance of the line", range=(0.0, 1e13), starts=(1e8, 1e10))

    def felt(self, muscle: Muscle, state: State, pull: Pull) -> State:
        return state.replace(pressure=state.pressure - self.R * volume_and_growth(muscle, state)[1])


class SupplyDelay(Read):
    """Valve and line have a dead time: the muscle gets the pressure that was set tau earlier."""

    title = "Delay of the supply"
    part = "supply"
    formula = "P(t) -> P(t - tau)"
    source = "instrument"
    suspect = "nothing happens for a while after the set-point has jumped"
    on_request: ClassVar[str] = ONLY_WHEN_NAMED
    channel: ClassVar[str] = "pressure"
    tau: jax.Array = parameter(0.01, "s", "dead time", range=(0.0, 1.0), starts=(5e-3, 0.03))

    def read(self, signal: jax.Array, time: jax.Array) -> jax.Array:
        return delayed(signal, time, self.tau)
