"""The largest force error to expect of a model: its misfit on runs that it has not seen, and its open parameters."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fitting import showing
from fitting.exporting.reach import Reach, reach_of
from fitting.exporting.settings import EXPORT
from fitting.least_squares.force_band import ForceBand, force_bands
from fitting.least_squares.record import Fit
from fitting.recordings.records import Experiment, force_was_measured


@dataclass(frozen=True)
class ForceError:
    """The number (N, NaN where it is not known), the sentence that says what it is and how it was found, the bands.

    The bands are where readings of a new run of each kind of test will lie; the number is at least as large as they.
    It holds within `reach`, where the force was measured; None where no number is known.
    """

    newtons: float
    sentence: str
    bands: tuple[ForceBand, ...] = ()
    scatter: float = float("nan")  # N, root mean square over the readings: what the parameters leave open
    reach: Reach | None = None


def unknown_error(why: str) -> ForceError:
    """Where no number can be had."""
    return ForceError(float("nan"), f"The largest force error to expect is not known: {why}.")


def force_error(
    fit: Fit, experiments: Sequence[Experiment], covariance: np.ndarray, origin: str, drawn: np.ndarray | None = None
) -> ForceError:
    """Misfit and spread of the parameters at the readings that were fitted.

    `covariance` is that of the free parameters (SI), `origin` says where it is from; `drawn` is that of draws, if it is
    another. The sum is cautious: both would have to be at their worst in the same place.
    """
    if not force_was_measured(experiments):
        return unknown_error("the recordings of this muscle measure positions, no force")
    at, bands = fit.problem.of_force(fit.samples), force_bands(fit)
    misfit, what = _misfit(fit.residual[at], bands)
    deviations = _deviations(fit, covariance)[at]
    spread = EXPORT.deviations * float(np.max(deviations, initial=0.0))
    reach = reach_of(experiments)
    sentence = (
        f"Largest force error to expect, {misfit + spread:.3g} N, is the sum of two: {misfit:.3g} N, "
        f"{what}, and {spread:.3g} N, which is {EXPORT.deviations:g} times the largest standard "
        f"deviation of the force that "
        f"follows from the uncertainty of the parameters ({origin}). {_elsewhere(fit, at, deviations, spread)}"
        f"It holds where was measured: {reach}; just after a reversal the force may be off by twice the dry friction."
    )
    of_draws = deviations if drawn is None else _deviations(fit, drawn)[at]
    return ForceError(misfit + spread, sentence, bands, float(np.sqrt(np.mean(of_draws**2))), reach)


def _elsewhere(fit: Fit, at: np.ndarray, deviations: np.ndarray, spread: float) -> str:
    """Where the largest uncertainty is, and how much smaller it is at most readings; nothing where it is everywhere.

    One place decides the number, which is therefore far beyond the band of a new run: a reader must know which.
    """
    worst, usual = int(np.argmax(deviations)), EXPORT.deviations * float(np.median(deviations))
    if not (spread > 0 and usual <= EXPORT.even * spread):  # also where nothing varies, or it is no number
        return ""
    pressure, contraction = fit.samples.pressure[at][worst], fit.samples.contraction[at][worst]
    place = f"{showing.show(float(pressure), 'Pa')} and contraction {contraction:.3g}"
    return f"That uncertainty is largest at {place}; at half of the readings it is below {usual:.3g} N. "


def _misfit(residual: np.ndarray, bands: Sequence[ForceBand]) -> tuple[float, str]:
    """The misfit (N) and what it is: of runs that were left out where there are enough of them, else of fitted ones.

    It is never below the band of a new run.
    """
    if not all(band.known and band.fitted for band in bands):
        return _quantile(np.abs(residual)), _share(len(residual), "fitted force readings")
    scores = np.concatenate([score for band in bands for score in band.scores])
    misfit, band = _quantile(scores), max(band.half_width for band in bands)
    if misfit < band:
        return band, f"within which {100 * bands[0].level:g} % of the force readings of a new run are expected"
    return misfit, _share(len(scores), "force readings, each run predicted from the others,")


def _quantile(errors: np.ndarray) -> float:
    return float(np.quantile(errors, EXPORT.misfit_share, method="higher"))


def _share(readings: int, what: str) -> str:
    """What the misfit is, for so many readings."""
    if readings * (1 - EXPORT.misfit_share) < 1:
        return f"the largest difference between the model and the {readings} {what}".rstrip(",")
    share = f"{100 * EXPORT.misfit_share:g} % of the {readings:,} {what}"
    return f"within which {share} agree with the model"


def _deviations(fit: Fit, covariance: np.ndarray) -> np.ndarray:
    """Standard deviation of the force at every reading, N, to first order in the parameters."""
    slopes = fit.slopes[: len(fit.samples)]
    variance = np.einsum("ri,ij,rj->r", slopes, covariance, slopes)
    return np.sqrt(np.maximum(variance, 0.0)) * fit.samples.sigma
