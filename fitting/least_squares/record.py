"""A fitted model as a record: its values, how well they are known, and how the search for them ended."""

from collections.abc import Sequence
from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np

from fitting.instruments.errors import InstrumentErrors
from fitting.least_squares.run_differences import as_runs_show
from fitting.least_squares.search import Evaluated
from fitting.least_squares.subset import Subset
from fitting.least_squares.summary import Failure, SearchSummary
from fitting.least_squares.uncertainty import at_bound, repeatable_spread, spread_of_values, ties
from fitting.problem.estimate import Estimate, ParameterState
from fitting.problem.residuals import Problem, Samples
from fitting.problem.unknowns import Unknowns

NOT_SEARCHED = SearchSummary()


@dataclass(frozen=True, eq=False)  # two fits are never compared, and what is found out about one is kept for that one
class Fit:
    """A fitted model with all that is known of how well it is known. Arrays over `free` are in that order."""

    layout: Unknowns
    problem: Problem
    samples: Samples
    free: tuple[str, ...]
    held: tuple[str, ...]  # asked to vary, but these data cannot see them
    vector: np.ndarray
    switches: np.ndarray
    residual: np.ndarray  # model minus measurement in the recording's unit, as `samples`
    slopes: np.ndarray  # rows over free, in standard deviations per unit of the parameter
    errors: InstrumentErrors  # what instruments within their accuracy can do to the rows, as `samples`
    covariance: np.ndarray  # were samples independent
    robust: np.ndarray  # to what a loop or a run shares, and to errors of instruments
    repeatable: np.ndarray  # the same for more readings of this muscle on this rig: nothing errs anew
    at_bound: tuple[str, ...]
    tied: dict[str, tuple[str, ...]]
    converged: bool
    search: SearchSummary
    failures: tuple[Failure, ...]
    through: "Fit | None" = None  # the same model where instruments may err, if that is all that it leaves

    @property
    def rmse(self) -> float:
        """Root mean square error of the samples that measure force, N (of positions, m, where there are only those)."""
        return float(np.sqrt(np.mean(self.residual[self.problem.of_force(self.samples)] ** 2)))

    @property
    def over_noise(self) -> float:
        """How many times the noise of one reading the model misses the readings by, root mean square."""
        return float(np.sqrt(np.mean((self.residual / self.samples.sigma) ** 2)))

    @property
    def cost(self) -> float:
        """What the fit has minimised: the sum of squares, in standard deviations, of measurements and priors."""
        return float(np.sum((self.residual / self.samples.sigma) ** 2) + np.sum(self.prior_rows**2))

    @property
    def prior_rows(self) -> np.ndarray:
        """How far each stated value is from what was stated, in its standard errors (values,)."""
        given = self.problem
        at, mean, error = map(np.asarray, (given.prior_at, given.prior_mean, given.prior_sd))
        return (np.asarray(self.vector)[at] - mean) / error

    @property
    def values(self) -> dict[str, float]:
        """Every unknown by its full name, SI."""
        return dict(zip(self.layout.names, map(float, self.vector), strict=True))

    def model(self, dataset: int = 0):
        """The fitted model of one data set."""
        return self.layout.model(jnp.asarray(self.vector), dataset)

    def error(self, name: str, robust: bool = True) -> float:
        """Standard error of a free parameter, SI; NaN for one that did not vary."""
        if name not in self.free:
            return float("nan")
        i = self.free.index(name)
        return float(np.sqrt((self.robust if robust else self.covariance)[i, i]))

    def estimate(self, name: str) -> Estimate:
        """An unknown's value, robust standard error (NaN for one that did not vary) and unit."""
        return Estimate(self.values[name], self.error(name), self.layout.entry(name).unit)

    def state(self, name: str) -> ParameterState:
        """Whether a value was fitted, was fixed, or was held because the data do not constrain it."""
        if name in self.free:
            return ParameterState.FITTED
        return ParameterState.HELD if name in self.held else ParameterState.FIXED


def record_fit(
    layout: Unknowns,
    given: Problem,
    samples: Samples,
    subset: Subset,
    names: Sequence[str],
    at: Evaluated,
    *,
    errors: InstrumentErrors | None = None,
    held: tuple[str, ...] = (),
    converged: bool = True,
    search: SearchSummary = NOT_SEARCHED,
    failures: tuple[Failure, ...] = (),
) -> Fit:
    """The record of a model in which `names` vary, where it was evaluated: every `Fit` is made here.

    Rows and slopes have to be finite numbers, unless nothing varies. Without `errors` every reading is trusted.
    """
    place, rows, slopes = map(np.asarray, at)
    count, per_unit = len(samples), slopes / np.asarray(subset.slope(place))
    errors = InstrumentErrors.none(samples.run) if errors is None else errors
    parts = layout, names, samples, rows, per_unit
    shown = as_runs_show(errors, samples.dataset, per_unit[:count], rows, per_unit[count:])
    covariance, robust = spread_of_values(*parts, shown)
    return Fit(
        layout=layout,
        problem=given,
        samples=samples,
        free=tuple(names),
        held=held,
        vector=np.asarray(subset.vector(at.place)),
        switches=np.asarray(subset.switches),
        residual=rows[:count] * samples.sigma,
        slopes=per_unit,
        errors=errors,
        covariance=covariance,
        robust=robust,
        repeatable=repeatable_spread(*parts),
        at_bound=at_bound(names, place),
        tied=ties(names, slopes),
        converged=converged,
        search=search,
        failures=failures,
    )
