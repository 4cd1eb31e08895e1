"""A fitted model seen through its instruments: the values that it has where each of them may err within its accuracy.

The curve of least error follows the errors of instruments, too: a gain that is off by a percent moved the stiffness of
a spring by forty. Where such errors and noise explain all that a fit leaves, the values that leave the least beyond
them are the likelier ones. Noise that fades slowly is taken as such: were every reading independent, ten thousand of
them would overrule every accuracy, and errors of instruments would be fitted to the noise. The search begins at the
curve of least error and asks for nothing but its rows and slopes, which are compiled already; scipy's `least_squares`
asks so, and keeps to the ranges.
"""

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from fitting.instruments.settings import INSTRUMENTS
from fitting.least_squares.held_out import rms
from fitting.least_squares.latest import latest_kept
from fitting.least_squares.record import Fit
from fitting.least_squares.searches import Searches
from fitting.least_squares.subset import Subset, subset_of
from fitting.least_squares.unbent import MOST_NUMBERS, UNBENT, left_beyond
from fitting.least_squares.uncertainty import at_bound, spread_of_values
from fitting.least_squares.working_noise import Kinds, Noise, Whitener, stretches, white_noise
from fitting.problem.unknowns import BELIEVED

MOST_ASKED = INSTRUMENTS.believed
MOST_STEPS = 60  # of a search: where more are needed nothing is sharp enough to be likelier; measured: 4 to 12
LEAST_NOISE = 0.01  # of a reading's: who leaves less fits readings that were made up, which no instrument has bent


def seen_through_instruments(fit: Fit, searches: Searches) -> Fit | None:
    """The same model with the values that leave the least beyond errors of instruments, and their standard errors.

    `searches` are those of the fit. None where no instrument may err; where the model leaves more than noise beyond
    them, or these values deny a stated one or ask more of an instrument than it may err by, for then it lacks something
    that matters more; where it leaves next to nothing; where errors are too many to be held in memory; and of motions,
    whose rows are costly. Residual and slopes are those of the readings, as in every fit.
    """
    errors, count = fit.errors, len(fit.samples)
    moves = any(block.steps for block in fit.problem.blocks)
    if moves or not fit.free or not errors.count or count * errors.count > MOST_NUMBERS:
        return None
    noise = rms(left_beyond(fit.residual / fit.samples.sigma, fit.slopes[:count], errors))
    if not LEAST_NOISE < noise < UNBENT.noise:
        return None
    white = white_noise(noise**2)
    near = _sought(fit, searches, white)  # beside noise that fades a sharp bend has many valleys
    fading = None if near is None else noise_of(near)
    found = None if near is None or fading is None else _sought(near, searches, fading)
    if near is None or found is None or fading is None or np.any(np.abs(found.prior_rows) > BELIEVED):
        return None
    if max(asked_of_instruments(near, white), asked_of_instruments(found, fading)) > MOST_ASKED:
        return None
    return replace(found, robust=_at_least(found.robust, near.robust))


def _sought(fit: Fit, searches: Searches, noise: Noise) -> Fit | None:
    """The values that leave the least beyond instruments and such noise, sought from those of a fit on.

    None where no finite numbers were met, or no end in so many steps. From a place where a size of the muscle stands at
    its limit the dogleg crawls along that limit (500 evaluations without an end), where the reflective steps take 12;
    these stop short of every limit, which the dogleg then finds.
    """
    subset = subset_of(fit.layout, fit.vector, fit.free)
    seen = _Seen(searches, subset, fit, noise)
    slopes: Any = seen.slopes  # scipy's own types admit the name of a scheme alone
    search = partial(least_squares, seen.rows, jac=slopes, bounds=(0.0, 1.0), max_nfev=MOST_STEPS)
    near = search(np.asarray(subset.place(fit.vector)), method="trf")
    found = search(near.x, method="dogbox")
    ended = np.isfinite(found.cost) and near.status > 0 and found.status > 0
    return _recorded(fit, seen, found.x) if ended else None


