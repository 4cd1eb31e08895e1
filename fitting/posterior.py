"""What the data leave open: the posterior of a fitted model, sampled by emcee on the rows that the fit minimised.

Likelihood: every reading errs normally by `s` times the noise of its recording, one unknown `s` for each unit of
measurement (N, m) with a flat prior in log s. Neighbouring errors are not independent, so that each recording's
log-likelihood is divided by the correlation time of its residual: n readings count as n / tau. Leaving readings out
(`thinned`) therefore costs nothing where errors are correlated, and widens the posterior where they are not. One time
for all parameters is right for noise; for a misfit it is too long for those whose signature changes sign within it.

Prior: uniform within the range of each parameter (in the parameter, also where a search goes in its logarithm), times
the normal priors of values stated with `+/-`.

What emcee cannot see is a wrong model: a stable chain around a wrong value. So the error robust to whatever a loop
shares stands beside, with a warning where it is much larger, and where the misfit is more than noise.
"""

import dataclasses
import time
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import emcee
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fitting.errors import InputError
from fitting.least_squares import Fit, Subset, rows_and_slopes, subset_of
from fitting.posterior_record import (
    Draws,
    Posterior,
    describe,
    doubts,
    effective_samples,
    notes,
    quantities,
    save,
    settled,
    slim,
    to_json,
    unsettled,
)
from fitting.precision import require_x64
from fitting.records import Experiment
from fitting.residuals import Problem, Samples, problem, thinned

ROWS = 4000  # readings that are enough; more are thinned
ENSEMBLES = 4  # walkers of one ensemble are not independent chains, ensembles are
SPREAD = 2.0  # standard deviations of the fit over which walkers start: wider than the answer, so that R-hat can tell
SCALE_RANGE = np.log(1e3)  # how far the noise may be from the fit's, up or down
STRIDE, PATIENCE = 50, 2.0  # steps, and seconds, between looks at the clock
FIRST_CHECK = 200  # steps before the first look at the chains

__all__ = ["Posterior", "describe", "sample", "save", "to_json"]


class Snooker(emcee.moves.RedBlueMove):
    """Moves along the line to another walker (ter Braak & Vrugt 2008), for distributions of odd shape.

    emcee's own, up to version 3.1.6, does not normalise that line: in five dimensions a normal distribution comes out 3
    to 8 % too narrow in the mix that emcee recommends (mended in its repository by pull request 531).
    """

    def get_proposal(self, sample: np.ndarray, complement: Any, random: Any) -> tuple[np.ndarray, np.ndarray]:
        """Proposed places, and the log of the factor in the acceptance."""
        others = np.concatenate(complement)
        picked = np.argsort(random.rand(len(sample), len(others)), axis=1)[:, :3]
        towards, first, second = (others[picked[:, k]] for k in range(3))
        line = sample - towards
        distance = np.linalg.norm(line, axis=1)
        line = line / distance[:, None]
        proposed = sample + 1.7 * line * np.sum(line * (first - second), axis=1, keepdims=True)
        stretched = np.linalg.norm(proposed - towards, axis=1) / distance
        return proposed, (sample.shape[1] - 1) * np.log(stretched)


class Target(eqx.Module):
    """The log-probability over whitened coordinates z: places in the unit box, then log noise scales, by the fit."""

    problem: Problem
    subset: Subset
    weight: jax.Array  # of every measured row: 1 / correlation time of its recording
    unit: jax.Array  # of every measured row, as a number
    centre: jax.Array  # places and log scales of the fit
    axes: jax.Array  # columns: what one unit of each z does

    @property
    def free(self) -> int:
        """How many parameters vary, the noise scales not counted."""
        return self.subset.free.size

    def split(self, z: jax.Array) -> tuple[jax.Array, jax.Array]:
        """Places in the unit box, and log scales."""
        at = self.centre + self.axes @ z
        return at[: self.free], at[self.free :]

    def log_prob(self, z: jax.Array) -> jax.Array:
        """Logarithm of the posterior's density in z, up to a constant."""
        place, log_scale = self.split(z)
        off = jnp.abs(log_scale - self.centre[self.free :])
        inside = jnp.all((place >= 0) & (place <= 1)) & jnp.all(off <= SCALE_RANGE)
        place = jnp.clip(place, 0, 1)
        rows = self.problem.rows(self.subset.vector(place), self.subset.switches)
        data, prior = rows[: self.unit.size], rows[self.unit.size :]
        log_s = log_scale[self.unit]
        misfit = jnp.sum(self.weight * (0.5 * (data * jnp.exp(-log_s)) ** 2 + log_s)) + 0.5 * jnp.sum(prior**2)
        stretch = jnp.sum(jnp.log(jnp.abs(self.subset.slope(place))))  # uniform in the parameter, not in its logarithm
        value = stretch - misfit
        return jnp.where(inside & jnp.isfinite(value), value, -jnp.inf)

    def natural(self, z: np.ndarray) -> np.ndarray:
        """Free parameters in SI, then noise scales, along the last axis of a plain array of z."""
        at = np.asarray(self.centre) + z @ np.asarray(self.axes).T
        which, place = np.asarray(self.subset.free), at[..., : self.free]
        ends = (self.subset.lower, self.subset.upper, self.subset.logarithmic)
        lower, upper, log = (np.asarray(end)[which] for end in ends)
        low, ratio = np.where(log, lower, 1.0), np.where(log, upper, 1.0) / np.where(log, lower, 1.0)
        values = np.where(log, low * ratio**place, lower + place * (upper - lower))
        return np.concatenate([values, np.exp(at[..., self.free :])], axis=-1)


