"""What the instrument makes of the force."""

import jax

from mckibben_jax.effect import Read
from mckibben_jax.parameter import parameter


class ForceOffset(Read):
    """The load cell does not read zero: F + F_off."""

    source = "instrument"
    suspect = "even misfit that is the same everywhere"
    F_off: jax.Array = parameter(2.0, "N", "reading at zero force", range=(-500.0, 500.0), starts=(0.0,))

    def read(self, signal: jax.Array, time: jax.Array) -> jax.Array:
        return signal + self.F_off
