"""Which unknowns of a problem vary in a fit, and their places in the unit box in which a search goes."""

from collections.abc import Sequence
from types import ModuleType
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from fitting.problem.unknowns import Unknowns

Array = Any  # of numpy on the host, of jax inside a compiled function


class Subset(eqx.Module):
    """One fit among many that share a compiled function: which effects are there, which numbers are free.

    Where `turned` is not 0, that many switches stand behind the unknowns in `full` and may be free like them: the
    slopes along them are the signatures of missing effects.

    `varying`, if given, is how many of `free` vary, at least 1; those behind only fill a standard size. Then `beside`
    (free, effects) says what else is evaluated for the slope along each of them.

    Numpy's arrays until a compiled function takes them: jax's small operations, one by one, were a tenth of a
    diagnosis.
    """

    full: Array  # every unknown
    free: Array  # positions of those that vary
    switches: Array
    live: Array
    lower: Array  # of every unknown
    upper: Array
    logarithmic: Array
    turned: int = eqx.field(static=True, default=0)
    varying: Array | None = None
    beside: Array | None = None

    def vector(self, place: Array) -> Array:
        """All unknowns, from the free ones' places in the unit box."""
        xp = _numpy_of(place, self.full)
        lower, upper, log = self.lower[self.free], self.upper[self.free], self.logarithmic[self.free]
        low, high = xp.where(log, lower, 1.0), xp.where(log, upper, 1.0)
        straight = lower + place * (upper - lower)
        return _with(self.full, self.free, xp.where(log, low * (high / low) ** place, straight), xp)

    def point(self, place: Array) -> tuple[Array, Array]:
        """All unknowns, and all switches."""
        whole = self.vector(place)
        return (whole[: -self.turned], whole[-self.turned :]) if self.turned else (whole, self.switches)

    def place(self, vector: Array) -> Array:
        """The inverse of `vector`."""
        xp = _numpy_of(vector, self.full)
        x, lower, upper = vector[self.free], self.lower[self.free], self.upper[self.free]
        log = self.logarithmic[self.free]
        low, high, at = xp.where(log, lower, 1.0), xp.where(log, upper, 2.0), xp.where(log, x, 1.0)
        straight = (x - lower) / (upper - lower)
        return xp.clip(xp.where(log, xp.log(at / low) / xp.log(high / low), straight), 0.0, 1.0)

    def slope(self, place: Array) -> Array:
        """d(free unknowns)/d(place)."""
        xp = _numpy_of(place, self.full)
        lower, upper, log = self.lower[self.free], self.upper[self.free], self.logarithmic[self.free]
        low, high = xp.where(log, lower, 1.0), xp.where(log, upper, 2.0)
        return xp.where(log, low * (high / low) ** place * xp.log(high / low), upper - lower)


def _numpy_of(*arrays: Array) -> ModuleType:
    """Numpy for arrays on the host, where nothing has to be compiled; else jax's."""
    return np if all(isinstance(array, np.ndarray) for array in arrays) else jnp


def _with(whole: Array, at: Array, values: Array, xp: ModuleType) -> Array:
    """An array with other values at these positions."""
    if xp is jnp:
        return jnp.asarray(whole).at[at].set(values)
    changed = whole.copy()
    changed[at] = values
    return changed


def subset_of(layout: Unknowns, vector: np.ndarray, free: Sequence[str], switches=None, live=None) -> Subset:
    """The subset in which just these names vary, around a vector of all unknowns."""
    count = len(layout.templates[0].effects)
    return Subset(
        np.asarray(vector),
        np.asarray(layout.at(free), int),
        np.ones(count) if switches is None else np.asarray(switches, float),
        np.ones(count, bool) if live is None else np.asarray(live, bool),
        np.asarray(layout.lower),
        np.asarray(layout.upper),
        np.asarray(layout.logarithmic),
    )