def asked_of_instruments(fit: Fit, noise: Noise) -> float:
    """The largest of the most likely errors that these values ask of an instrument, in accuracies.

    Some thousand readings that a law of a slightly wrong shape misses weigh more than one error of a whole run that is
    ten times as large as it may be: values then leave the shape right, and the friction of every run wrong.
    """
    without_noise = _without_noise(fit, noise)
    known = fit.errors.changed(without_noise(fit.errors.per_run), without_noise(fit.errors.shared))
    return known.likeliest(without_noise(fit.residual / fit.samples.sigma))[1]


def _without_noise(fit: Fit, noise: Noise) -> Whitener:
    """What takes such noise's correlation out of the rows of a fit."""
    parts = stretches(fit.samples)
    return Whitener.of(noise, fit.samples, np.repeat(np.arange(len(parts)), [part.stop - part.start for part in parts]))


class _Seen:
    """Rows and slopes at places of the unit box: of measurements as instruments let them be seen, and of priors."""

    def __init__(self, searches: Searches, subset: Subset, fit: Fit, noise: Noise) -> None:
        self.searches, self.subset, self.count = searches, subset, len(fit.samples)
        self.without_noise = _without_noise(fit, noise)
        known = fit.errors.changed(self.without_noise(fit.errors.per_run), self.without_noise(fit.errors.shared))
        self.without_errors = known.whitener()
        self.at = latest_kept(self._looked_at)  # rows and slopes as they were measured

    def _looked_at(self, place: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        at = self.searches.at(self.subset, place).at(self.searches.standard.rows)
        return np.asarray(at.rows), np.asarray(at.slopes)

    def through(self, columns: np.ndarray) -> np.ndarray:
        """Rows (rows,) or columns (rows, q): of measurements what neither noise nor instruments make alike of them."""
        return np.concatenate([self.without_errors(self.without_noise(columns[: self.count])), columns[self.count :]])

    def rows(self, place: np.ndarray) -> np.ndarray:
        """What a search makes small."""
        return self.through(self.at(place)[0])

    def slopes(self, place: np.ndarray) -> np.ndarray:
        """Its slopes; none where one is no finite number."""
        return self.through(np.nan_to_num(self.at(place)[1], posinf=0.0, neginf=0.0))


def _at_least(covariance: np.ndarray, least: np.ndarray) -> np.ndarray:
    """A covariance (k, k) in which no variance is below that of another.

    How noise fades is an estimate, and where it is taken for more than it is, values seem to be known better than they
    are: each error is the larger of those beside noise that fades and beside noise that does not.
    """
    times = np.sqrt(np.maximum(np.diag(least) / np.maximum(np.diag(covariance), 1e-300), 1.0))
    return covariance * np.outer(times, times)


def noise_of(fit: Fit) -> Noise:
    """What a fit leaves beside what its parameters and instruments can make, however large they are."""
    slopes = fit.slopes[: len(fit.samples)]
    return Kinds.after_removal(slopes, fit.samples).noise_beside(fit.residual / fit.samples.sigma, slopes, fit.errors)


def _recorded(fit: Fit, seen: _Seen, place: np.ndarray) -> Fit:
    """The fit with these values; its standard errors are those of rows that are seen through the instruments."""
    rows, slopes = seen.at(place)
    per_unit, count = slopes / np.asarray(seen.subset.slope(place)), seen.count
    seen_rows, seen_slopes = seen.through(rows), seen.through(per_unit)
    covariance, robust = spread_of_values(fit.layout, fit.free, fit.samples, seen_rows, seen_slopes)
    return replace(
        fit,
        vector=np.asarray(seen.subset.vector(place)),
        residual=rows[:count] * fit.samples.sigma,
        slopes=per_unit,
        covariance=covariance,
        robust=robust,
        at_bound=at_bound(fit.free, place),
        through=None,
    )
