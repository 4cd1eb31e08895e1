"""What instruments that err add to the likelihood of rows: their errors are not sampled, they are marginalised.

Every error has a normal prior whose standard deviation is the instrument's accuracy, and changes the rows by a column
U. Beside noise of covariance C the rows then have the covariance C + U U'. The logarithm of that density is that of the
noise alone, and b' A^-1 b / 2 - log det A / 2 more, with A = 1 + U' C^-1 U and b = U' C^-1 rows (Woodbury; the lemma of
the determinant). Errors that each run has for itself are taken out run by run, then those that all runs share.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fitting.instruments.errors import InstrumentErrors
from fitting.posterior.noise import Lanes, Noise
from fitting.posterior.one_by_one import cholesky, solved
from fitting.posterior.settings import NOISE
from fitting.problem.residuals import Samples


class Instruments(eqx.Module):
    """Changes of the rows by one standard deviation of each error: of each run's own (runs, readings, k), of shared."""

    lanes: Lanes
    own: jax.Array
    shared: jax.Array

    @classmethod
    def of(cls, errors: InstrumentErrors, samples: Samples, noise: Noise, place: np.ndarray) -> "Instruments | None":
        """For the errors of these rows; None where no instrument errs by anything that is seen.

        Beside noise whose parameters are at this `place`, errors that can hardly be told from each other or from
        nothing are left out: those directions among them along which the rows move by little of the noise.
        """
        felt = visible(errors)
        lanes = Lanes.of(samples)
        whitened = jax.jit(lambda columns: noise.whitened(columns, lanes, jnp.asarray(place)))

        def seen(columns: np.ndarray, run_by_run: bool) -> jax.Array:
            laid = jnp.where(lanes.present[..., None], jnp.asarray(columns)[lanes.at], 0.0)
            white = np.where(lanes.present[..., None], whitened(laid), 0.0) if columns.shape[1] else np.asarray(laid)
            products = np.einsum("rtk,rtl->rkl", white, white)
            square, turn = np.linalg.eigh(products if run_by_run else products.sum(axis=0, keepdims=True))
            kept = np.flatnonzero(np.any(square > NOISE.told**2, axis=0))
            return jnp.einsum("rtk,rkl->rtl", laid, np.broadcast_to(turn, (len(laid), *turn.shape[1:]))[..., kept])

        own, shared = seen(felt.per_run, True), seen(felt.shared, False)
        return cls(lanes, own, shared) if own.shape[-1] + shared.shape[-1] else None

    def log_weight(self, noise: Noise, rows: jax.Array, place: jax.Array) -> jax.Array:
        """What is added to the log-likelihood of rows beside noise whose parameters are at this place."""
        columns = jnp.concatenate([self.own, rows[self.lanes.at][..., None], self.shared], axis=-1)
        white = jnp.where(self.lanes.present[..., None], noise.whitened(columns, self.lanes, place), 0.0)
        products, k = jnp.matmul(jnp.swapaxes(white, 1, 2), white), self.own.shape[-1]

        def of_run(products: jax.Array) -> tuple[jax.Array, jax.Array]:
            root = cholesky(jnp.eye(k) + products[:k, :k])
            return jnp.diagonal(root), solved(root, products[:k, k:])

        per_run, taken = jax.lax.map(of_run, products)
        # what is left of the products of row and shared columns, all runs together
        left = jnp.sum(products[:, k:, k:] - jnp.matmul(jnp.swapaxes(taken, 1, 2), taken), axis=0)
        both = cholesky(jnp.eye(len(left) - 1) + left[1:, 1:])
        seen = solved(both, left[1:, 0])
        explained = jnp.sum(taken[..., 0] ** 2) + jnp.sum(seen**2)
        return 0.5 * explained - jnp.sum(jnp.log(per_run)) - jnp.sum(jnp.log(jnp.diagonal(both)))


def visible(errors: InstrumentErrors) -> InstrumentErrors:
    """Those errors that change the rows at all, each in all rows together by more than a share of a reading's noise."""
    sources = (*errors.sources_per_run, *errors.sources_shared)
    sizes = np.linalg.norm(np.hstack([errors.per_run, errors.shared]), axis=0)
    return errors.chosen([source for source, size in zip(sources, sizes, strict=True) if size > NOISE.felt])
