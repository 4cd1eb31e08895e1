"""The state of a muscle: what changes while the muscle stays the same."""

import dataclasses
from typing import Any, Self

import equinox as eqx
import jax

from mckibben_jax.parameter import as_scalar


class State(eqx.Module):
    """Where a muscle is at one instant, or along a run where every field carries a leading axis of samples.

    `contraction` is positive when shorter, `pressure` is gauge in Pa, `stretch` is the strain of the strands; their
    rates are time derivatives in 1/s and Pa/s. `memory` is what the effect that is being evaluated remembers.
    """

    contraction: jax.Array = eqx.field(converter=as_scalar)
    pressure: jax.Array = eqx.field(converter=as_scalar)
    rate: jax.Array = eqx.field(default=0.0, converter=as_scalar)
    pressure_rate: jax.Array = eqx.field(default=0.0, converter=as_scalar)
    stretch: jax.Array = eqx.field(default=0.0, converter=as_scalar)
    stretch_rate: jax.Array = eqx.field(default=0.0, converter=as_scalar)
    time: jax.Array = eqx.field(default=0.0, converter=as_scalar)
    memory: Any = None

    def replace(self, **changes: Any) -> Self:
        """A copy with these fields changed."""
        return dataclasses.replace(self, **changes)
