"""A model at given values: the same record as a fit's, without a search."""

from collections.abc import Sequence

import numpy as np

from fitting.least_squares.held_out import HELD_OUT, folds, left_out_rows
from fitting.least_squares.instruments import accuracies_of, errors_in
from fitting.least_squares.record import Fit, record_fit
from fitting.least_squares.refits import without_each
from fitting.least_squares.search import Evaluated
from fitting.least_squares.searches import Alone
from fitting.least_squares.starts import constrained_names
from fitting.least_squares.subset import subset_of
from fitting.least_squares.summary import SearchSummary
from fitting.precision import require_x64
from fitting.problem.no_number import refuse_no_number
from fitting.problem.residuals import problem
from fitting.problem.unknowns import unknowns
from fitting.recordings.records import Experiment
from mckibben_jax.effect import Effect

NOWHERE = np.zeros(0)  # the place of a fit in which nothing varies


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
    vector = layout.vector_of(values)
    searches, whole = Alone.of(given), subset_of(layout, vector, free)
    names = constrained_names(searches, whole, tuple(free)) if free else ()
    subset, place = subset_of(layout, vector, names), whole.place(whole.full)
    at = _along(searches.at(whole, place).at(searches.standard.rows), [name in names for name in free])
    held = tuple(name for name in free if name not in names)
    refuse_no_number(np.asarray(at.rows)[: len(samples)], samples, experiments)
    errors = errors_in(searches, layout, whole, vector, samples, accuracies_of(experiments)) if names else None
    return record_fit(
        layout, given, samples, subset, names, at, errors=errors, held=held, search=SearchSummary(evaluated=True)
    )


def _along(at: Evaluated, kept: Sequence[bool]) -> Evaluated:
    """What was evaluated with the slopes along some of the free unknowns alone (a mask)."""
    mask = np.asarray(kept, bool)
    return Evaluated(np.asarray(at.place)[mask], at.rows, np.asarray(at.slopes)[:, mask])


def held_out_residual(fit: Fit) -> np.ndarray:
    """The residual of each run under the parameters fitted without it, as the fit's samples.

    Where this is one step from the whole fit, what stands at its bound stays there, as in a diagnosis.
    """
    count, group = len(fit.samples), folds(fit.samples)
    if count < HELD_OUT.refit_below and fit.free:
        return _refitted(fit, group) * fit.samples.sigma
    slopes = fit.slopes * [name not in fit.at_bound for name in fit.free]
    rows = left_out_rows(fit.residual / fit.samples.sigma, slopes[:count], fit.prior_rows, slopes[count:], group)
    return rows * fit.samples.sigma


def _refitted(fit: Fit, group: np.ndarray) -> np.ndarray:
    """The rows of each group in a fit of all others."""
    rows = fit.residual / fit.samples.sigma
    parts = [group == g for g in np.unique(group)]
    for mine, (_, left) in zip(parts, without_each(fit, parts), strict=True):
        rows[mine] = left[mine]
    return rows


def held_out_rmse(fit: Fit) -> float:
    """The fit's root mean square error on held-out runs, in the unit of its own."""
    return float(np.sqrt(np.mean(held_out_residual(fit)[fit.problem.of_force(fit.samples)] ** 2)))


def rmse_at_pressures(fit: Fit, shift: float) -> float:
    """The error of the model fitted again with so much (Pa) more in every reading of the pressure."""
    searches = Alone.of(fit.problem.shifted(shift))
    subset = subset_of(fit.layout, fit.vector, fit.free)
    found = searches.search(subset, subset.place(subset.full)[None]).best if fit.free else searches.at(subset, NOWHERE)
    residual = found.at(searches.standard.rows[: len(fit.samples)]).rows * fit.samples.sigma
    return float(np.sqrt(np.mean(residual[fit.problem.of_force(fit.samples)] ** 2)))
