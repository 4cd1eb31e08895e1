"""What the value of a parameter rests on beside the recordings: sizes stated with an error, and instruments."""

import numpy as np

from fitting.instruments.sources import Source
from fitting.least_squares.decomposed import lstsq
from fitting.least_squares.record import Fit
from fitting.least_squares.run_differences import bounds
from fitting.least_squares.uncertainty import clusters, moved_by, overrated


def rests_on(fit: Fit) -> dict[str, dict[str, float]]:
    """The share of the robust variance of each free parameter that the error of each stated size makes, from 0 to 1.

    A stated size that is off by its standard error moves the optimum; the square of this move, in standard errors of
    the parameter, is the share (to first order; a move of more than one standard error counts as 1). The share of a
    stated size in itself says how little the recordings know of it. Stated sizes that did not vary move nothing.
    """
    stated = [entry.name for entry in fit.layout.entries if entry.prior is not None]
    if not stated or not fit.free:
        return {name: {} for name in fit.free}
    moves = _moves(np.vstack([_counted(fit), fit.slopes[len(fit.samples) :]]), len(stated))
    variance = np.maximum(np.diag(fit.robust), 1e-300)
    shares = np.minimum(moves**2 / variance[:, None], 1.0)
    return {
        name: {size: float(share) for size, share in zip(stated, row, strict=True) if size in fit.free}
        for name, row in zip(fit.free, shares, strict=True)
    }


def rests_on_instruments(fit: Fit) -> dict[str, dict[Source, float]]:
    """The share of the robust variance of each free parameter that each error of an instrument makes, from 0 to 1.

    Of errors alone that all runs share: those that differ from run to run are made small by more runs.
    """
    shared = _moves_by_instruments(fit)
    variance = np.maximum(np.diag(fit.robust), 1e-300)
    shares = np.minimum(shared**2 / variance[:, None], 1.0)
    found: dict[str, dict[Source, float]] = {name: {} for name in fit.free}
    for name, row in zip(fit.free, shares, strict=True):
        for source, share in zip(fit.errors.sources_shared, row, strict=True):  # some have several columns
            found[name][source] = min(found[name].get(source, 0.0) + float(share), 1.0)
    return found


def shown_by_runs(fit: Fit) -> dict[tuple[Source, int], float]:
    """The largest size of each error presumed of runs that agrees with the runs of each data set, in its unit."""
    count = len(fit.samples)
    rows = np.concatenate([fit.residual / fit.samples.sigma, fit.prior_rows])
    shares = bounds(fit.errors, fit.samples.dataset, fit.slopes[:count], rows, fit.slopes[count:])
    return {(source, one): share * source.allowed for (source, one), share in shares.items()}


def _moves_by_instruments(fit: Fit) -> np.ndarray:
    """How far the optimum moves (parameters, errors that all runs share) by each."""
    return moved_by(fit.errors.times(1 / _noise(fit)), _counted(fit), fit.slopes[len(fit.samples) :])[1]


def _counted(fit: Fit) -> np.ndarray:
    """The slopes of the measurements (rows, parameters), as much as they count in the standard errors."""
    return fit.slopes[: len(fit.samples)] / _noise(fit)


def _noise(fit: Fit) -> float:
    """What readings are taken to err by: more where a free fit would deny a stated size."""
    if not any(fit.layout.entry(name).is_confined for name in fit.free):
        return 1.0
    count = len(fit.samples)
    rows, cluster = fit.residual / fit.samples.sigma, clusters(fit.samples, fit.slopes)
    return overrated(fit.slopes[:count], rows, fit.slopes[count:], cluster)


def _moves(slopes: np.ndarray, priors: int) -> np.ndarray:
    """How far the optimum moves (parameters, priors) where each of the last rows, the priors, shifts by one error."""
    scale = np.maximum(np.linalg.norm(slopes, axis=0), 1e-300)
    shifts = np.zeros((len(slopes), priors))
    shifts[-priors:] = np.eye(priors)
    return lstsq(slopes / scale, shifts, 1e-12) / scale[:, None]
