"""What data say about a parameter that ends at an end of its range: from which value on, or up to which, they allow it.

There the error to first order means nothing: a search ends at the end because no value inside is better, often since
the readings hardly change any more on the way there. What data do exclude is the other end of the range. A value is
excluded where, with the parameter held there and all others fitted, one step to first order leads back by more than
1.645 of its robust standard errors (a score test, one-sided, at 95 %); or where the sum of squares has risen by as
much, which tells where slopes have vanished and no step leads anywhere. On the way from the bound the first value that
is excluded counts.
"""

from dataclasses import dataclass
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np
from scipy.optimize import brentq, least_squares

from fitting.least_squares.latest import latest_kept
from fitting.least_squares.record import Fit
from fitting.least_squares.run_differences import as_runs_show
from fitting.least_squares.search import Evaluated
from fitting.least_squares.searches import Alone, cost_of
from fitting.least_squares.subset import subset_of
from fitting.least_squares.uncertainty import spread_of_values


@dataclass(frozen=True)
class OneSidedSettings:
    """Settings of one-sided limits. All were chosen but `errors`, which is derived."""

    level: float = 0.95
    errors: float = 1.645  # standard errors, of a normal distribution at that level
    ways: tuple[float, ...] = (0.1, 0.3, 0.6, 1.0)  # from the bound: where an excluded value is looked for
    close: float = 0.01  # of the way from the bound: so well is a limit sought
    steps: int = 20  # of that search, and of each fit of the others
    most: float = 100.0  # standard errors: as excluded as a value needs to be


ONE_SIDED = OneSidedSettings()


@dataclass(frozen=True)
class OneSided:
    """What the data allow: at least a `limit`, or at most one, in SI; or a value beyond the end of the range."""

    is_least: bool
    limit: float | None  # None where they allow every value of the range, or ask for one beyond
    is_beyond: bool = False


_KNOWN: WeakKeyDictionary[Fit, dict[str, OneSided]] = WeakKeyDictionary()  # tables, warnings, JSON ask for the same


def one_sided(fit: Fit) -> dict[str, OneSided]:
    """What the data allow of each effect's parameter that ends at its bound, by full name.

    Sizes that are stated with errors are left out, for they are held to what was stated; and motions, whose rows are
    costly: each limit takes some hundred looks at the model.
    """
    if fit not in _KNOWN:
        _KNOWN[fit] = _found(fit)
    return _KNOWN[fit]


def _found(fit: Fit) -> dict[str, OneSided]:
    names = [name for name in fit.at_bound if fit.layout.entry(name).prior is None]
    if not names or any(block.steps for block in fit.problem.blocks):
        return {}
    searches = Alone.of(fit.problem)
    found = {name: _Way(fit, searches, name).allowed() for name in names}
    return {name: known for name, known in found.items() if known is not None}


