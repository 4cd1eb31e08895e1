"""The log-density at many points at once, and how it changes from point to point.

Every function here goes through the model in forward direction only, in batches of one size: where a motion is
integrated a program takes long to compile, its derivatives several times as long, and one program serves everything.
Slopes are central differences in whitened coordinates, where one step suits all.
"""

from collections.abc import Callable
from typing import Any, NamedTuple, Protocol

import jax
import numpy as np
from scipy.optimize import minimize

from fitting.posterior.settings import DENSITY
from fitting.posterior.target import Parts, Target
from fitting.threads import at_once


class Density(Protocol):
    """A log-density over points, with what it is made of."""

    def parts(self, point: jax.Array, /) -> Parts:
        """Its parts at a point."""
        ...


def compiled(function: Callable[[Any, jax.Array], Any]) -> Callable[..., Any]:
    """A function of the target and many points, compiled once for targets of one structure."""

    def many(structure: Any, leaves: list[jax.Array], z: jax.Array) -> Any:
        target = jax.tree.unflatten(structure, leaves)
        return jax.vmap(lambda at: function(target, at))(z)

    return jax.jit(many, static_argnums=0)


_log_probs = compiled(lambda target, z: target.log_prob(z))
_parts = compiled(lambda target, z: target.parts(z))


def log_probs(target: Target, batch: int) -> Callable[[np.ndarray], np.ndarray]:
    """Log-densities of many points, always `batch` of them in one compiled call (where something moves: 16)."""
    leaves, structure = jax.tree.flatten(target)  # once: for small data it costs as much as the rows
    if target.moves:
        return lambda points: value_of(_all_of(_parts, structure, leaves, points))
    one = lambda part: np.asarray(_log_probs(structure, leaves, part))  # noqa: E731
    return lambda points: np.concatenate([one(part) for part in _batches(points, batch)])[: len(points)]


def value_of(parts: Parts) -> np.ndarray:
    """The log-density (points,)."""
    found = parts.terms.sum(axis=1) + parts.instruments + parts.prior
    return np.where(np.isfinite(found), found, -np.inf)


def parts_at(target: Density, z: np.ndarray) -> Parts:
    """The parts of the log-density at points z (points, coordinates)."""
    return in_batches(_parts, target, z)


def in_batches(function: Callable[..., Any], target: Density, z: np.ndarray) -> Any:
    """What a compiled function makes of points z (points, coordinates), on the host."""
    leaves, structure = jax.tree.flatten(target)
    return _all_of(function, structure, leaves, z)


def _all_of(function: Callable[..., Any], structure: Any, leaves: list[jax.Array], z: np.ndarray) -> Any:
    one = lambda part: jax.tree.map(np.asarray, function(structure, leaves, part))  # noqa: E731
    found = at_once(DENSITY.workers, one, _batches(z, DENSITY.batch))
    return jax.tree.map(lambda *parts: np.concatenate(parts)[: len(z)], *found)


def _batches(points: np.ndarray, size: int) -> list[np.ndarray]:
    padded = np.concatenate([points, np.repeat(points[-1:], -len(points) % size, axis=0)])
    return np.split(padded, len(padded) // size)


# Slopes ---------------------------------------------------------------------------------------------------------------


class Slopes(NamedTuple):
    """The log-density at a point z and how it changes: that of the rows one by one, the other parts apart."""

    value: float
    terms: np.ndarray  # (coordinates, rows)
    instruments: np.ndarray  # (coordinates,)
    prior: np.ndarray  # (coordinates,)

    @property
    def all(self) -> np.ndarray:
        """The gradient."""
        return self.terms.sum(axis=1) + self.instruments + self.prior


def slopes_at(target: Density, z: np.ndarray, step: float = DENSITY.step) -> Slopes:
    """The log-density at one point, and how it changes: central differences of this step."""
    count, nudges = len(z), step * np.eye(len(z))
    found = parts_at(target, np.concatenate([z[None], z + nudges, z - nudges]))
    up, down = slice(1, count + 1), slice(count + 1, None)
    each = (found.terms, found.instruments, found.prior)
    return Slopes(float(value_of(found)[0]), *((part[up] - part[down]) / (2 * step) for part in each))


def _curvature(value: Callable[[np.ndarray], np.ndarray], z: np.ndarray) -> np.ndarray:
    """How sharply a function of points (points, coordinates) bends down at z, from its values around there.

    Along e_i + e_j it bends by H_ii + 2 H_ij + H_jj: n^2 + n + 1 values, a quarter of what differences of slopes take.
    """
    count, nudges = len(z), DENSITY.bend * np.eye(len(z))
    i, j = np.triu_indices(count, 1)
    ways = np.concatenate([nudges, nudges[i] + nudges[j]])
    found = value(np.concatenate([z[None], z + ways, z - ways]))
    up, down = np.split(found[1:], 2)
    with np.errstate(invalid="ignore"):  # where the density is zero
        bends = (2 * found[0] - up - down) / DENSITY.bend**2
    curvature = np.diag(bends[:count])
    curvature[i, j] = curvature[j, i] = 0.5 * (bends[count:] - bends[i] - bends[j])
    return np.where(np.isfinite(curvature), curvature, 0.0)


def prior_curvature(target: Density, z: np.ndarray) -> np.ndarray:
    """How sharply the prior alone bends in z, without directions in which it opens."""
    strength, along = np.linalg.eigh(_curvature(lambda at: parts_at(target, at).prior, z))
    return along @ np.diag(np.maximum(strength, 0)) @ along.T


def at_mode(target: Target) -> tuple[np.ndarray, np.ndarray]:
    """Centre and axes in which the density has its mode at the origin and unit curvature there."""
    size = len(target.centre)

    def down(z: np.ndarray) -> tuple[float, np.ndarray]:
        found = slopes_at(target, z)
        fine = np.isfinite(found.value) and np.all(np.isfinite(found.all))
        return (-found.value, -found.all) if fine else (1e300, np.zeros(size))

    z = minimize(down, np.zeros(size), jac=True, method="BFGS", options={"maxiter": DENSITY.walk, "gtol": 1e-2}).x
    strength, along = np.linalg.eigh(_curvature(lambda at: value_of(parts_at(target, at)), z))
    strength = np.maximum(strength, DENSITY.weakest)
    axes = np.asarray(target.axes)
    return np.asarray(target.centre) + axes @ z, axes @ (along / np.sqrt(strength))
