"""The state of a muscle: what changes while the muscle stays the same."""

import dataclasses
from typing import Any, Self

import equinox as eqx
import jax
import jax.numpy as jnp


class State(eqx.Module):
    """Where a muscle is at one instant, or along a run where every field carries a leading axis of samples.

    `contraction` is positive when shorter, `pressure` is gauge; the two rates are their time derivatives.
    `stretch` is the strain of the strands. `memory` is what the effect that is being evaluated remembers.
    """

    contraction: jax.Array
    pressure: jax.Array
    rate: jax.Array = eqx.field(default=0.0, converter=jnp.asarray)
    pressure_rate: jax.Array = eqx.field(default=0.0, converter=jnp.asarray)
    stretch: jax.Array = eqx.field(default=0.0, converter=jnp.asarray)
    time: jax.Array = eqx.field(default=0.0, converter=jnp.asarray)
    memory: Any = None

    def replace(self, **changes: Any) -> Self:
        """A copy with these fields changed."""
        return dataclasses.replace(self, **changes)