@partial(jax.jit, static_argnums=0)
def _log_probs(structure: Any, leaves: list[jax.Array], z: np.ndarray) -> jax.Array:
    return jax.vmap(jax.tree.unflatten(structure, leaves).log_prob)(z)


def log_probs(target: Target, batch: int) -> Callable[[np.ndarray], np.ndarray]:
    """Log-probabilities of many points, always `batch` of them in one compiled call."""
    leaves, structure = jax.tree.flatten(target)  # once: for small data it costs as much as the rows

    def evaluate(points: np.ndarray) -> np.ndarray:
        padded = np.concatenate([points, np.repeat(points[-1:], -len(points) % batch, axis=0)])
        parts = np.split(padded, len(padded) // batch)
        return np.concatenate([np.asarray(_log_probs(structure, leaves, part)) for part in parts])[: len(points)]

    return evaluate


# What is sampled ------------------------------------------------------------------------------------------------------


def target_of(fit: Fit, given: Problem, samples: Samples) -> Target:
    """The posterior of a fit's free parameters, whitened by the curvature at the fit."""
    subset = subset_of(fit.layout, fit.vector, fit.free, fit.switches)
    place = subset.place(subset.full)
    rows, slopes = map(np.asarray, rows_and_slopes(given, subset, place))
    count, unit = len(samples), np.unique(measured_in(given), return_inverse=True)[1][samples.recording]
    weight = 1 / correlation_times(rows[:count], samples)[samples.recording]
    free = len(fit.free)
    scale = np.sqrt([_mean_square(rows[:count], weight, unit == u, free) for u in range(unit.max() + 1)])
    pull = slopes.copy()
    pull[:count] *= (np.sqrt(weight) / scale[unit])[:, None]
    curvature = pull.T @ pull + 12 * np.eye(free)  # 1/12 is the variance of a place of which nothing is known
    axes = np.zeros((free + len(scale),) * 2)
    axes[:free, :free] = np.linalg.cholesky(np.linalg.inv(curvature))
    axes[free:, free:] = np.diag(1 / np.sqrt(2 * np.bincount(unit, weight)))
    centre = jnp.concatenate([place, jnp.asarray(np.log(scale))])
    return Target(given, subset, jnp.asarray(weight), jnp.asarray(unit), centre, jnp.asarray(axes))


def measured_in(given: Problem) -> tuple[str, ...]:
    """The unit of measurement of each recording."""
    return tuple("N" if block.of_force else "m" for block in given.blocks)


def _mean_square(rows: np.ndarray, weight: np.ndarray, mine: np.ndarray, free: int) -> float:
    count = weight[mine].sum()
    return max(float(np.sum(weight[mine] * rows[mine] ** 2)) / max(count - free, 1.0), 1e-20)


def correlation_times(rows: np.ndarray, samples: Samples) -> np.ndarray:
    """Over how many readings the residual of each recording remembers itself; at least 1.

    Integrated autocorrelation time, pooled over runs, as far as neighbouring pairs of it stay positive (Geyer 1992):
    a misfit that repeats with every loop swings about zero further on. The mean is not taken out: an offset that the
    model misses is an error shared by all.
    """
    masks = [samples.recording == number for number in np.unique(samples.recording)]
    return np.array([_correlation_time(rows[mask], samples.run[mask]) for mask in masks])


def _correlation_time(rows: np.ndarray, run: np.ndarray) -> float:
    parts = [rows[run == r] for r in np.unique(run)]
    longest = max(map(len, parts))
    spectrum = sum(np.abs(np.fft.rfft(part, 2 * longest)) ** 2 for part in parts)
    covariance = np.fft.irfft(spectrum)[:longest]
    if covariance[0] <= 0:
        return 1.0
    share = covariance[: longest // 2 * 2] / covariance[0]
    pairs = share[0::2] + share[1::2]
    positive = np.cumprod(pairs > 0)
    return float(np.clip(2 * np.sum(pairs * positive) - 1, 1.0, len(rows)))


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


# Sampling -------------------------------------------------------------------------------------------------------------


def sample(
    fit: Fit,
    experiments: Sequence[Experiment] = (),
    *,
    seed: int = 0,
    walkers: int | None = None,
    ensembles: int = ENSEMBLES,
    max_steps: int = 20_000,
    limit_s: float = 600.0,
    rows: int = ROWS,
    progress: Callable[[int, float], None] | None = None,
) -> Posterior:
    """Sample what a fit leaves open, from independent ensembles of walkers that start around it.

    Goes on until the chain is longer than 50 autocorrelation times and R-hat is below 1.01, or until `max_steps`, or
    `limit_s` seconds. `experiments`, those of the fit, allow thinning to about `rows` readings. `progress` is told the
    steps taken and the effective samples so far. The same seed gives the same posterior, unless time ran out.
    """
    require_x64()
    if not fit.free:
        raise InputError("nothing varies in this model", cure="free a parameter, for example --free muscle.radius")
    given, samples = slimmed(fit, experiments, rows)
    target = target_of(fit, given, samples)
    count = walkers or max(32, 2 * (2 * len(target.centre) // 2 + 1))
    chains = [_sampler(target, count, (seed, number)) for number in range(max(ensembles, 2))]
    natural, ended = _run(target, chains, max_steps, limit_s, progress)
    units = sorted(set(measured_in(given)))
    names = (*fit.free, *(f"noise.{unit}" for unit in units))
    found = quantities(fit, names, natural)
    return Posterior(
        parameters={name: found[name] for name in fit.free},
        noise={unit: found[f"noise.{unit}"] for unit in units},
        held=fit.held,
        draws=Draws(names, slim(natural)),
        readings=len(samples),
        counted=float(jnp.sum(target.weight)),
        warnings=(*unsettled(names, natural, ended), *doubts(fit, found)),
        notes=notes(fit, target.weight, samples),
    )


def _run(
    target: Target, chains: list, max_steps: int, limit_s: float, progress: Callable[[int, float], None] | None
) -> tuple[np.ndarray, str]:
    """Parameters along the chains, (ensemble, step, walker, parameter), and when sampling ended."""
    started, steps, check, stride = time.monotonic(), 0, min(FIRST_CHECK, max_steps), 4
    while True:
        begun, taken = time.monotonic(), min(stride, check - steps)
        for sampler, state in chains:
            state[0] = sampler.run_mcmc(state[0], taken, skip_initial_state_check=True)
        now, steps = time.monotonic(), steps + taken
        stride = int(np.clip(PATIENCE * taken / (now - begun), 4, STRIDE))
        late = now - started > limit_s
        if not late and steps < check:
            continue
        natural = target.natural(np.stack([_kept(sampler.get_chain()) for sampler, _ in chains]))
        check = min(int(1.3 * steps) + 1, max_steps)
        if progress:
            progress(steps, effective_samples(natural))
        if late or steps >= max_steps or settled(natural):
            return natural, f"after {limit_s:g} s ({steps} steps)" if late else f"after {steps} steps"


def _kept(chain: np.ndarray) -> np.ndarray:
    """What is kept of a chain: all but the first quarter."""
    return chain[len(chain) // 4 :]


def _sampler(target: Target, walkers: int, seed: tuple[int, int]) -> tuple[emcee.EnsembleSampler, list]:
    random = np.random.RandomState(np.random.MT19937(np.random.SeedSequence(seed)))
    log_prob = log_probs(target, -(-walkers // 2))
    size, moves = len(target.centre), [(emcee.moves.DEMove(), 0.8), (Snooker(), 0.2)]
    sampler = emcee.EnsembleSampler(walkers, size, log_prob, moves=moves, vectorize=True)
    sampler.random_state = random.get_state()
    return sampler, [_start(target, random.randn(walkers, size))]


def _start(target: Target, normal: np.ndarray) -> np.ndarray:
    """Points spread around the fit, folded back into the unit box."""
    axes, centre, free = np.asarray(target.axes), np.asarray(target.centre), target.free
    at = centre + SPREAD * normal @ axes.T
    at[:, :free] = 1 - np.abs(1 - np.abs(at[:, :free]) % 2)
    at[:, :free] = np.clip(at[:, :free], 1e-9, 1 - 1e-9)
    return np.linalg.solve(axes, (at - centre).T).T
