"""What data say about a parameter that ends at an end of its range: from which value on, or up to which, they allow it.

There the error to first order means nothing: a search ends at the end because no value inside is better, often since
the readings hardly change any more on the way there. What data do exclude is the other end of the range. A value is
excluded where, with the parameter held there and all others fitted, one step to first order leads back by more than
1.645 of its robust standard errors (a score test, one-sided, at 95 %); or, where slopes have vanished and no step leads
anywhere, where the sum of squares has risen by as much.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from scipy.optimize import brentq, least_squares

from fitting.least_squares.record import Fit
from fitting.least_squares.run_differences import as_runs_show
from fitting.least_squares.search import Evaluated
from fitting.least_squares.searches import Alone, cost_of
from fitting.least_squares.subset import subset_of
from fitting.least_squares.uncertainty import spread_of_values


@dataclass(frozen=True)
class OneSidedSettings:
    """Settings of one-sided limits."""

    level: float = 0.95
    errors: float = 1.645  # standard errors, of a normal distribution at that level
    close: float = 0.01  # of the way from the bound: so well is a limit sought
    most: float = 100.0  # standard errors: as excluded as a value needs to be


ONE_SIDED = OneSidedSettings()


@dataclass(frozen=True)
class OneSided:
    """The end of what the data allow: a least value, or a largest; in SI."""

    is_least: bool
    limit: float | None  # None where they allow every value of the range


@lru_cache(4)  # table, warnings and JSON ask for the same
def one_sided(fit: Fit) -> dict[str, OneSided]:
    """What the data allow of each effect's parameter that ends at its bound, by full name.

    Sizes that are stated with errors are left out: they are held to what was stated. It takes some dozens of looks at
    the model.
    """
    names = [name for name in fit.at_bound if fit.layout.entry(name).prior is None]
    if not names:
        return {}
    searches = Alone.of(fit.problem)
    found = {name: _Held(fit, searches, name).allowed() for name in names}
    return {name: known for name, known in found.items() if known is not None}


class _Held:
    """One parameter held on the way through its range, from the bound at which it ended, all others fitted."""

    def __init__(self, fit: Fit, searches: Alone, name: str) -> None:
        self.fit, self.searches, self.i = fit, searches, fit.free.index(name)
        self.subset = subset_of(fit.layout, fit.vector, fit.free)
        self.place = np.asarray(self.subset.place(fit.vector))
        self.is_upper = bool(self.place[self.i] > 0.5)
        self.cost = max(0.5 * fit.cost, 1e-300)
        self.freedom = max(len(fit.samples) - len(fit.free), 1)
        errors = fit.error(name), fit.error(name, robust=False)
        self.times = errors[0] / errors[1] if 0 < errors[1] <= errors[0] < np.inf else 1.0

    def allowed(self) -> OneSided | None:
        """The end of what the data allow; None where they do not even allow the bound, for no search ended there."""
        if not self.excess(0.0) <= 0:
            return None
        if self.excess(1.0) <= 0:
            return OneSided(self.is_upper, None)
        near: Any = {"xtol": 1e-9, "rtol": ONE_SIDED.close}
        way: Any = brentq(self.excess, 0.0, 1.0, disp=False, **near)
        return OneSided(self.is_upper, float(self.subset.vector(self._at(way))[self.subset.free[self.i]]))

    def excess(self, way: float) -> float:
        """By how many standard errors more than the limit allows the data exclude a value so far on the way."""
        at = self._fitted(self._at(way))
        if not _is_number(at):
            return ONE_SIDED.most
        back, risen = self._step_back(at), np.sqrt(max(cost_of(at) / self.cost - 1, 0.0) * self.freedom) / self.times
        return min(max(back, float(risen)), ONE_SIDED.most) - ONE_SIDED.errors

    def _step_back(self, at: Evaluated) -> float:
        """How far one step to first order leads back to the bound, in standard errors; 0 where no slope is left."""
        rows, slopes = np.asarray(at.rows), np.asarray(at.slopes)
        moves = (at.place > 0) & (at.place < 1)
        moves[self.i] = True
        step = np.zeros(len(at.place))
        step[moves] = np.linalg.lstsq(slopes[:, moves], -rows, rcond=1e-12)[0]
        error = self._error(at.place, rows + slopes @ step, slopes)
        return float(step[self.i]) * (1 if self.is_upper else -1) / error if error > 0 else 0.0

    def _at(self, way: float) -> np.ndarray:
        """The latest place, with the parameter so far from its bound."""
        place = self.place.copy()
        place[self.i] = 1 - way if self.is_upper else way
        return place

    def _fitted(self, place: np.ndarray) -> Evaluated:
        """Rows and slopes where the others fit best; the next search begins there."""
        others = np.arange(len(place)) != self.i

        def at(values: np.ndarray) -> Evaluated:
            whole = place.copy()
            whole[others] = values
            return self.searches.at(self.subset, whole).at(self.searches.standard.rows)

        first = at(place[others])
        if not (others.any() and _is_number(first)):
            return first
        rows, slopes = lambda x: np.asarray(at(x).rows), lambda x: np.nan_to_num(np.asarray(at(x).slopes)[:, others])
        given: Any = {"jac": slopes}  # scipy's own types admit the name of a scheme alone
        self.place[others] = least_squares(rows, place[others], bounds=(0.0, 1.0), method="dogbox", **given).x
        return at(self.place[others])

    def _error(self, place: np.ndarray, rows: np.ndarray, slopes: np.ndarray) -> float:
        """The parameter's robust standard error there, as a share of its range."""
        fit, count, slope = self.fit, len(self.fit.samples), np.asarray(self.subset.slope(place))
        unit = slopes / slope
        errors = as_runs_show(fit.errors, fit.samples.dataset, unit[:count], rows, unit[count:])
        _, robust = spread_of_values(fit.layout, fit.free, fit.samples, rows, unit, errors)
        return float(np.sqrt(robust[self.i, self.i]) / slope[self.i])


def _is_number(at: Evaluated) -> bool:
    """Whether all rows and slopes are finite numbers."""
    return bool(np.all(np.isfinite(at.rows)) and np.all(np.isfinite(at.slopes)))
