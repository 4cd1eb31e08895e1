"""The density of a posterior with the errors of instruments as coordinates: where they are asked for one by one."""

from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp

from fitting.instruments.through import SIZES
from fitting.posterior.evaluation import compiled
from fitting.posterior.instruments import visible
from fitting.posterior.noise import Lanes
from fitting.posterior.one_by_one import cholesky, solved, solved_transposed
from fitting.posterior.target import Parts, PosteriorProblem, Target


class Explicit(eqx.Module):
    """The same density with the errors of instruments as coordinates of their own, behind z."""

    target: Target
    lanes: Lanes
    columns: jax.Array  # (rows, errors): what one standard deviation of each does to the rows

    @classmethod
    def of(cls, setup: PosteriorProblem) -> "Explicit | None":
        """Of a density in which these errors are marginalised; None where there are too many to be held one by one."""
        samples = setup.samples
        if visible(setup.errors).count > SIZES[-1]:
            return None
        target = replace(setup.target, instruments=None)
        lanes = Lanes.of(samples)
        return cls(target, lanes, jnp.asarray(visible(setup.errors).columns))

    def parts(self, point: jax.Array) -> Parts:
        """Its parts at a point: coordinates z, then the errors in standard deviations."""
        count = len(self.target.centre)
        return self.target.parts(point[:count], self.columns @ point[count:])

    def likeliest(self, z: jax.Array) -> jax.Array:
        """The most likely errors (errors,) beside these coordinates."""
        return self._errors(z)[0]

    def drawn(self, point: jax.Array) -> jax.Array:
        """Errors (errors,) as they may be beside coordinates z, from as many standard normal numbers behind these."""
        count = len(self.target.centre)
        middle, root = self._errors(point[:count])
        return middle + solved_transposed(root, point[count:])

    def _errors(self, z: jax.Array) -> tuple[jax.Array, jax.Array]:
        """The most likely errors, and the root of the inverse of their covariance."""
        target = self.target
        place = jax.nn.sigmoid(target.centre + target.axes @ z)[target.free :]
        columns = jnp.concatenate([target.parts(z).rows[:, None], self.columns], axis=1)
        white = target.noise.whitened(columns[self.lanes.at], self.lanes, place)
        white = jnp.where(self.lanes.present[..., None], white, 0.0).reshape(-1, columns.shape[1])
        row, errors = white[:, 0], white[:, 1:]
        root = cholesky(jnp.eye(errors.shape[1]) + errors.T @ errors)
        return solved_transposed(root, solved(root, errors.T @ row)), root


LIKELIEST = compiled(lambda explicit, z: explicit.likeliest(z))
DRAWN = compiled(lambda explicit, point: explicit.drawn(point))
