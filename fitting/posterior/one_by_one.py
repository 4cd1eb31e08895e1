"""Cholesky factors and triangular systems, one matrix at a time though many points are asked for at once.

jaxlib 0.10 spreads a batch of matrices over XLA's threads, and one of these threads waits until all are done. Where as
many batches meet as there are threads, all of them wait for ever: a quick look stopped so on a machine with two cores.
jaxlib 0.11 no longer does so. A single matrix is not spread.
"""

from collections.abc import Callable

import jax
import jax.numpy as jnp
from jax.custom_batching import sequential_vmap


def _one_by_one(plain: Callable[..., jax.Array]) -> Callable[..., jax.Array]:
    """The same of a single matrix, which `vmap` turns into a loop; derivatives are those of the plain function.

    They are taken of one point at a time, by NUTS: `sequential_vmap` cannot be derived backward.
    """
    one = jax.custom_jvp(sequential_vmap(plain))
    one.defjvp(lambda at, along: jax.jvp(plain, at, along))
    return one


def _solved(factor: jax.Array, right: jax.Array) -> jax.Array:
    return jax.scipy.linalg.solve_triangular(factor, right, lower=True)


def _solved_transposed(factor: jax.Array, right: jax.Array) -> jax.Array:
    return jax.scipy.linalg.solve_triangular(factor, right, lower=True, trans=1)


cholesky = _one_by_one(jnp.linalg.cholesky)  # the lower factor L (n, n) of one matrix L L'
solved = _one_by_one(_solved)  # x of L x = b, from the lower factor L (n, n) and b (n,) or (n, m)
solved_transposed = _one_by_one(_solved_transposed)  # x of L' x = b
