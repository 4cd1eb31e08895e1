"""A muscle one step at a time, as a simulator or a controller calls it: what it remembers is carried along.

Friction that has nowhere to go keeps its direction: a muscle that moved and then stands is held as it was moved.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp

from mckibben_jax.laws.shape import path_rate
from mckibben_jax.model import Memories, Model
from mckibben_jax.state import State

STRIDE = 0.01  # of the length: how far a muscle comes from at each turn of `settled`
LONG = 1e6  # s: a stride takes so long that nothing depends on speed
MOST_STRIDES = 2000
CHANGED = 1e-12  # of what is remembered


class Carried(NamedTuple):
    """What one step leaves to the next: the rig's last state, the direction of friction (-1, 0, 1) and the memories."""

    rig: State
    direction: jax.Array
    memories: Memories


def begin(model: Model, contraction: jax.Array, pressure: jax.Array) -> Carried:
    """A muscle that has stood at this contraction and pressure (Pa) for long, without friction."""
    rig = State(contraction, pressure)
    return Carried(rig, jnp.zeros_like(rig.contraction), model.start_memories(rig))


def step(
    model: Model, carried: Carried, pressure: jax.Array, displacement: jax.Array, dt: jax.Array
) -> tuple[Carried, jax.Array]:
    """After `dt` seconds, in which pressure (Pa) and shortening (m) went straight to these: what is carried, and force.

    The rates are those of the step. The force, N, is what the instrument shows.
    """
    after, memories = _advanced(model, carried, pressure, displacement, dt)
    direction = _direction(model, carried, after, memories)
    return Carried(after, direction, memories), _force(model, after, memories, direction)


def step_parts(
    model: Model, carried: Carried, pressure: jax.Array, displacement: jax.Array, dt: jax.Array
) -> tuple[Carried, jax.Array, jax.Array]:
    """As `step`, with the force in two: the pull without dry friction, and how much dry friction can resist, both N.

    A simulator that knows sticking takes the second as a budget. The force is pull - direction * friction. Friction
    whose direction is remembered (presliding) is a force of its own and stays in the pull.
    """
    after, memories = _advanced(model, carried, pressure, displacement, dt)
    shortening, lengthening = (_force(model, after, memories, jnp.asarray(way)) for way in (1.0, -1.0))
    carried = Carried(after, _direction(model, carried, after, memories), memories)
    return carried, (shortening + lengthening) / 2, (lengthening - shortening) / 2


def _advanced(
    model: Model, carried: Carried, pressure: jax.Array, displacement: jax.Array, dt: jax.Array
) -> tuple[State, Memories]:
    before, contraction = carried.rig, displacement / model.muscle.length
    rates = (contraction - before.contraction) / dt, (pressure - before.pressure) / dt
    after = State(contraction, pressure, *rates, time=before.time + dt)
    return after, model.advance_memories(carried.memories, before, after)


def _direction(model: Model, carried: Carried, after: State, memories: Memories) -> jax.Array:
    moves = path_rate(model.muscle, model.felt_now(after, memories))
    return jnp.where(moves == 0, carried.direction, jnp.sign(moves))


def slow_force(
    model: Model, contraction: jax.Array, pressure: jax.Array, direction: jax.Array, rate: jax.Array
) -> jax.Array:
    """Force, N, of a muscle that has long been on its way slowly in a direction (1 contracting, -1, 0 at rest).

    What it remembers has settled on that way; rubber was never stretched further. `rate` (1/s) is for the effects that
    depend on speed.
    """
    state = State(contraction, pressure, rate)
    return _force(model, state, settled(model, state, direction), direction)


def settled(model: Model, state: State, direction: jax.Array) -> Memories:
    """What is remembered where a muscle has long moved in this direction, at the place where it is now."""
    now = state.replace(rate=jnp.zeros_like(state.rate), time=jnp.asarray(LONG))
    before = now.replace(contraction=now.contraction - STRIDE * direction, time=jnp.zeros(()))
    fresh = model.start_memories(now)
    if not jax.tree.leaves(fresh):
        return fresh

    def goes_on(carry: tuple[jax.Array, jax.Array, Memories]) -> jax.Array:
        return (carry[0] < MOST_STRIDES) & (carry[1] > CHANGED)

    def stride(carry: tuple[jax.Array, jax.Array, Memories]) -> tuple[jax.Array, jax.Array, Memories]:
        count, _, memories = carry
        moved = model.advance_memories(memories, before, now)
        return count + 1, _change(*jax.lax.stop_gradient((memories, moved))), moved

    return jax.lax.while_loop(goes_on, stride, (jnp.zeros(()), jnp.ones(()), fresh))[2]


def _change(before: Memories, after: Memories) -> jax.Array:
    """The largest change of anything remembered, as a share of itself."""
    change = jax.tree.map(lambda a, b: jnp.max(jnp.abs(b - a) / (jnp.abs(a) + jnp.abs(b) + 1e-300)), before, after)
    return jnp.max(jnp.stack(jax.tree.leaves(change)))


def _force(model: Model, state: State, memories: Memories, direction: jax.Array) -> jax.Array:
    felt = model.felt_now(state, memories)
    total, elastic = model.pull(felt, memories)
    force = total - model.lost_now(felt, elastic, memories, direction).force
    return model.show(force[None], state.time[None], "force")[0]


def linearised(
    model: Model, contraction: jax.Array, pressure: jax.Array, direction: jax.Array, rate: jax.Array
) -> tuple[jax.Array, jax.Array, jax.Array, jax.Array]:
    """Force (N) and its slopes over shortening (N/m), pressure (N/Pa) and speed of shortening (N s/m)."""
    length = model.muscle.length

    def force(displacement: jax.Array, pressure: jax.Array, speed: jax.Array) -> jax.Array:
        return slow_force(model, displacement / length, pressure, direction, speed / length)

    at = (contraction * length, pressure, rate * length)
    along = lambda *way: jax.jvp(force, at, way)  # noqa: E731
    value, slopes = jax.vmap(along, out_axes=(None, 0))(*jnp.eye(3))
    return value, slopes[0], slopes[1], slopes[2]
