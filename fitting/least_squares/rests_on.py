"""What the value of a parameter rests on beside the recordings: sizes that were stated with an error."""

import numpy as np

from fitting.least_squares.decomposed import lstsq
from fitting.least_squares.record import Fit


def rests_on(fit: Fit) -> dict[str, dict[str, float]]:
    """The share of the robust variance of each free parameter that the error of each stated size makes, from 0 to 1.

    A stated size that is off by its standard error moves the optimum; the square of this move, in standard errors of
    the parameter, is the share (to first order; a move of more than one standard error counts as 1). The share of a
    stated size in itself says how little the recordings know of it. Stated sizes that did not vary move nothing.
    """
    stated = [entry.name for entry in fit.layout.entries if entry.prior is not None]
    if not stated or not fit.free:
        return {name: {} for name in fit.free}
    moves = _moves(fit.slopes, len(stated))
    variance = np.maximum(np.diag(fit.robust), 1e-300)
    shares = np.minimum(moves**2 / variance[:, None], 1.0)
    return {
        name: {size: float(share) for size, share in zip(stated, row, strict=True) if size in fit.free}
        for name, row in zip(fit.free, shares, strict=True)
    }


def _moves(slopes: np.ndarray, priors: int) -> np.ndarray:
    """How far the optimum moves (parameters, priors) where each of the last rows, the priors, shifts by one error."""
    scale = np.maximum(np.linalg.norm(slopes, axis=0), 1e-300)
    shifts = np.zeros((len(slopes), priors))
    shifts[-priors:] = np.eye(priors)
    return lstsq(slopes / scale, shifts, 1e-12) / scale[:, None]
