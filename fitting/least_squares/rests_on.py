"""What the value of a parameter rests on beside the recordings: sizes stated with an error, and instruments."""

import numpy as np

from fitting.instruments.sources import Source
from fitting.least_squares.decomposed import lstsq
from fitting.least_squares.record import Fit
from fitting.least_squares.run_differences import bounds
from fitting.least_squares.uncertainty import misfit_of_all, moved_by, moved_by_sizes


def rests_on(fit: Fit) -> dict[str, dict[str, float]]:
    """The share of the robust variance of each free parameter that the error of each stated size makes, from 0 to 1.

    A stated size that is off by its standard error moves the optimum; the square of this move, in standard errors of
    the parameter, is the share (to first order; a move of more than one standard error counts as 1). The share of a
    stated size in itself says how little the recordings know of it. Stated sizes that did not vary move nothing.
    """
    stated = [entry.name for entry in fit.layout.entries if entry.prior is not None]
    if not stated or not fit.free:
        return {name: {} for name in fit.free}
    moves = _moves_beside_confined(fit, stated)
    variance = np.maximum(np.diag(fit.robust), 1e-300)
    shares = np.minimum(moves**2 / variance[:, None], 1.0)
    return {
        name: {size: float(share) for size, share in zip(stated, row, strict=True) if size in fit.free}
        for name, row in zip(fit.free, shares, strict=True)
    }


def rests_on_instruments(fit: Fit) -> dict[str, dict[Source, float]]:
    """The share of the robust variance of each free parameter that each error of an instrument makes, from 0 to 1.

    Of errors alone that all runs share: those that differ from run to run are made small by more runs. Sizes that the
    recordings may not teach rest on no instrument.
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


def _moves_beside_confined(fit: Fit, stated: list[str]) -> np.ndarray:
    """How far the optimum moves (parameters, stated sizes); of confined sizes the readings say next to nothing."""
    confined, count = _confined(fit), len(fit.samples)
    if not confined.any():
        return _moves(fit.slopes, len(stated))
    data, priors = fit.slopes[:count], fit.slopes[count:]
    noise = misfit_of_all(fit.residual / fit.samples.sigma)
    sizes = _moves(np.vstack([data / noise, priors]), len(stated))[confined]
    return moved_by_sizes(data, priors, confined) @ sizes


def _moves_by_instruments(fit: Fit) -> np.ndarray:
    """How far the optimum moves (parameters, errors that all runs share) by each; confined sizes do not move."""
    count, taught = len(fit.samples), ~_confined(fit)
    slopes = fit.slopes[:, taught]
    moves = np.zeros((len(fit.free), fit.errors.shared.shape[1]))
    moves[taught] = moved_by(fit.errors, slopes[:count], slopes[count:])[1]
    return moves


def _confined(fit: Fit) -> np.ndarray:
    """Which free parameters are sizes that the recordings may not teach (parameters,)."""
    return np.array([fit.layout.entry(name).is_confined for name in fit.free], dtype=bool)


def _moves(slopes: np.ndarray, priors: int) -> np.ndarray:
    """How far the optimum moves (parameters, priors) where each of the last rows, the priors, shifts by one error."""
    scale = np.maximum(np.linalg.norm(slopes, axis=0), 1e-300)
    shifts = np.zeros((len(slopes), priors))
    shifts[-priors:] = np.eye(priors)
    return lstsq(slopes / scale, shifts, 1e-12) / scale[:, None]