class _Way:
    """The way of one parameter through its range, from the bound at which it ended, with all others fitted."""

    def __init__(self, fit: Fit, searches: Alone, name: str) -> None:
        self.fit, self.searches, self.i = fit, searches, fit.free.index(name)
        self.subset = subset_of(fit.layout, fit.vector, fit.free)
        self.start = np.asarray(self.subset.place(fit.vector))
        self.others = np.arange(len(self.start)) != self.i
        self.is_upper = bool(self.start[self.i] > 0.5)
        errors = fit.error(name), fit.error(name, robust=False)
        self.times = errors[0] / errors[1] if 0 < errors[1] <= errors[0] < np.inf else 1.0
        self._at = latest_kept(self._looked_at)  # rows and slopes at a place
        self._fits: dict[float, Evaluated] = {}
        self._excesses: dict[float, float] = {}

    def allowed(self) -> OneSided | None:
        """What the data allow; None where they deny the bound itself, as those that a saved model was not fitted to."""
        back = self._step_back(self._fitted(0.0))
        if not back >= -ONE_SIDED.errors:
            return None
        if back > ONE_SIDED.errors:
            return OneSided(self.is_upper, None, is_beyond=True)
        before = 0.0
        for way in ONE_SIDED.ways:
            if self.excess(way) > 0:
                near: Any = {"xtol": 1e-9, "rtol": ONE_SIDED.close, "maxiter": ONE_SIDED.steps}
                limit: Any = brentq(self.excess, before, way, disp=False, **near)
                return OneSided(self.is_upper, float(self._vector(limit)[self.subset.free[self.i]]))
            before = way
        return OneSided(self.is_upper, None)

    def excess(self, way: float) -> float:
        """By how many standard errors more than the limit allows the data exclude a value so far on the way."""
        if way not in self._excesses:
            at = self._fitted(way)
            found = max(self._step_back(at), self._risen(at))  # not a number where the model gives none
            self._excesses[way] = min(np.nan_to_num(found, nan=ONE_SIDED.most), ONE_SIDED.most) - ONE_SIDED.errors
        return self._excesses[way]

    def _risen(self, at: Evaluated) -> float:
        """The rise of the sum of squares since the bound, in robust standard errors, were rows straight lines."""
        least = max(cost_of(self._fitted(0.0)), 1e-300)
        freedom = max(len(self.fit.samples) - len(self.fit.free), 1)
        return float(np.sqrt(max(cost_of(at) / least - 1, 0.0) * freedom)) / self.times

    def _step_back(self, at: Evaluated) -> float:
        """How far one step to first order leads back to the bound, in standard errors; 0 where no slope is left."""
        rows, slopes = np.asarray(at.rows), np.asarray(at.slopes)
        if not _is_number(at):
            return float("nan")
        moves = (at.place > 0) & (at.place < 1)
        moves[self.i] = True
        step = np.zeros(len(at.place))
        step[moves] = np.linalg.lstsq(slopes[:, moves], -rows, rcond=1e-12)[0]
        error = self._error(at.place, rows + slopes @ step, slopes)
        return float(step[self.i]) * (1 if self.is_upper else -1) / error if error > 0 else 0.0

    def _vector(self, way: float) -> np.ndarray:
        """All unknowns, SI, with the parameter so far on its way."""
        return self.subset.vector(self._place(way, self.start))

    def _place(self, way: float, begin: np.ndarray) -> np.ndarray:
        """A place in the unit box with the parameter so far on its way."""
        place = begin.copy()
        place[self.i] = 1 - way if self.is_upper else way
        return place

    def _fitted(self, way: float) -> Evaluated:
        """Rows and slopes where the others fit best, sought from the nearest of those that are known."""
        if way not in self._fits:
            nearest = min(self._fits, key=lambda known: abs(known - way), default=None)
            begin = self.start if nearest is None else np.asarray(self._fits[nearest].place)
            self._fits[way] = self._others_fitted(self._place(way, begin))
        return self._fits[way]

    def _others_fitted(self, place: np.ndarray) -> Evaluated:
        at = self._at(place)
        if not (self.others.any() and _is_number(at)):
            return at

        def seen(values: np.ndarray) -> Evaluated:
            whole = place.copy()
            whole[self.others] = values
            return self._at(whole)

        rows = lambda values: np.asarray(seen(values).rows)  # noqa: E731
        slopes = lambda values: np.nan_to_num(np.asarray(seen(values).slopes)[:, self.others], posinf=0.0, neginf=0.0)  # noqa: E731
        asked: Any = {"jac": slopes, "max_nfev": ONE_SIDED.steps}  # scipy's types admit the name of a scheme alone
        return seen(least_squares(rows, place[self.others], bounds=(0.0, 1.0), method="dogbox", **asked).x)

    def _looked_at(self, place: np.ndarray) -> Evaluated:
        return self.searches.at(self.subset, place).at(self.searches.standard.rows)

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
