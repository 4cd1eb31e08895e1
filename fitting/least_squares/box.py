"""A Levenberg-Marquardt step that respects a box, as a descent of optimistix's own kind.

Optimistix has no bounds. A transform of the range (sine, sigmoid) has no slope at its ends, and the parameters of an
absent effect live exactly there: friction 0, damping 0. Solving for the step inside the box has no such trouble.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import optimistix as optx


@dataclass(frozen=True)
class BoxSettings:
    """Settings of a step within the box. Where no source is named they were chosen."""

    passes: int = 4  # times that violators are pinned to the box and the rest solved again
    floor: float = 1e-12  # of the largest curvature: damping of what the data do not constrain
    own: float = 0.25  # power of an unknown's own curvature in its damping; measured, see `BoxDescent`
    first_step: float = 1e4  # step size to begin with, relative to the curvature; measured with `own`
    patience: int = 5  # steps in a row that each gain less than is enough, after which a search ends; chosen
    stuck: float = 1e-12  # step size below which no step lowers the sum of squares


SETTINGS = BoxSettings()


class _Bowl(eqx.Module):
    point: jax.Array
    curvature: jax.Array
    slope: jax.Array


class BoxDescent(optx.AbstractDescent):
    """The damped Gauss-Newton step within `lower` and `upper`: violators are pinned, the rest solved again.

    Each unknown is damped by the largest curvature to the power 3/4 times its own to the power 1/4. Its own alone
    (Marquardt 1963) lets an unknown that hardly matters here run away, and in narrow curved valleys every step then
    fails until it is tiny. The unit box is a scale already, as it was with Levenberg (1944), whose damping is the same
    for all. `tests/benchmarks/test_search_bench.py` compares them on a shipped muscle.
    """

    lower: jax.Array
    upper: jax.Array
    own: float = SETTINGS.own

    def init(self, y: jax.Array, f_info_struct: Any) -> _Bowl:
        """A state of the right shapes."""
        return _Bowl(y, jnp.zeros((y.size, y.size)), jnp.zeros(y.size))

    def query(self, y: jax.Array, f_info: Any, state: _Bowl) -> _Bowl:
        """Curvature and slope at a newly accepted point."""
        jacobian = f_info.jac.as_matrix()
        return _Bowl(y, jacobian.T @ jacobian, jacobian.T @ f_info.residual)

    def step(self, step_size: jax.Array, state: _Bowl) -> tuple[jax.Array, optx.RESULTS]:
        """The step for a damping of 1/step_size relative to the curvature."""
        own, largest = jnp.diagonal(state.curvature), jnp.max(jnp.diagonal(state.curvature))
        least = jnp.maximum(own, SETTINGS.floor * largest)
        scale = largest ** (1 - self.own) * least**self.own
        return self._damped(state, scale / jnp.maximum(step_size, 1e-30)), optx.RESULTS.successful

    def promise(self, step_size: jax.Array, state: _Bowl) -> jax.Array:
        """What a step promises to lower half the sum of squares by that is hardly damped, each unknown by itself."""
        move = self._damped(state, jnp.diagonal(state.curvature) / jnp.maximum(step_size, 1.0))
        return -(state.slope @ move + 0.5 * move @ (state.curvature @ move))

    def _damped(self, state: _Bowl, damping: jax.Array) -> jax.Array:
        """The step within the box where each unknown is damped by so much."""
        low, high = self.lower - state.point, self.upper - state.point
        floor = SETTINGS.floor * jnp.max(jnp.diagonal(state.curvature)) + 1e-300
        damped = state.curvature + jnp.diag(damping + floor)
        scale = 1 / jnp.sqrt(jnp.diagonal(damped))
        pinned = ((low >= 0) & (state.slope > 0)) | ((high <= 0) & (state.slope < 0))

        def one_pass(_: jax.Array, so_far: tuple[jax.Array, jax.Array]) -> tuple[jax.Array, jax.Array]:
            pinned, at = so_far
            at = _solve(damped, state.slope, scale, pinned, at)
            return pinned | (at < low) | (at > high), jnp.clip(at, low, high)

        # a loop: written out, the passes were a third of what a fit has to compile
        return jax.lax.fori_loop(0, SETTINGS.passes, one_pass, (pinned, jnp.zeros_like(state.slope)))[1]


def _solve(damped: jax.Array, slope: jax.Array, scale: jax.Array, pinned: jax.Array, at: jax.Array) -> jax.Array:
    """The damped step of the free entries while the pinned ones stay where they are."""
    free = 1.0 - pinned
    matrix = damped * (scale[:, None] * scale[None, :]) * (free[:, None] * free[None, :]) + jnp.diag(1 - free)
    right = -(slope + damped @ (at * pinned)) * scale * free
    factor = jax.scipy.linalg.cho_factor(matrix + 1e-14 * jnp.eye(len(slope)))
    return jnp.where(pinned, at, jax.scipy.linalg.cho_solve(factor, right) * scale)


class _Trust(eqx.Module):
    step_size: jax.Array
    cut: jax.Array
    idle: jax.Array  # steps since one lowered the cost by a noticeable share


class NielsenSearch(optx.ClassicalTrustRegion):
    """How far to trust a step: the gain ratio moves the damping smoothly, rejections shrink it ever faster.

    It counts the steps since one lowered the cost by a `noticeable` share. Begins almost
    undamped (Nielsen, "Damping parameter in Marquardt's method", IMM-REP-1999-05, eq 2.4).
    """

    noticeable: jax.Array = eqx.field(default_factory=lambda: jnp.asarray(0.0))

    def init(self, y: Any, f_info_struct: Any) -> _Trust:
        """Nearly a Gauss-Newton step to begin with."""
        return _Trust(jnp.asarray(SETTINGS.first_step), jnp.asarray(2.0), jnp.asarray(0))

    def step(self, first_step: Any, y: Any, y_eval: Any, f_info: Any, f_eval_info: Any, state: _Trust) -> Any:
        """The next step size, and whether the evaluated point is accepted."""
        promised = self.predict_reduction(y_eval - y, f_info)
        change = f_eval_info.as_min() - f_info.as_min()
        gain = jnp.where(promised < 0, change / jnp.where(promised < 0, promised, 1.0), -1.0)
        accept = first_step | (gain > self.low_cutoff)
        trusted = state.step_size / jnp.maximum(0.1, 1 - (2 * jnp.minimum(gain, 1.0) - 1) ** 3)
        grown = jnp.where(first_step, state.step_size, trusted)
        size = jnp.where(accept, grown, state.step_size / state.cut)
        moved = first_step | (accept & (change < -self.noticeable * f_info.as_min()))
        idle = jnp.where(moved, 0, state.idle + 1)
        after = _Trust(jnp.minimum(size, 1e12), jnp.where(accept, 2.0, 2 * state.cut), idle)
        return after.step_size, accept, optx.RESULTS.successful, after


class OfLower(NamedTuple):
    """Arguments of residuals that need no derivatives where half the sum of their squares is not below `cost`.

    The solver fills it in: a step that does not lower the cost is not taken, and its derivatives are never used.
    """

    args: Any
    cost: Any = jnp.inf


class BoxLevenbergMarquardt(optx.AbstractGaussNewton):
    """Levenberg-Marquardt within a box, for residuals in standard deviations.

    It has converged where a hardly damped step promises to lower half the sum of squares by less than `rtol` of it and
    by less than `atol`: what is left to gain is then a tiny share of one standard error of every parameter. `look`, a
    flag that may vary from call to call, ends the search at its first point; `enough`, which may vary too, stands in
    for `rtol` where it is larger, and then a search ends too where some steps in a row gained less than that share
    each: along a winding valley a step promises much, and holds little of it.
    """

    rtol: float
    atol: float
    norm: Callable[[Any], jax.Array]
    descent: BoxDescent
    search: NielsenSearch
    verbose: Callable[..., None]
    look: jax.Array
    enough: jax.Array

    def __init__(
        self, lower: jax.Array, upper: jax.Array, rtol: float = 1e-8, atol: float = 1e-4, look: Any = False,
        enough: Any = 0.0,
    ):  # fmt: skip
        self.rtol, self.atol, self.norm = rtol, atol, optx.max_norm
        self.descent = BoxDescent(lower, upper)
        self.look, self.enough = jnp.asarray(look), jnp.asarray(enough)
        self.search = NielsenSearch(noticeable=self.enough)
        self.verbose = lambda **_: None

    def step(self, fn: Any, y: Any, args: Any, options: Any, state: Any, tags: Any) -> Any:
        """One evaluation, and the end of the search where nothing is left to gain."""
        if isinstance(args, OfLower):
            args = OfLower(args.args, jnp.where(state.first_step, jnp.inf, state.f_info.as_min()))
        y, after, aux = super().step(fn, y, args, options, state, tags)
        cost, size = after.f_info.as_min(), after.search_state.step_size
        promised = self.descent.promise(size, after.descent_state)
        least = jnp.maximum(self.rtol, self.enough) * cost + self.atol
        arrived = (promised >= 0) & (promised < least) & jnp.isfinite(cost)
        stuck = size < SETTINGS.stuck
        crawls = (self.enough > 0) & (after.search_state.idle >= SETTINGS.patience)
        return y, eqx.tree_at(lambda s: s.terminate, after, arrived | stuck | crawls | self.look), aux
