"""Which unknowns of a problem vary in a fit, and their places in the unit box in which a search goes."""

from collections.abc import Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fitting.problem.unknowns import Unknowns


class Subset(eqx.Module):
    """One fit among many that share a compiled function: which effects are there, which numbers are free.

    Where `turned` is not 0, that many switches stand behind the unknowns in `full` and may be free like them: the
    slopes along them are the signatures of missing effects.

    `varying`, if given, is how many of `free` vary, at least 1; those behind only fill a standard size. Then `beside`
    (free, effects) says what else is evaluated for the slope along each of them.
    """

    full: jax.Array  # every unknown
    free: jax.Array  # positions of those that vary
    switches: jax.Array
    live: jax.Array
    lower: jax.Array  # of every unknown
    upper: jax.Array
    logarithmic: jax.Array
    turned: int = eqx.field(static=True, default=0)
    varying: jax.Array | None = None
    beside: jax.Array | None = None

    def vector(self, place: jax.Array) -> jax.Array:
        """All unknowns, from the free ones' places in the unit box."""
        lower, upper, log = self.lower[self.free], self.upper[self.free], self.logarithmic[self.free]
        low, high = jnp.where(log, lower, 1.0), jnp.where(log, upper, 1.0)
        straight = lower + place * (upper - lower)
        return self.full.at[self.free].set(jnp.where(log, low * (high / low) ** place, straight))

    def point(self, place: jax.Array) -> tuple[jax.Array, jax.Array]:
        """All unknowns, and all switches."""
        whole = self.vector(place)
        return (whole[: -self.turned], whole[-self.turned :]) if self.turned else (whole, self.switches)

    def place(self, vector: jax.Array) -> jax.Array:
        """The inverse of `vector`."""
        x, lower, upper = vector[self.free], self.lower[self.free], self.upper[self.free]
        log = self.logarithmic[self.free]
        low, high, at = jnp.where(log, lower, 1.0), jnp.where(log, upper, 2.0), jnp.where(log, x, 1.0)
        straight = (x - lower) / (upper - lower)
        return jnp.clip(jnp.where(log, jnp.log(at / low) / jnp.log(high / low), straight), 0.0, 1.0)

    def slope(self, place: jax.Array) -> jax.Array:
        """d(free unknowns)/d(place)."""
        return jax.jvp(self.vector, (place,), (jnp.ones_like(place),))[1][self.free]


def subset_of(layout: Unknowns, vector: np.ndarray, free: Sequence[str], switches=None, live=None) -> Subset:
    """The subset in which just these names vary, around a vector of all unknowns."""
    count = len(layout.templates[0].effects)
    return Subset(
        jnp.asarray(vector),
        jnp.asarray(layout.at(free), int),
        jnp.ones(count) if switches is None else jnp.asarray(switches, float),
        jnp.ones(count, bool) if live is None else jnp.asarray(live, bool),
        jnp.asarray(layout.lower),
        jnp.asarray(layout.upper),
        jnp.asarray(layout.logarithmic),
    )
