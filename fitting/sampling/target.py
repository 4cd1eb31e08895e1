"""The log-density that is sampled: the rows that a fit minimises, the noise of the readings, the priors.

Every parameter lives between two ends. Samplers see the logit of its place there, which knows no ends, whitened by the
curvature at the mode; the density carries the Jacobian of both steps, so that a prior is what it says it is.
"""

import dataclasses
from collections.abc import Callable, Sequence
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from scipy.optimize import minimize

from fitting.least_squares import Fit, Subset, rows_and_slopes, subset_of
from fitting.records import Experiment
from fitting.residuals import Problem, Samples, problem, thinned
from fitting.sampling.noise import PARTS, Chosen, Noise, chosen, noise_of_rows
from fitting.sampling.priors import Prior, Priors, spread, together, uniform

INSIDE = 1e-6  # of a range: how near its ends a search may begin
WEAKEST = 0.05  # curvature along an axis of which the mode knows nothing
STEP = 1e-3  # of the differences that give the curvature, in standard deviations
WALK = 60  # steps of the search for the mode


class Target(eqx.Module):
    """The log-density over whitened coordinates z: logits of places in the unit box, of free parameters, then noise."""

    problem: Problem
    subset: Subset
    noise: Noise
    priors: Priors
    centre: jax.Array  # logits
    axes: jax.Array  # columns: what one unit of each z does

    @property
    def free(self) -> int:
        """How many parameters of the model vary, those of the noise not counted."""
        return self.subset.free.size

    def terms(self, z: jax.Array) -> tuple[jax.Array, jax.Array]:
        """Log-likelihood row by row, and log-density of the prior in z."""
        u = self.centre + self.axes @ z
        place = jax.nn.sigmoid(u)
        mine = place[: self.free]
        vector = self.subset.vector(mine)
        rows = self.problem.data_rows(vector, self.subset.switches)
        prior = jnp.sum(self.priors.log_density(vector[self.subset.free]))
        stretch = jnp.sum(jnp.log(jnp.abs(self.subset.slope(mine)))) - jnp.sum(jax.nn.softplus(u) + jax.nn.softplus(-u))
        return self.noise.terms(rows, place[self.free :]), prior + stretch

    def log_prob(self, z: jax.Array) -> jax.Array:
        """Logarithm of the posterior's density in z, up to a constant."""
        terms, prior = self.terms(z)
        value = jnp.sum(terms) + prior
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
class Posed:
    """What is to be sampled: the density, the readings behind it, the noise chosen, the priors as stated."""

    target: Target
    samples: Samples
    noise: tuple[Chosen, ...]
    labels: tuple[str, ...]  # of the recordings
    names: tuple[str, ...]  # of the coordinates: free parameters, then those of the noise
    priors: dict[str, Prior]  # of the free parameters
    spreads: dict[str, float]  # standard deviation of each prior within its range, SI
    idle: tuple[str, ...] = ()  # stated priors of parameters that do not vary

    def moved(self, centre: np.ndarray, axes: np.ndarray) -> "Posed":
        """The same in other coordinates."""
        target = dataclasses.replace(self.target, centre=jnp.asarray(centre), axes=jnp.asarray(axes))
        return dataclasses.replace(self, target=target)


# Evaluation -----------------------------------------------------------------------------------------------------------


def _compiled(function: Callable[[Target, jax.Array], Any]) -> Callable[..., Any]:
    """A function of the target and many points, compiled once for targets of one structure."""

    def many(structure: Any, leaves: list[jax.Array], z: jax.Array) -> Any:
        target = jax.tree.unflatten(structure, leaves)
        return jax.vmap(lambda at: function(target, at))(z)

    return jax.jit(many, static_argnums=0)


class Slopes(eqx.Module):
    """The log-density at a point z and how it changes: `terms` row by row, those of the prior apart."""

    value: jax.Array
    terms: jax.Array  # (coordinates, rows)
    prior: jax.Array  # (coordinates,)


def slopes(target: Target, z: jax.Array) -> Slopes:
    """Forward mode: through the steps of a motion it is many times faster than backward."""
    along = lambda tangent: jax.jvp(target.terms, (z,), (tangent,))  # noqa: E731
    (terms, prior), (by_row, of_prior) = jax.vmap(along, out_axes=((None, None), 0))(jnp.eye(z.size))
    value = jnp.sum(terms) + prior
    return Slopes(jnp.where(jnp.isfinite(value), value, -jnp.inf), by_row, of_prior)


def value_and_slope(target: Target, z: jax.Array) -> tuple[jax.Array, jax.Array]:
    """The log-density and its gradient."""
    found = slopes(target, z)
    return found.value, jnp.sum(found.terms, axis=1) + found.prior


