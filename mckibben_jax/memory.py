"""Effects that remember: a start and one exact or stable step, used alike along data and inside an ODE."""

from typing import Any

import jax
import jax.numpy as jnp

from mckibben_jax.muscle import Muscle
from mckibben_jax.state import State

UNROLL = 2  # steps of a run that are compiled as one; one takes half as long again to run, four 2 s longer to compile


class Memory:
    """Mix this into an effect that remembers. Its stage's method finds the memory in `state.memory`."""

    def start(self, muscle: Muscle, state: State) -> Any:
        """The memory at the first sample of a run."""
        raise NotImplementedError

    def advance(self, muscle: Muscle, memory: Any, before: State, after: State) -> Any:
        """The memory after moving from one felt state to the next."""
        raise NotImplementedError


def remember(effect: Any, muscle: Muscle, states: State) -> Any:
    """The memory of an effect at every sample (leading axis: time) of a run, or of runs one behind another.

    A new run begins where the time goes back, and with it a new memory.
    """
    before, after = (jax.tree.map(lambda a, part=part: a[part], states) for part in (slice(None, -1), slice(1, None)))
    begins = after.time < before.time
    # no step of an effect goes back in time
    before = jax.vmap(_chosen)(begins, after.replace(time=after.time - 1.0), before)
    start = jax.vmap(lambda state: effect.start(muscle, state))(states)

    def step(memory: Any, along: tuple[jax.Array, Any, State, State]) -> tuple[Any, Any]:
        new, begun, before, after = along
        memory = _chosen(new, begun, effect.advance(muscle, _chosen(new, begun, memory), before, after))
        return memory, memory

    first, starts = jax.tree.map(lambda a: a[0], start), jax.tree.map(lambda a: a[1:], start)
    _, later = jax.lax.scan(step, first, (begins, starts, before, after), unroll=UNROLL)
    return jax.tree.map(lambda a, b: jnp.concatenate([a[None], b]), first, later)


def _chosen(condition: jax.Array, yes: Any, no: Any) -> Any:
    return jax.tree.map(lambda a, b: jnp.where(condition, a, b), yes, no)


def delayed(signal: jax.Array, time: jax.Array, delay: jax.Array) -> jax.Array:
    """A signal shown later by `delay` (s): straight between samples, before those of a run its first.

    A new run begins where the time goes back.
    """
    back = jnp.minimum(jnp.diff(time, prepend=time[:1]), 0.0)
    clock = time + jnp.cumsum((back < 0) - back)  # a second passes between two runs
    begin = jax.lax.cummax(jnp.where(back < 0, clock, clock[0]))
    return jnp.interp(jnp.maximum(clock - delay, begin), clock, signal)


def follow(memory: jax.Array, before: jax.Array, after: jax.Array, steps: jax.Array) -> jax.Array:
    """One step of tau dy/dt = x - y, exact while x moves in a straight line; `steps` = dt/tau."""
    small = steps < 1e-4
    safe = jnp.where(small, 1.0, steps)
    decay = -jnp.expm1(-steps)
    share = jnp.where(small, 1 - steps / 2 + steps**2 / 6, -jnp.expm1(-safe) / safe)
    return memory + decay * (before - memory) + (after - before) * (1 - share)
