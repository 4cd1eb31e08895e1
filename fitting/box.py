"""A Levenberg-Marquardt step that respects a box, as a descent of optimistix's own kind.

Optimistix has no bounds. A transform of the range (sine, sigmoid) has no slope at its ends, and the parameters of an
absent effect live exactly there: friction 0, damping 0. Solving for the step inside the box has no such trouble.
"""

from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import optimistix as optx

PASSES = 4  # times that violators are pinned to the box and the rest solved again
FLOOR = 1e-12  # of the largest curvature: damping of what the data cannot see


class _Bowl(eqx.Module):
    point: jax.Array
    curvature: jax.Array
    slope: jax.Array


class BoxDescent(optx.AbstractDescent):
    """The damped Gauss-Newton step within `lower` and `upper`: violators are pinned, the rest solved again."""

    lower: jax.Array
    upper: jax.Array

    def init(self, y: jax.Array, f_info_struct: Any) -> _Bowl:
        """A state of the right shapes."""
        return _Bowl(y, jnp.zeros((y.size, y.size)), jnp.zeros(y.size))

    def query(self, y: jax.Array, f_info: Any, state: _Bowl) -> _Bowl:
        """Curvature and slope at a newly accepted point."""
        jacobian = f_info.jac.as_matrix()
        return _Bowl(y, jacobian.T @ jacobian, jacobian.T @ f_info.residual)

    def step(self, step_size: jax.Array, state: _Bowl) -> tuple[jax.Array, optx.RESULTS]:
        """The step for a damping of 1/step_size relative to the curvature's diagonal."""
        low, high = self.lower - state.point, self.upper - state.point
        diagonal = jnp.diagonal(state.curvature)
        damping = diagonal / jnp.maximum(step_size, 1e-30) + FLOOR * jnp.max(diagonal) + 1e-300
        damped = state.curvature + jnp.diag(damping)
        scale = 1 / jnp.sqrt(jnp.diagonal(damped))
        pinned = ((low >= 0) & (state.slope > 0)) | ((high <= 0) & (state.slope < 0))
        at = jnp.zeros_like(state.slope)
        for _ in range(PASSES):
            at = _solve(damped, state.slope, scale, pinned, at)
            pinned = pinned | (at < low) | (at > high)
            at = jnp.clip(at, low, high)
        return at, optx.RESULTS.successful


def _solve(damped: jax.Array, slope: jax.Array, scale: jax.Array, pinned: jax.Array, at: jax.Array) -> jax.Array:
    """The damped step of the free entries while the pinned ones stay where they are."""
    free = 1.0 - pinned
    matrix = damped * (scale[:, None] * scale[None, :]) * (free[:, None] * free[None, :]) + jnp.diag(1 - free)
    right = -(slope + damped @ (at * pinned)) * scale * free
    factor = jax.scipy.linalg.cho_factor(matrix + 1e-14 * jnp.eye(len(slope)))
    return jnp.where(pinned, at, jax.scipy.linalg.cho_solve(factor, right) * scale)


class BoxLevenbergMarquardt(optx.AbstractGaussNewton):
    """Levenberg-Marquardt within a box. Tolerances are on the unit box and on residuals in standard deviations."""

    rtol: float
    atol: float
    norm: Callable[[Any], jax.Array]
    descent: BoxDescent
    search: optx.ClassicalTrustRegion
    verbose: Callable[..., None]

    def __init__(self, lower: jax.Array, upper: jax.Array, rtol: float = 1e-6, atol: float = 1e-5):
        self.rtol, self.atol, self.norm = rtol, atol, optx.max_norm
        self.descent = BoxDescent(lower, upper)
        self.search = optx.ClassicalTrustRegion()
        self.verbose = lambda **_: None