_log_probs = _compiled(Target.log_prob)
_slopes = _compiled(slopes)
_rows = _compiled(lambda target, z: target.problem.data_rows(
    target.subset.vector(jax.nn.sigmoid(target.centre + target.axes @ z)[: target.free]), target.subset.switches
))  # fmt: skip


def log_probs(target: Target, batch: int) -> Callable[[np.ndarray], np.ndarray]:
    """Log-densities of many points, always `batch` of them in one compiled call."""
    leaves, structure = jax.tree.flatten(target)  # once: for small data it costs as much as the rows

    def evaluate(points: np.ndarray) -> np.ndarray:
        padded = np.concatenate([points, np.repeat(points[-1:], -len(points) % batch, axis=0)])
        parts = np.split(padded, len(padded) // batch)
        return np.concatenate([np.asarray(_log_probs(structure, leaves, part)) for part in parts])[: len(points)]

    return evaluate


def rows_at(target: Target, z: np.ndarray) -> np.ndarray:
    """The rows of the measurements at many points, (points, rows)."""
    leaves, structure = jax.tree.flatten(target)
    return np.concatenate([np.asarray(_rows(structure, leaves, jnp.asarray(part))) for part in _parts(z)])


def _parts(z: np.ndarray, size: int = 50) -> list[np.ndarray]:
    return np.split(z, np.arange(size, len(z), size))


def slopes_at(target: Target, z: np.ndarray) -> Slopes:
    """The log-density at one point, and how it changes; plain arrays."""
    leaves, structure = jax.tree.flatten(target)
    return jax.tree.map(lambda leaf: np.asarray(leaf)[0], _slopes(structure, leaves, jnp.asarray(z)[None]))


def differences(function: Callable[[np.ndarray], np.ndarray], z: np.ndarray) -> np.ndarray:
    """The symmetric matrix of slopes of a vector function of z, by central differences."""
    nudges = STEP * np.eye(len(z))
    found = np.stack([function(z + nudge) - function(z - nudge) for nudge in nudges]) / (2 * STEP)
    return np.nan_to_num(0.5 * (found + found.T))


def prior_curvature(target: Target, z: np.ndarray) -> np.ndarray:
    """How sharply the prior alone bends in z, without directions in which it opens."""
    strength, along = np.linalg.eigh(-differences(lambda at: np.asarray(slopes_at(target, at).prior), z))
    return along @ np.diag(np.maximum(strength, 0)) @ along.T


# Posing ---------------------------------------------------------------------------------------------------------------


def posed(
    fit: Fit,
    experiments: Sequence[Experiment],
    rows: int,
    stated: dict[str, Prior] | None = None,
    noise: Sequence[tuple[str, ...]] | None = None,
) -> Posed:
    """The posterior of a fit's free parameters, in coordinates whitened by the curvature at its mode."""
    given, samples = slimmed(fit, experiments, rows)
    priors = {name: _prior(fit, name, stated or {}) for name in fit.free}
    subset = _narrowed(subset_of(fit.layout, fit.vector, fit.free), fit, priors)
    place = subset.place(subset.full)
    residual, slopes = map(np.asarray, rows_and_slopes(given, subset, place))
    residual, slopes = residual[: len(samples)], slopes[: len(samples)]
    found = chosen(residual, samples, noise)
    components = noise_of_rows(samples, [one.parts for one in found], [one.values[0] for one in found])
    spreads = {name: _spread(fit, name, prior) for name, prior in priors.items()}
    begin = _logits(np.asarray(place), slopes, found, components, samples)
    target = Target(given, subset, components, together(list(priors.values())), *map(jnp.asarray, begin))
    every = _labels(given, experiments)
    labels = tuple(every[number] for number in np.unique(samples.recording))
    names = (*fit.free, *(f"noise.{part}@{label}" for one, label in zip(found, labels, strict=True)
                          for part in PARTS if part in one.parts))  # fmt: skip
    idle = tuple(name for name in stated or {} if not any(name in (f, f.split("@")[0]) for f in fit.free))
    whole = Posed(target, samples, found, labels, names, priors, spreads, idle)
    return whole.moved(*at_mode(target))


def _prior(fit: Fit, name: str, stated: dict[str, Prior]) -> Prior:
    entry = fit.layout.entries[fit.layout.names.index(name)]
    mine = stated.get(name) or stated.get(name.split("@")[0])
    if mine is not None:
        return mine
    return Prior("normal", *entry.prior) if entry.prior else uniform(entry.lower, entry.upper)


def _spread(fit: Fit, name: str, prior: Prior) -> float:
    entry = fit.layout.entries[fit.layout.names.index(name)]
    return spread(prior, entry.lower, entry.upper)


def _narrowed(subset: Subset, fit: Fit, priors: dict[str, Prior]) -> Subset:
    """Ranges without what a prior excludes."""
    lower, upper = np.array(subset.lower), np.array(subset.upper)
    log = np.array(subset.logarithmic)
    for i, prior in zip(fit.layout.at(priors), priors.values(), strict=True):
        lower[i], upper[i] = prior.ends(float(lower[i]), float(upper[i]))
        log[i] &= lower[i] > 0
    return dataclasses.replace(
        subset, lower=jnp.asarray(lower), upper=jnp.asarray(upper), logarithmic=jnp.asarray(log)
    )


def slimmed(fit: Fit, experiments: Sequence[Experiment], rows: int) -> tuple[Problem, Samples]:
    """The fit's data, or every k-th of its readings where there are more than `rows` and `experiments` are given.

    The noise of a reading stays what it was for all of them.
    """
    if len(fit.samples) <= rows or not experiments:
        return fit.problem, fit.samples
    noise = iter(float(block.sigma[0, 0]) for block in fit.problem.blocks)
    share = rows / len(fit.samples)
    slim = []
    for experiment in experiments:
        stated = tuple(dataclasses.replace(rec, noise=next(noise)) for rec in experiment.recordings)
        weighted = sum(float(run.weight.sum()) for rec in stated for run in rec.runs)
        slim.append(thinned(dataclasses.replace(experiment, recordings=stated), max(int(share * weighted), 1)))
    return problem(slim, fit.layout)


def _labels(given: Problem, experiments: Sequence[Experiment]) -> tuple[str, ...]:
    """What the recordings are called: by their file, with the data set where that is not enough."""
    files = [(experiment.name, rec.file) for experiment in experiments for rec in experiment.recordings]
    if len(files) != len(given.blocks):
        return tuple(f"recording {i + 1}" for i in range(len(given.blocks)))
    plain = [file for _, file in files]
    return tuple(file if plain.count(file) == 1 else f"{name}/{file}" for name, file in files)


def _logits(
    place: np.ndarray, slopes: np.ndarray, found: Sequence[Chosen], noise: Noise, samples: Samples
) -> tuple[np.ndarray, np.ndarray]:
    """Where the search for the mode begins, and how far it may step, in logits."""
    size = np.array([one.values[0] for one in found])[np.unique(samples.recording, return_inverse=True)[1]]
    steeper = slopes / size[:, None]
    curvature = steeper.T @ steeper + 12 * np.eye(len(place))  # 1/12: the variance of a place of which nothing is known
    width = np.linalg.inv(curvature)
    inside = np.maximum(INSIDE, np.minimum(0.5 * np.sqrt(np.diag(width)), 0.1))
    place = np.clip(place, inside, 1 - inside)
    values = np.concatenate([one.values for one in found])
    log, lower, upper = (np.asarray(part) for part in (noise.logarithmic, noise.lower, noise.upper))
    of_noise = (np.where(log, np.log(np.where(log, values, 1.0)), values) - lower) / (upper - lower)
    whole = np.clip(np.concatenate([place, of_noise]), INSIDE, 1 - INSIDE)
    axes = np.zeros((len(whole),) * 2)
    free = len(place)
    axes[:free, :free] = np.linalg.cholesky(width) / (place * (1 - place))[:, None]
    names = [part for one in found for part in PARTS if part in one.parts]
    step = {"size": 0.02, "remembered": 0.3, "memory": 0.2, "run": 0.5}
    axes[free:, free:] = np.diag([step[name] for name in names])
    return np.log(whole / (1 - whole)), axes


def at_mode(target: Target) -> tuple[np.ndarray, np.ndarray]:
    """Centre and axes in which the density has its mode at the origin and unit curvature there."""
    size = len(target.centre)

    def gradient(z: np.ndarray) -> tuple[float, np.ndarray]:
        found = slopes_at(target, z)
        return float(found.value), np.asarray(found.terms.sum(axis=1) + found.prior)

    def down(z: np.ndarray) -> tuple[float, np.ndarray]:
        value, slope = gradient(z)
        return (-value, -slope) if np.isfinite(value) and np.all(np.isfinite(slope)) else (1e300, np.zeros(size))

    z = minimize(down, np.zeros(size), jac=True, method="BFGS", options={"maxiter": WALK, "gtol": 1e-2}).x
    strength, along = np.linalg.eigh(-differences(lambda at: gradient(at)[1], z))
    strength = np.maximum(strength, WEAKEST)
    axes = np.asarray(target.axes)
    return np.asarray(target.centre) + axes @ z, axes @ (along / np.sqrt(strength))
