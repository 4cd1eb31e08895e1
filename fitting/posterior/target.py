"""The log-density that is sampled: the rows of a fit, the noise of the readings, errors of instruments, priors.

Every parameter lives between two ends. Samplers see the logit of its place there, which knows no ends, whitened by the
curvature at the mode; the density carries the Jacobian of both steps, so that a prior is what it says it is.
"""

import dataclasses
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fitting.instruments.errors import InstrumentErrors
from fitting.least_squares.subset import Subset
from fitting.posterior.instruments import Instruments
from fitting.posterior.noise import Noise, RecordingNoise
from fitting.problem.priors import Prior, Priors
from fitting.problem.residuals import Problem, Samples


class Parts(NamedTuple):
    """The log-density at a point, or at some points along a leading axis, in its parts."""

    terms: Any  # log-likelihood of each row beside noise alone (..., rows)
    instruments: Any  # what errors of instruments add to it (...)
    prior: Any  # log-density in z (...)
    rows: Any  # of the measurements (..., rows)


class Target(eqx.Module):
    """The log-density over whitened coordinates z: logits of places in the unit box, of free parameters, then noise."""

    problem: Problem
    subset: Subset
    noise: Noise
    instruments: Instruments | None
    priors: Priors
    centre: jax.Array  # logits
    axes: jax.Array  # columns: what one unit of each z does

    @property
    def free(self) -> int:
        """How many parameters of the model vary, those of the noise not counted."""
        return self.subset.free.size

    @property
    def moves(self) -> bool:
        """Whether a motion is integrated, which takes longer than anything else."""
        return any(block.steps for block in self.problem.blocks)

    def parts(self, z: jax.Array, shift: jax.Array | float = 0.0) -> Parts:
        """The log-density in its parts; `shift` (rows,) is taken from the rows."""
        u = self.centre + self.axes @ z
        place = jax.nn.sigmoid(u)
        mine = place[: self.free]
        vector = self.subset.vector(mine)
        rows = self.problem.data_rows(vector, self.subset.switches) - shift
        prior = jnp.sum(self.priors.log_density(vector[self.subset.free]))
        stretch = jnp.sum(jnp.log(jnp.abs(self.subset.slope(mine)))) - jnp.sum(jax.nn.softplus(u) + jax.nn.softplus(-u))
        of_noise = place[self.free :]
        felt = self.instruments.log_weight(self.noise, rows, of_noise) if self.instruments else jnp.zeros(())
        return Parts(self.noise.terms(rows, of_noise), felt, prior + stretch, rows)

    def log_prob(self, z: jax.Array) -> jax.Array:
        """Logarithm of the posterior's density in z, up to a constant."""
        parts = self.parts(z)
        value = jnp.sum(parts.terms) + parts.instruments + parts.prior
        return jnp.where(jnp.isfinite(value), value, -jnp.inf)

    def places(self, z: np.ndarray) -> np.ndarray:
        """Places in the unit box, along the last axis of a plain array of z."""
        u = np.asarray(self.centre) + z @ np.asarray(self.axes).T
        return 0.5 * (1 + np.tanh(0.5 * u))

    def natural(self, z: np.ndarray) -> np.ndarray:
        """Free parameters in SI, then those of the noise, along the last axis of a plain array of z."""
        place, which = self.places(z), np.asarray(self.subset.free)
        ends = (self.subset.lower, self.subset.upper, self.subset.logarithmic)
        lower, upper, log = (np.asarray(end)[which] for end in ends)
        mine = place[..., : self.free]
        low, ratio = np.where(log, lower, 1.0), np.where(log, upper, 1.0) / np.where(log, lower, 1.0)
        values = np.where(log, low * ratio**mine, lower + mine * (upper - lower))
        below, above = np.asarray(self.noise.lower), np.asarray(self.noise.upper)
        noise = below + place[..., self.free :] * (above - below)
        return np.concatenate([values, np.where(np.asarray(self.noise.logarithmic), np.exp(noise), noise)], axis=-1)


@dataclasses.dataclass(frozen=True)
class PosteriorProblem:
    """What is to be sampled: the density, the readings behind it, the noise chosen, the priors as stated."""

    target: Target
    samples: Samples
    errors: InstrumentErrors  # what instruments can do to the rows: the density knows of it
    noise: tuple[RecordingNoise, ...]
    labels: tuple[str, ...]  # of the recordings
    names: tuple[str, ...]  # of the coordinates: free parameters, then those of the noise
    priors: dict[str, Prior]  # of the free parameters
    spreads: dict[str, float]  # standard deviation of each prior within its range, SI
    idle: tuple[str, ...] = ()  # stated priors of parameters that do not vary
    integration: str = ""  # how motions are integrated, in words
    stated: tuple[bool, ...] = ()  # whether the noise of each recording is known by its owner's word

    def in_coordinates(self, centre: np.ndarray, axes: np.ndarray) -> "PosteriorProblem":
        """The same in other coordinates."""
        target = dataclasses.replace(self.target, centre=jnp.asarray(centre), axes=jnp.asarray(axes))
        return dataclasses.replace(self, target=target)
