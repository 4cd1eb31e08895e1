"""A fitted model seen through its instruments: the values that it has where each of them may err within its accuracy.

The curve of least error follows the errors of instruments, too: a gain that is off by a percent moved the stiffness of
a spring by forty. Where such errors and noise explain all that a fit leaves, the values that leave the least beyond
them are the likelier ones. The search begins at the curve of least error and asks for nothing but its rows and slopes,
which are compiled already; scipy's `least_squares` asks so, and keeps to the ranges.
"""

from dataclasses import replace
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from fitting.instruments.errors import InstrumentErrors
from fitting.least_squares.held_out import rms
from fitting.least_squares.record import Fit, spread_of_values
from fitting.least_squares.searches import Searches
from fitting.least_squares.subset import Subset, subset_of
from fitting.least_squares.unbent import MOST_NUMBERS, UNBENT, left_beyond
from fitting.least_squares.uncertainty import at_bound

LEAST_NOISE = 0.01  # of a reading's: who leaves less fits readings that were made up, which no instrument has bent


def seen_through_instruments(fit: Fit, searches: Searches) -> Fit | None:
    """The same model with the values that leave the least beyond errors of instruments, and their standard errors.

    `searches` are those of the fit. None where no instrument may err, where the model leaves more than noise beyond
    them, for then it lacks something that matters more, or next to nothing, or where errors are too many to be held in
    memory; and of motions, whose rows are costly. Residual and slopes are those of the readings, as in every fit.
    """
    errors, count = fit.errors, len(fit.samples)
    moves = any(block.steps for block in fit.problem.blocks)
    if moves or not fit.free or not errors.count or count * errors.count > MOST_NUMBERS:
        return None
    noise = rms(left_beyond(fit.residual / fit.samples.sigma, fit.slopes[:count], errors))
    if not LEAST_NOISE < noise < UNBENT.noise:
        return None
    subset = subset_of(fit.layout, fit.vector, fit.free)
    seen = _Seen(searches, subset, errors, noise)
    begin = np.asarray(subset.place(fit.vector))
    slopes: Any = seen.slopes  # scipy's own types admit the name of a scheme alone
    found = least_squares(seen.rows, begin, slopes, bounds=(0.0, 1.0), method="dogbox")
    return _recorded(fit, seen, found.x) if np.isfinite(found.cost) else None


class _Seen:
    """Rows and slopes at places of the unit box: of measurements as instruments let them be seen, and of priors."""

    def __init__(self, searches: Searches, subset: Subset, errors: InstrumentErrors, noise: float) -> None:
        self.searches, self.subset, self.noise, self.count = searches, subset, noise, len(errors.run)
        self.white = errors.changed(errors.per_run / noise, errors.shared / noise).whitener()
        self._latest: tuple[bytes, tuple[np.ndarray, np.ndarray]] | None = None

    def at(self, place: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Rows and slopes as they were measured; of one place they are asked for twice in turn."""
        key = place.tobytes()
        if self._latest is None or self._latest[0] != key:
            at = self.searches.at(self.subset, place).at(self.searches.standard.rows)
            self._latest = key, (np.asarray(at.rows), np.asarray(at.slopes))
        return self._latest[1]

    def through(self, columns: np.ndarray) -> np.ndarray:
        """Rows (rows,) or columns (rows, q) of measurements through instruments, in units of the noise."""
        return np.concatenate([self.white(columns[: self.count]) / self.noise, columns[self.count :]])

    def rows(self, place: np.ndarray) -> np.ndarray:
        """What a search makes small."""
        return self.through(self.at(place)[0])

    def slopes(self, place: np.ndarray) -> np.ndarray:
        """Its slopes; none where one is no finite number."""
        return self.through(np.nan_to_num(self.at(place)[1], posinf=0.0, neginf=0.0))


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
