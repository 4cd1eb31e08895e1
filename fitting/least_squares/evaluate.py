"""A model at given values: the same record as a fit's, without a search."""

from collections.abc import Sequence

import jax.numpy as jnp
import numpy as np

from fitting.least_squares.fit import Fit, seen
from fitting.least_squares.held_out import REFIT_BELOW, folds, left_out_rows
from fitting.least_squares.search import rows_and_slopes, solve
from fitting.least_squares.subset import subset_of
from fitting.least_squares.uncertainty import at_bound, clusters, covariances, ties
from fitting.precision import require_x64
from fitting.problem.no_number import refuse_no_number
from fitting.problem.residuals import LIGHT, problem
from fitting.problem.unknowns import unknowns
from fitting.recordings.records import Experiment
from mckibben_jax.effect import Effect


def evaluate(
    experiments: Sequence[Experiment],
    effects: Sequence[Effect],
    values: dict[str, float],
    free: Sequence[str],
    own: Sequence[str] = (),
) -> Fit:
    """The model at `values` (SI; the rest as declared and measured), with its slopes along the `free` names.

    InputError where it gives no finite number.
    """
    require_x64()
    layout = unknowns(experiments, effects, own)
    given, samples = problem(experiments, layout)
    vector = np.array([values.get(name, start) for name, start in zip(layout.names, layout.start, strict=True)])
    names = seen(given, subset_of(layout, vector, free), tuple(free)) if free else ()
    subset = subset_of(layout, vector, names)
    if names:
        rows, slopes = map(np.asarray, rows_and_slopes(given, subset, subset.place(subset.full)))
    else:
        rows = np.asarray(given.rows(subset.full, subset.switches, None))
        slopes = np.zeros((len(rows), 0))
    refuse_no_number(rows[: len(samples)], samples, experiments)
    place = subset.place(subset.full)
    per_unit = slopes / np.asarray(subset.slope(place))
    count = len(samples)
    covariance, robust = covariances(per_unit[:count], rows[:count], per_unit[count:], clusters(samples, per_unit))
    return Fit(
        layout=layout,
        problem=given,
        samples=samples,
        free=names,
        held=tuple(name for name in free if name not in names),
        vector=vector,
        switches=np.asarray(subset.switches),
        residual=rows[:count] * samples.sigma,
        slopes=per_unit,
        covariance=covariance,
        robust=robust,
        at_bound=at_bound(names, np.asarray(place)),
        tied=ties(names, slopes),
        converged=True,
        starts="evaluated, not fitted",
        failures=(),
    )


def left_out(fit: Fit) -> np.ndarray:
    """The residual of each run under the parameters fitted without it, as the fit's samples."""
    count, group = len(fit.samples), folds(fit.samples)
    if count < REFIT_BELOW and fit.free:
        return _refitted(fit, group) * fit.samples.sigma
    priors = np.asarray(fit.problem.prior_rows(jnp.asarray(fit.vector)))
    rows = left_out_rows(fit.residual / fit.samples.sigma, fit.slopes[:count], priors, fit.slopes[count:], group)
    return rows * fit.samples.sigma


def _refitted(fit: Fit, group: np.ndarray) -> np.ndarray:
    """The rows of each group in a fit of all others."""
    subset = subset_of(fit.layout, fit.vector, fit.free)
    start = subset.place(subset.full)[None]
    rows = fit.residual / fit.samples.sigma
    for g in np.unique(group):
        mine = group == g
        rows[mine] = np.asarray(solve(fit.problem.without(mine), subset, start).rows)[: len(rows)][mine] * LIGHT
    return rows


def left_out_rmse(fit: Fit) -> float:
    """The fit's root mean square error on runs left out of it, in the unit of its own."""
    return float(np.sqrt(np.mean(left_out(fit)[fit.problem.of_force(fit.samples)] ** 2)))


def rmse_at_pressures(fit: Fit, shift: float) -> float:
    """The error of the model fitted again with so much (Pa) more in every reading of the pressure."""
    given = fit.problem.shifted(shift)
    subset = subset_of(fit.layout, fit.vector, fit.free)
    if fit.free:
        rows = solve(given, subset, subset.place(subset.full)[None]).rows
    else:
        rows = given.rows(subset.full, subset.switches, None)
    residual = np.asarray(rows)[: len(fit.samples)] * fit.samples.sigma
    return float(np.sqrt(np.mean(residual[given.of_force(fit.samples)] ** 2)))
