"""What of the force reaches the load cell, and what the instrument makes of it."""

import jax
import jax.numpy as jnp

from mckibben_jax.effect import INSTRUMENT, Read
from mckibben_jax.memory import delayed
from mckibben_jax.parameter import parameter

CORNER = 1.0  # N, by which the corner of a slack muscle is rounded


class Slack(Read):
    """A muscle with too little pressure does not push: its tube bends aside and hangs slack, and the cell reads F_s.

    max(F, F_s), with its corner rounded by a newton as that of a column that is not quite straight. A clamped tube of
    bending stiffness EI buckles under 4 pi^2 EI/L^2, some newtons for rubber, and hardly bears more from there on: a
    rig that holds it shorter than at rest reads minus that load, until the pressure is high enough to pull.
    """

    title = "Slack muscle"
    part = "muscle"
    formula = "F -> max(F, F_s)"
    source = "Timoshenko & Gere 1961, clamped column and its load beyond buckling"
    suspect = "a model that pushes at low pressure and large contraction, where the reading stays near zero"
    needs = ("rubber",)  # nothing else pushes within the stroke
    fixed = (f"{CORNER:g} N",)
    F_s: jax.Array = parameter(
        -5.0, "N", "reading of the slack muscle", range=(-500.0, 100.0), starts=(0.0, -20.0), is_level=True
    )

    def read(self, signal: jax.Array, time: jax.Array) -> jax.Array:
        half = 0.5 * (signal - self.F_s)
        return self.F_s + half + jnp.sqrt(half**2 + CORNER**2)


class ForceGain(Read):
    """The load cell reads too much in proportion: F (1 + g)."""

    title = "Wrong gain of the load cell"
    part = "load cell"
    formula = "F -> F (1 + g)"
    source = INSTRUMENT
    misreads = ("force", "gain")
    suspect = "misfit proportional to the whole force, friction included; hides in the radius"
    g: jax.Array = parameter(0.01, "1", "relative error of the load cell", range=(-0.3, 0.3), starts=(0.0,))

    def read(self, signal: jax.Array, time: jax.Array) -> jax.Array:
        return signal * (1 + self.g)


class ForceOffset(Read):
    """The load cell does not read zero: F + F_off."""

    title = "Wrong zero of the load cell"
    part = "load cell"
    formula = "F -> F + F_off"
    source = INSTRUMENT
    misreads = ("force", "zero")
    suspect = "even misfit that is the same everywhere"
    F_off: jax.Array = parameter(2.0, "N", "reading at zero force", range=(-500.0, 500.0), starts=(0.0,))

    def read(self, signal: jax.Array, time: jax.Array) -> jax.Array:
        return signal + self.F_off


class TimeDelay(Read):
    """The force channel lags the others: it shows F(t - tau), straight between samples, the first one before them."""

    title = "Delay of the force channel"
    part = "load cell"
    formula = "F(t) -> F(t - tau)"
    source = INSTRUMENT
    misreads = ("time", "skew")
    suspect = "loops that open with speed, their two branches crossing where the force turns"
    tau: jax.Array = parameter(0.01, "s", "delay of the force channel", range=(0.0, 1.0), starts=(2e-3, 0.03, 0.2))

    def read(self, signal: jax.Array, time: jax.Array) -> jax.Array:
        return delayed(signal, time, self.tau)
