"""The same log-density sampled by NUTS (BlackJAX), for those who want it: `pip install mckibben-jax[nuts]`."""

from collections.abc import Callable, Sequence

import jax
import jax.numpy as jnp
import numpy as np

from fitting.errors import InputError
from fitting.least_squares import Fit
from fitting.posterior import begun
from fitting.records import Experiment
from fitting.sampling.priors import Prior
from fitting.sampling.record import Posterior
from fitting.sampling.said import concluded
from fitting.sampling.target import Target

CHAINS, WARM_UP, DRAWS = 4, 300, 1000


@jax.custom_vjp
def _density(target: Target, z: jax.Array) -> jax.Array:
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


_density.defvjp(_forward, _backward)


def sample_nuts(
    fit: Fit,
    experiments: Sequence[Experiment] = (),
    *,
    seed: int = 0,
    draws: int = DRAWS,
    rows: int = 4000,
    priors: dict[str, Prior] | None = None,
    noise: Sequence[tuple[str, ...]] | None = None,
    progress: Callable[[str, float], None] | None = None,
) -> Posterior:
    """The posterior of a fit's free parameters by four chains of NUTS; other arguments as in `sample`."""
    try:
        import blackjax  # pyright: ignore[reportMissingImports]
    except ImportError:
        raise InputError("NUTS needs a further package", cure="pip install 'mckibben-jax[nuts]'") from None
    what = begun(fit, experiments, rows, priors, noise)
    told, target = progress or (lambda *_: None), what.target

    @jax.jit
    def chain(target: Target, key: jax.Array, start: jax.Array) -> jax.Array:
        density = lambda z: _density(target, z)  # noqa: E731
        first, second = jax.random.split(key)
        tuned = blackjax.window_adaptation(blackjax.nuts, density)
        (state, settings), _ = tuned.run(first, start, num_steps=WARM_UP)  # pyright: ignore[reportCallIssue]
        step = blackjax.nuts(density, **settings).step

        def one(state, key):  # type: ignore[no-untyped-def]
            state, _ = step(key, state)
            return state, state.position  # pyright: ignore[reportAttributeAccessIssue]

        return jax.lax.scan(one, state, jax.random.split(second, draws))[1]

    found = []
    for number, key in enumerate(jax.random.split(jax.random.key(seed), CHAINS)):
        told(f"chain {number + 1} of {CHAINS}", number / CHAINS)
        key, own = jax.random.split(key)
        found.append(np.asarray(chain(target, key, 2 * jax.random.normal(own, (len(what.names),)))))
    z = np.stack(found)[:, :, None]
    return concluded(fit, experiments, what, z, f"after {draws} steps", "nuts (BlackJAX)", seed)
