"""Pressure swept under a hung load, so slowly that inertia is nothing: where the muscle stands at every sample.

The braid stays where it is while |pull - drag - load| <= size of friction, and slides to where the friction of its
direction leaves just the load. Nothing is integrated: each sample is one equation, and what is remembered is advanced
in it.
"""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import optimistix as optx

from mckibben_jax.laws.shape import path
from mckibben_jax.model import Memories, Model
from mckibben_jax.motion.motion import MOST_CONTRACTION
from mckibben_jax.state import State

MOST_STEPS = 30  # of Newton's method; a smooth law takes 3 to 5


class Standing(eqx.Module):
    """Where the muscle stands under its load (N): the rig's state, and what the effects remember."""

    state: State
    memories: Memories


def swept(model: Model, states: State, load: Any, start: Any) -> jax.Array:
    """Contraction at every sample of `states`, from `start` or the nearest place where friction holds the load.

    Only time and pressure are taken from `states`; `load` in N, one number or one per sample. Speeds are those from
    sample to sample. Repeated samples do no harm. A load that no length carries ends at straight strands.
    """
    load = jnp.broadcast_to(jnp.asarray(load, dtype=float), states.time.shape)
    states = model.supplied(states)
    first = _at(states, 0).replace(contraction=jnp.asarray(start, dtype=float), rate=jnp.zeros(()))
    begin = Standing(first, model.start_memories(first))

    def advance(standing: Standing, sample: tuple[State, jax.Array]) -> tuple[Standing, jax.Array]:
        standing = _follow(model, standing, *sample)
        return standing, standing.state.contraction

    return jax.lax.scan(advance, begin, (states, load))[1]


def standing(model: Model, pressure: Any, load: Any) -> jax.Array:
    """Contraction at which the pull without friction carries `load` (N) at `pressure` (Pa), memories fresh.

    Straight strands where the muscle cannot carry it.
    """
    pressure, load = (jnp.asarray(value, dtype=float) for value in (pressure, load))

    def surplus(contraction: jax.Array) -> jax.Array:
        state = State(contraction, pressure)
        memories = model.start_memories(state)
        return (model.pull(model.felt_now(state, memories), memories)[0] - load) / _scale(model, pressure, load)

    return root_near(surplus, jnp.zeros(()), *_ends(model))


def _scale(model: Model, pressure: jax.Array, load: jax.Array) -> jax.Array:
    """A force (N) of the size of those at play."""
    return jnp.abs(load) + jnp.pi * model.muscle.radius**2 * (jnp.abs(pressure) + 1.0)


def _ends(model: Model) -> tuple[jax.Array, jax.Array]:
    return 1 - 1 / jnp.cos(model.muscle.braid_angle), jnp.asarray(MOST_CONTRACTION)


def _follow(model: Model, before: Standing, now: State, load: jax.Array) -> Standing:
    """Where the muscle stands at the next sample."""
    duration = now.time - before.state.time
    duration = jnp.where(duration > 0, duration, jnp.inf)

    def state(contraction: jax.Array) -> State:
        return now.replace(contraction=contraction, rate=(contraction - before.state.contraction) / duration)

    def surplus(contraction: jax.Array, direction: jax.Array) -> jax.Array:
        """Force that is left to move the load, as a share of the load and the gas, were the braid to slide that way."""
        there = state(contraction)
        memories = model.advance_memories(before.memories, before.state, there)
        felt = model.felt_now(there, memories)
        total, elastic = model.pull(felt, memories)
        lost = model.lost_now(felt, elastic, memories, direction).force
        return (total - lost - load) / scale

    scale = _scale(model, now.pressure, load)
    held = _held(model, before, state)
    direction = _direction(surplus, held)

    def balance(contraction: jax.Array) -> jax.Array:
        return jnp.where(direction == 0, contraction - held, surplus(contraction, direction))

    there = state(root_near(balance, held, *_ends(model)))
    return Standing(there, model.advance_memories(before.memories, before.state, there))


def _direction(surplus: Any, held: jax.Array) -> jax.Array:
    """Where a resting braid goes: 1 or -1 where friction cannot hold it, else 0."""
    up, down = (surplus(held, jnp.asarray(sign)) for sign in (1.0, -1.0))
    return jax.lax.stop_gradient(jnp.where(up > 0, 1.0, jnp.where(down < 0, -1.0, 0.0)))


def _held(model: Model, before: Standing, state: Any) -> jax.Array:
    """The contraction at which the braid's own path stands still while the pressure moves on.

    That of before, but for fittings and strands that give way: these do so nearly in proportion, so that one step of
    Newton's method finds it.
    """

    def along(contraction: jax.Array) -> jax.Array:
        there = state(contraction)
        return path(model.muscle, model.felt_now(there, model.advance_memories(before.memories, before.state, there)))

    stood = path(model.muscle, model.felt_now(before.state, before.memories))
    here = before.state.contraction
    value, slope = jax.jvp(along, (here,), (jnp.ones_like(here),))
    return here - (value - stood) / slope


def root_near(equation: Any, guess: jax.Array, lower: jax.Array, upper: jax.Array) -> jax.Array:
    """The root of a scalar equation by optimistix, within bounds, with its exact derivatives.

    The search itself is not differentiated: one step of Newton's method from the root has the root's derivative.
    """
    plain, constants = jax.closure_convert(equation, guess)
    fixed = jax.lax.stop_gradient((guess, constants))
    ends = jax.lax.stop_gradient({"lower": lower, "upper": upper})
    solver = optx.Newton(rtol=1e-9, atol=1e-10)
    root = optx.root_find(
        lambda x, c: plain(x, *c), solver, fixed[0], args=fixed[1], options=ends, max_steps=MOST_STEPS, throw=False
    ).value
    root = jax.lax.stop_gradient(root)
    slope = jax.lax.stop_gradient(jax.jvp(lambda x: plain(x, *fixed[1]), (root,), (jnp.ones_like(root),))[1])
    return jnp.clip(root - equation(root) / slope, lower, upper)


def _at(states: State, index: int) -> State:
    return jax.tree.map(lambda a: a[index], states)
