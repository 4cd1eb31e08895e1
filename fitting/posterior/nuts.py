"""The same log-density sampled by NUTS (BlackJAX), for those who want it: `pip install mckibben-jax[nuts]`."""

import functools
import time
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from fitting.errors import InputError
from fitting.least_squares.record import Fit
from fitting.posterior.record import Posterior, convergence_warnings
from fitting.posterior.settings import NUTS, SAMPLER
from fitting.posterior.setup import set_up
from fitting.posterior.summary import summarise
from fitting.posterior.target import Target
from fitting.problem.priors import Prior
from fitting.recordings.records import Experiment


def _density(target: Target) -> Callable[[jax.Array], jax.Array]:
    """The log-density of one point. Its slope is found backward, but for motions: see `_moving_density`."""
    return (lambda z: _moving_density(target, z)) if target.moves else target.log_prob


@jax.custom_vjp
def _moving_density(target: Target, z: jax.Array) -> jax.Array:
    return target.log_prob(z)


def _forward(target: Target, z: jax.Array) -> tuple[jax.Array, tuple]:
    # forward mode: backward through the steps of a motion is many times slower
    along = lambda tangent: jax.jvp(target.log_prob, (z,), (tangent,))  # noqa: E731
    value, slope = jax.vmap(along, out_axes=(None, 0))(jnp.eye(z.size))
    return value, (target, slope)


def _backward(kept: tuple, weight: jax.Array) -> tuple:
    target, slope = kept
    return jax.tree.map(_no_slope, target), weight * slope


def _no_slope(leaf: jax.Array) -> jax.Array | np.ndarray:
    """The slope of what does not vary, in the type that jax wants for it."""
    floating = jnp.issubdtype(leaf.dtype, jnp.floating)
    return jnp.zeros_like(leaf) if floating else np.zeros(leaf.shape, jax.dtypes.float0)


_moving_density.defvjp(_forward, _backward)


def sample_nuts(
    fit: Fit,
    experiments: Sequence[Experiment] = (),
    *,
    seed: int = 0,
    draws: int = NUTS.draws,
    limit_s: float = 600.0,
    rows: int = SAMPLER.rows,
    priors: dict[str, Prior] | None = None,
    noise: Sequence[tuple[str, ...]] | None = None,
    progress: Callable[[str, float], None] | None = None,
) -> Posterior:
    """The posterior of a fit's free parameters by four chains of NUTS; other arguments as in `sample`."""
    deadline = time.monotonic() + limit_s
    compiled = _compiled()
    setup = set_up(fit, experiments, rows, priors, noise)
    progress = progress or (lambda *_: None)
    chains = []
    for number, key in enumerate(jax.random.split(jax.random.key(seed), NUTS.chains)):
        progress(f"warm-up of chain {number + 1} of {NUTS.chains}", 0.0)
        key, first, second = jax.random.split(key, 3)
        start = NUTS.spread * jax.random.normal(first, (len(setup.names),))
        chains.append(_Chain(key, *compiled.begin(setup.target, second, start)))
    z, diverged = np.zeros((NUTS.chains, 0, len(setup.names))), 0
    while z.shape[1] < draws and (z.shape[1] == 0 or time.monotonic() < deadline):
        parts = [chain.grown(compiled, setup.target, z.shape[1]) for chain in chains]
        z = np.concatenate([z, np.stack([part for part, _ in parts])], axis=1)
        diverged += sum(count for _, count in parts)
        progress(f"{z.shape[1]} draws of {NUTS.chains} chains", z.shape[1] / draws)
    late = z.shape[1] < draws
    ended = f"after {limit_s:g} s ({z.shape[1]} steps)" if late else f"after {z.shape[1]} steps"
    z = z[:, :draws, None]
    warnings = (
        *convergence_warnings(setup.names, setup.target.natural(z), ended),
        *_divergent(diverged, z.shape[1]),
    )
    return summarise(fit, experiments, setup, z, ended, "nuts (BlackJAX)", seed, unreliable=warnings)


def _divergent(count: int, draws: int) -> tuple[str, ...]:
    if not count:
        return ()
    return (
        f"{count} of {NUTS.chains * draws} steps of NUTS diverged: the posterior has a sharp corner that it may not "
        "have entered; compare with emcee",
    )


class _Compiled(NamedTuple):
    """Compiled once for targets of one structure."""

    begin: Callable[..., Any]
    on: Callable[..., Any]


class _Chain:
    """One chain after its warm-up."""

    def __init__(self, key: jax.Array, state: Any, settings: Any) -> None:
        self.key, self.state, self.settings = key, state, settings

    def grown(self, compiled: _Compiled, target: Target, at: int) -> tuple[np.ndarray, int]:
        """Further draws (step, coordinate), and how many of them diverged."""
        keys = jax.random.split(jax.random.fold_in(self.key, at), NUTS.piece)
        self.state, (z, diverged) = compiled.on(target, self.settings, self.state, keys)
        return np.asarray(z), int(np.sum(diverged))


@functools.cache
def _compiled() -> _Compiled:
    try:
        import blackjax  # pyright: ignore[reportMissingImports]
    except ImportError:
        raise InputError("NUTS needs a further package", cure="pip install 'mckibben-jax[nuts]'") from None

    @jax.jit
    def begin(target: Target, key: jax.Array, start: jax.Array) -> tuple[Any, Any]:
        tuned = blackjax.window_adaptation(blackjax.nuts, _density(target))
        return tuned.run(key, start, num_steps=NUTS.warm_up)[0]  # pyright: ignore[reportCallIssue]

    @jax.jit
    def on(target: Target, settings: Any, state: Any, keys: jax.Array) -> tuple[Any, Any]:
        step = blackjax.nuts(_density(target), **settings).step

        def one(state: Any, key: jax.Array) -> tuple[Any, Any]:
            state, info = step(key, state)
            return state, (state.position, info.is_divergent)  # pyright: ignore[reportAttributeAccessIssue]

        return jax.lax.scan(one, state, keys)

    return _Compiled(begin, on)
