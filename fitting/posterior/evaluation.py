"""The log-density at many points at once, and how it changes from point to point.

Every function here goes through the model in forward direction only, in batches of one size: where a motion is
integrated a program takes long to compile, its derivatives several times as long, and one program serves everything.
Slopes are central differences in whitened coordinates, where one step suits all.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import numpy as np
from scipy.optimize import minimize

from fitting.posterior.settings import DENSITY
from fitting.posterior.target import Target


class Parts(NamedTuple):
    """The log-density at some points (leading axis) in its parts, and the rows of the measurements."""

    terms: np.ndarray  # log-likelihood (points, rows)
    prior: np.ndarray  # in z
    rows: np.ndarray  # (points, rows)

    @property
    def value(self) -> np.ndarray:
        """The log-density."""
        found = self.terms.sum(axis=1) + self.prior
        return np.where(np.isfinite(found), found, -np.inf)


def _compiled(function: Callable[[Target, jax.Array], Any]) -> Callable[..., Any]:
    """A function of the target and many points, compiled once for targets of one structure."""

    def many(structure: Any, leaves: list[jax.Array], z: jax.Array) -> Any:
        target = jax.tree.unflatten(structure, leaves)
        return jax.vmap(lambda at: function(target, at))(z)

    return jax.jit(many, static_argnums=0)


_log_probs = _compiled(Target.log_prob)
_parts = _compiled(Target.parts)


def log_probs(target: Target, batch: int) -> Callable[[np.ndarray], np.ndarray]:
    """Log-densities of many points, always `batch` of them in one compiled call (where something moves: 16)."""
    leaves, structure = jax.tree.flatten(target)  # once: for small data it costs as much as the rows
    if target.moves:
        return lambda points: _parts_of(structure, leaves, points).value
    one = lambda part: np.asarray(_log_probs(structure, leaves, part))  # noqa: E731
    return lambda points: np.concatenate([one(part) for part in _batches(points, batch)])[: len(points)]


def parts_at(target: Target, z: np.ndarray) -> Parts:
    """The parts of the log-density at points z (points, coordinates)."""
    leaves, structure = jax.tree.flatten(target)
    return _parts_of(structure, leaves, z)


def _parts_of(structure: Any, leaves: list[jax.Array], z: np.ndarray) -> Parts:
    found = [jax.tree.map(np.asarray, _parts(structure, leaves, part)) for part in _batches(z, DENSITY.batch)]
    return Parts(*(np.concatenate(part)[: len(z)] for part in zip(*found, strict=True)))


def _batches(points: np.ndarray, size: int) -> list[np.ndarray]:
    padded = np.concatenate([points, np.repeat(points[-1:], -len(points) % size, axis=0)])
    return np.split(padded, len(padded) // size)


# Slopes ---------------------------------------------------------------------------------------------------------------


class Slopes(NamedTuple):
    """The log-density at a point z and how it changes: that of the rows one by one, that of the prior apart."""

    value: float
    terms: np.ndarray  # (coordinates, rows)
    prior: np.ndarray  # (coordinates,)

    @property
    def all(self) -> np.ndarray:
        """The gradient."""
        return self.terms.sum(axis=1) + self.prior


def slopes_at(target: Target, z: np.ndarray) -> Slopes:
    """The log-density at one point, and how it changes."""
    count, nudges = len(z), DENSITY.step * np.eye(len(z))
    found = parts_at(target, np.concatenate([z[None], z + nudges, z - nudges]))
    up, down = slice(1, count + 1), slice(count + 1, None)
    terms, prior = ((part[up] - part[down]) / (2 * DENSITY.step) for part in (found.terms, found.prior))
    return Slopes(float(found.value[0]), terms, prior)


def _curvature(slope: Callable[[np.ndarray], np.ndarray], z: np.ndarray) -> np.ndarray:
    """How sharply a function bends down, from its slopes around z."""
    nudges = DENSITY.bend * np.eye(len(z))
    found = np.stack([slope(z + nudge) - slope(z - nudge) for nudge in nudges]) / (-2 * DENSITY.bend)
    return np.nan_to_num(0.5 * (found + found.T))


def prior_curvature(target: Target, z: np.ndarray) -> np.ndarray:
    """How sharply the prior alone bends in z, without directions in which it opens."""
    strength, along = np.linalg.eigh(_curvature(lambda at: slopes_at(target, at).prior, z))
    return along @ np.diag(np.maximum(strength, 0)) @ along.T


def at_mode(target: Target) -> tuple[np.ndarray, np.ndarray]:
    """Centre and axes in which the density has its mode at the origin and unit curvature there."""
    size = len(target.centre)

    def down(z: np.ndarray) -> tuple[float, np.ndarray]:
        found = slopes_at(target, z)
        fine = np.isfinite(found.value) and np.all(np.isfinite(found.all))
        return (-found.value, -found.all) if fine else (1e300, np.zeros(size))

    z = minimize(down, np.zeros(size), jac=True, method="BFGS", options={"maxiter": DENSITY.walk, "gtol": 1e-2}).x
    strength, along = np.linalg.eigh(_curvature(lambda at: slopes_at(target, at).all, z))
    strength = np.maximum(strength, DENSITY.weakest)
    axes = np.asarray(target.axes)
    return np.asarray(target.centre) + axes @ z, axes @ (along / np.sqrt(strength))
