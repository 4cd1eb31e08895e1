"""The stroke at constant pressure: the pull along it, what friction takes, where it ends, and integrals over it.

One contraction at a time inside loops, so that a batch of designs needs no more memory than a few numbers for each, and
what does not depend on the contraction (trigonometry, mostly) is computed once.
"""

from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np

from mckibben_jax.laws import braid
from mckibben_jax.memory import Memory
from mckibben_jax.model import Model
from mckibben_jax.state import State

Law = Callable[[jax.Array], jax.Array]  # of the contraction

_LARGEST, _POINTS = 0.9, 31  # where, and how finely, the end of the stroke is looked for
_STEPS, _CLOSE = 60, 1e-10  # of the search for a zero: a last step that is so small leaves an error of its square
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(24)


# Forces along it -----------------------------------------------------------------------------------------------------


def _state(contraction: jax.Array, pressure: jax.Array) -> State:
    contraction = jnp.asarray(contraction, dtype=float)
    zero = jnp.zeros_like(contraction)
    return State(contraction, zero + pressure, zero, zero, zero, zero, zero)


def pull(given: Model, contraction: jax.Array, pressure: jax.Array) -> jax.Array:
    """Frictionless force (N) of the muscle at rest in this state."""
    state = _state(contraction, pressure)
    return given.pull(given.felt_now(state, given.start_memories(state)))[0]


def friction(given: Model, contraction: jax.Array, pressure: jax.Array, direction: float) -> jax.Array:
    """Force (N) lost to slow sliding, positive while contracting (`direction` +1), else negative (-1).

    Without what remembers (presliding, creep, Mullins): sliding has gone on for long, and slowly.
    """
    slow = given.drop(*(n for n, e in zip(given.names, given.effects, strict=True) if isinstance(e, Memory)))
    nothing = (None,) * len(slow.effects)
    felt = slow.felt_now(_state(contraction, pressure), nothing)
    elastic = slow.pull(felt)[1]
    return slow.lost_now(felt, elastic, nothing, jnp.zeros_like(elastic) + direction).force


# Its end -------------------------------------------------------------------------------------------------------------


def free_contraction(law: Law) -> jax.Array:
    """Contraction at which a pull first vanishes, with the derivative of an implicit function.

    Where it does not pull at rest, the (negative) contraction at which it would, by the slope at rest: a search for
    designs is led back from there. Beyond 0.9 is not looked.
    """
    low, high, above, below = jax.lax.stop_gradient(_bracket(law))
    crossed = (above > 0) & (below <= 0)
    high = jnp.where(crossed, high, low)  # nothing to be sought: one lane that seeks keeps a whole batch waiting
    share = above / jnp.where(crossed, above - below, 1.0)
    root = jax.lax.custom_root(
        law, low + (high - low) * share, lambda f, start: _newton(f, start, low, high), lambda g, y: y / g(1.0)
    )
    at_rest = law(jnp.asarray(0.0))
    return jnp.where(at_rest > 0, root, -at_rest / braid.slope(law, 0.0))


def _bracket(law: Law) -> tuple[jax.Array, ...]:
    """The first two neighbouring places between which a law falls through zero (else the last), and its values."""
    apart = _LARGEST / (_POINTS - 1)

    def look(i: int, known: tuple[jax.Array, ...]) -> tuple[jax.Array, ...]:
        _, high, _, below = known
        place = apart * jnp.asarray(i, dtype=float)
        further = (high, place, below, law(place))
        return tuple(jnp.where(below > 0, new, old) for new, old in zip(further, known, strict=True))

    rest, first = jnp.asarray(0.0), jnp.asarray(apart)
    return jax.lax.fori_loop(2, _POINTS, look, (rest, first, law(rest), law(first)))


def _newton(law: Law, start: jax.Array, low: jax.Array, high: jax.Array) -> jax.Array:
    """Newton's method for a zero between places, above zero at `low`; where it leaves them, it halves them."""

    def going(known: tuple) -> jax.Array:
        step, moved = known[0], known[-1]
        return (step < _STEPS) & (moved > _CLOSE)

    def search(known: tuple) -> tuple:
        step, x, low, high, _ = known
        value, slope = jax.jvp(law, (x,), (jnp.ones_like(x),))
        low, high = jnp.where(value > 0, x, low), jnp.where(value > 0, high, x)
        new = x - value / slope
        new = jnp.where((new >= low) & (new <= high), new, (low + high) / 2)
        return step + 1, new, low, high, jnp.abs(new - x)

    return jax.lax.while_loop(going, search, (0, start, low, high, jnp.ones_like(start)))[1]


# Over it -------------------------------------------------------------------------------------------------------------


def integral(law: Law, end: jax.Array) -> jax.Array:
    """Integral of a law from rest to a contraction `end`: 24-point Gauss-Legendre quadrature."""
    half = end / 2

    def add(total: jax.Array, at: tuple[jax.Array, jax.Array]) -> tuple[jax.Array, None]:
        node, weight = at
        return total + weight * law(half * (1 + node)), None

    nodes = (jnp.asarray(_NODES, dtype=float), jnp.asarray(_WEIGHTS, dtype=float))
    return half * jax.lax.scan(add, jnp.zeros_like(half), nodes)[0]
