"""How far intervals of a posterior would widen, were errors shared within loops or runs in a way nobody modelled."""

import numpy as np

from fitting.instruments.sources import Source
from fitting.posterior.evaluation import in_batches, prior_curvature, slopes_at
from fitting.posterior.explicit import LIKELIEST, Explicit
from fitting.posterior.instruments import visible
from fitting.posterior.settings import DENSITY
from fitting.posterior.target import PosteriorProblem


def robust_share(setup: PosteriorProblem, z: np.ndarray, cluster: np.ndarray) -> np.ndarray:
    """Standard deviation robust to what a cluster shares, as a multiple of the posterior's, for every coordinate.

    The sandwich C M C: C is the posterior's covariance, M the spread of the likelihood's slopes from cluster to cluster
    and the curvature of the prior, all in z. Errors of instruments give way when a slope is felt, each as far as its
    own prior lets it: d(errors)/dz of the likeliest ones. 1 where there are too many errors to be held one by one.
    """
    explicit = Explicit.of(setup)
    if explicit is None:
        return np.ones(z.shape[-1])
    flat = z.reshape(-1, z.shape[-1])
    centre, spread = flat.mean(axis=0), np.atleast_2d(np.cov(flat.T))
    errors, gives = _giving_way(explicit, centre)
    by_row = np.nan_to_num(slopes_at(explicit, np.concatenate([centre, errors]), DENSITY.fine).terms)
    by_row = by_row[: len(centre)] + gives.T @ by_row[len(centre) :]
    number = np.unique(cluster, return_inverse=True)[1]
    count = number.max() + 1
    slopes = np.zeros((count, len(centre)))
    np.add.at(slopes, number, by_row.T)
    slopes -= slopes.mean(axis=0)
    between = slopes.T @ slopes * (count / max(count - 1, 1))
    middle = between + prior_curvature(setup.target, centre) + gives.T @ gives
    axes = np.asarray(setup.target.axes)
    bread = axes @ spread
    plain = np.einsum("ij,ij->i", bread, axes)
    robust = np.einsum("ij,jk,ik->i", bread, middle, bread)
    return np.sqrt(np.maximum(robust, 0) / np.maximum(plain, 1e-300))


def most_asked(setup: PosteriorProblem, z: np.ndarray) -> tuple[Source | None, float]:
    """The largest of the most likely errors of instruments in the middle of chains z: its source, and its accuracies.

    None where no instrument errs, or where there are too many errors to be held one by one.
    """
    explicit, errors = Explicit.of(setup), visible(setup.errors)
    if explicit is None or not errors.count:
        return None, 0.0
    centre = z.reshape(-1, z.shape[-1]).mean(axis=0)
    sizes = np.abs(in_batches(LIKELIEST, explicit, centre[None])[0])
    runs = len(np.unique(errors.run))
    sources = (*errors.sources_per_run * runs, *errors.sources_shared)
    return max(zip(sources, sizes.tolist(), strict=True), key=lambda each: each[1])


def _giving_way(explicit: Explicit, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The likeliest errors (errors,) at z, and how they change with it (errors, coordinates)."""
    nudges = DENSITY.step * np.eye(len(z))
    found = in_batches(LIKELIEST, explicit, np.concatenate([z[None], z + nudges, z - nudges]))
    up, down = found[1 : len(z) + 1], found[len(z) + 1 :]
    return found[0], ((up - down) / (2 * DENSITY.step)).T
