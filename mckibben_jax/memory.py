"""Effects that remember: a start and one exact or stable step, used alike along data and inside an ODE."""

from typing import Any

import jax
import jax.numpy as jnp

from mckibben_jax.muscle import Muscle
from mckibben_jax.state import State


class Memory:
    """Mix this into an effect that remembers. Its stage's method finds the memory in `state.memory`."""

    def start(self, muscle: Muscle, state: State) -> Any:
        """The memory at the first sample of a run."""
        raise NotImplementedError

    def advance(self, muscle: Muscle, memory: Any, before: State, after: State) -> Any:
        """The memory after moving from one felt state to the next."""
        raise NotImplementedError


def remember(effect: Any, muscle: Muscle, states: State) -> Any:
    """The memory of an effect at every sample of a run (leading axis: time)."""
    first = jax.tree.map(lambda a: a[0], states)
    initial = effect.start(muscle, first)

    def step(carry: tuple[State, Any], after: State) -> tuple[tuple[State, Any], Any]:
        before, memory = carry
        memory = effect.advance(muscle, memory, before, after)
        return (after, memory), memory

    rest = jax.tree.map(lambda a: a[1:], states)
    _, later = jax.lax.scan(step, (first, initial), rest, unroll=4)
    return jax.tree.map(lambda a, b: jnp.concatenate([a[None], b]), initial, later)


def follow(memory: jax.Array, before: jax.Array, after: jax.Array, steps: jax.Array) -> jax.Array:
    """One step of tau dy/dt = x - y, exact while x moves in a straight line; `steps` = dt/tau."""
    small = steps < 1e-4
    safe = jnp.where(small, 1.0, steps)
    decay = -jnp.expm1(-steps)
    share = jnp.where(small, 1 - steps / 2 + steps**2 / 6, -jnp.expm1(-safe) / safe)
    return memory + decay * (before - memory) + (after - before) * (1 - share)
