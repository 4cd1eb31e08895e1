"""A form for what no effect of the library explains: a few terms for the misfit, found by sparse regression.

Orthogonal matching pursuit picks terms one by one, beside the model's own parameters, which readjust. The picking is
repeated without each run, and the terms picked predict the run that was not seen. Only if that error falls by clearly
more than its standard error is anything proposed: noise that is correlated within a run makes terms fit, but not fall.
"""

import shlex
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import stats
from scipy.optimize import least_squares
from threadpoolctl import threadpool_limits

from fitting.diagnosis.proposal_terms import STATES, Term, line_of, terms
from fitting.diagnosis.record import Diagnosis
from fitting.errors import InputError
from fitting.least_squares.held_out import difference, folds
from fitting.least_squares.record import Fit
from fitting.library.line import VARIABLES, defined_name
from mckibben_jax.state import State

MOST_TERMS = 3
MOST_ROWS = 3000
LEVEL = 0.01  # how often chance may lower the left-out error by as much: that of the test for missing effects
SURE = 2.0  # standard errors by which one more term must lower it further
FEWEST_RUNS = 4
POLISH = 15  # evaluations of slopes that a hidden shape is given to move off its grid
SWALLOWED = 1e-3  # of a term's square: what the model's parameters must leave for it to be a term of its own


@dataclass(frozen=True)
class Proposal:
    """A form for the misfit, or why there is none. Errors in N, on runs left out of picking and fitting alike."""

    line: str | None  # for --define
    terms: tuple[str, ...] = ()
    before: float | None = None
    after: float | None = None
    fall: float | None = None  # of the mean square, in its standard errors
    runs: int = 0  # left out one after the other
    reason: str = ""

    def command(self, data: Sequence[str]) -> str:
        """What puts it into the model, to be pasted; empty where nothing is proposed."""
        if self.line is None:
            return ""
        return f'mckibben add {shlex.join(data)} {defined_name(self.line)} --define "{self.line}"'


@dataclass(frozen=True)
class Misfit:
    """What is left of a fit, in standard deviations: rows, the slopes that can readjust, priors, the states, runs."""

    rows: np.ndarray
    slopes: np.ndarray
    prior_rows: np.ndarray
    prior_slopes: np.ndarray
    sigma: np.ndarray
    states: STATES
    group: np.ndarray  # which rows are left out together

    def columns(self, terms: Sequence[Term]) -> np.ndarray:
        """How the rows change with the amplitude of each term."""
        return np.stack([term.column(self.states) for term in terms], axis=1) / self.sigma[:, None]

    def where(self, mask: np.ndarray) -> "Misfit":
        """Only some rows, and the priors."""
        states = {name: value[mask] for name, value in self.states.items()}
        kept = (self.rows[mask], self.slopes[mask], self.prior_rows, self.prior_slopes, self.sigma[mask])
        return Misfit(*kept, states, self.group[mask])


def proposed(found: Diagnosis, progress: Callable[[str, float], None]) -> Proposal:
    """A form for what a diagnosis could not name."""
    if found.verdict != "not in the library":
        return Proposal(
            None, reason=f"a form is proposed only where nothing in the library fits, not at '{found.verdict}'"
        )
    progress("looking for a form", 0.95)
    with threadpool_limits(1, "blas"):
        return propose(misfit_of(found.baseline), name_for(found.baseline))


def name_for(fit: Fit) -> str:
    """A name that the model does not have."""
    taken = fit.layout.templates[0].names
    names = ("proposal", *(f"proposal_{number}" for number in range(2, len(taken) + 3)))
    return next(name for name in names if name not in taken)


def misfit_of(fit: Fit) -> Misfit:
    """What a fit leaves of its forces, thinned."""
    rows = np.flatnonzero(fit.problem.of_force(fit.samples))
    rows = rows[:: int(np.ceil(len(rows) / MOST_ROWS))]
    samples, count = fit.samples.where(rows), len(fit.samples)
    lengths = np.array([float(fit.model(d).muscle.length) for d in range(len(fit.layout.templates))])
    states: dict[str, np.ndarray] = {name: np.zeros(len(rows)) for name in VARIABLES}
    for d in range(len(lengths)):
        mine = samples.dataset == d
        at = State(samples.contraction[mine], samples.pressure[mine], samples.rate[mine], time=samples.time[mine])
        for name, variable in VARIABLES.items():
            states[name][mine] = np.asarray(variable.at(fit.model(d).muscle, at))
    return Misfit(
        fit.residual[rows] / samples.sigma,
        fit.slopes[rows],
        fit.prior_rows,
        fit.slopes[count:],
        samples.sigma,
        states,
        folds(samples),
    )


def propose(misfit: Misfit, name: str = "proposal") -> Proposal:
    """The few terms that predict runs which had no part in picking them, or why there are none."""
    groups = np.unique(misfit.group)
    if len(groups) < FEWEST_RUNS:
        return Proposal(
            None, runs=len(groups), reason=f"it takes {FEWEST_RUNS} runs to leave one out, not {len(groups)}"
        )
    pool = terms(misfit.states)
    columns = misfit.columns(pool)
    known = np.all(np.isfinite(columns), axis=0) & np.any(columns != 0, axis=0)
    pool, columns = [term for term, ok in zip(pool, known, strict=True) if ok], columns[:, known]
    before, after = predicted(misfit, pool, columns)
    best = _fewest(after, misfit.group)
    fall, error = difference(before, after[best], misfit.group)
    told = {"before": _rmse(before, misfit), "after": _rmse(after[best], misfit), "runs": len(groups)}
    told["fall"] = fall / max(error, 1e-300)
    if not fall > stats.t.isf(LEVEL, len(groups) - 1) * error:
        return Proposal(None, reason="no form lowers the error on runs left out by more than chance would", **told)
    whole = _grams(misfit, columns)[0].sum(axis=0) + _prior_gram(misfit, columns.shape[1])
    chosen = _picked(whole, misfit.slopes.shape[1], best + 1)[-1]
    picked = refined(misfit, [pool[i] for i in chosen])
    amplitudes = _amplitudes(misfit, picked)[misfit.slopes.shape[1] :]
    return Proposal(line_of(name, picked, list(amplitudes)), tuple(term.formula for term in picked), **told)


def _rmse(rows: np.ndarray, misfit: Misfit) -> float:
    return float(np.sqrt(np.mean((rows * misfit.sigma) ** 2)))


def _fewest(after: Sequence[np.ndarray], group: np.ndarray) -> int:
    """The fewest terms beyond which one more does not lower the error by more than its standard error."""
    best = 0
    for more in range(1, len(after)):
        fall, error = difference(after[best], after[more], group)
        if fall > SURE * error:
            best = more
    return best


def predicted(misfit: Misfit, pool: Sequence[Term], columns: np.ndarray) -> tuple[np.ndarray, list[np.ndarray]]:
    """Rows left out, under what was fitted and picked without them: by the model alone, and with 1, 2, ... terms."""
    k = misfit.slopes.shape[1]
    grams, groups = _grams(misfit, columns)
    whole = grams.sum(axis=0) + _prior_gram(misfit, columns.shape[1])
    before, after = misfit.rows.copy(), [misfit.rows.copy() for _ in range(MOST_TERMS)]
    for gram, group in zip(grams, groups, strict=True):
        mine, rest = misfit.group == group, whole - gram
        before[mine] += misfit.slopes[mine] @ _solved(rest[:k, :k], -rest[:k, -1])
        seen, unseen = misfit.where(~mine), misfit.where(mine)
        for number, chosen in enumerate(_picked(rest, k, MOST_TERMS)):
            found = refined(seen, [pool[i] for i in chosen])
            after[number][mine] += np.hstack([unseen.slopes, unseen.columns(found)]) @ _amplitudes(seen, found)
    return before, after


def refined(misfit: Misfit, picked: Sequence[Term]) -> list[Term]:
    """The terms with their hidden shapes moved from the grid to where they leave least."""
    shapes = [shape for term in picked for shape in term.shapes.values()]
    if not shapes:
        return list(picked)
    bounds = np.array([(shape.lower, shape.upper) for shape in shapes]).T

    def left(values: np.ndarray) -> np.ndarray:
        moved = _shaped(picked, values)
        change = _amplitudes(misfit, moved)
        return misfit.rows + np.hstack([misfit.slopes, misfit.columns(moved)]) @ change

    start, scale = np.array([shape.value for shape in shapes]), bounds[1] - bounds[0]
    return _shaped(picked, least_squares(left, start, bounds=bounds, x_scale=scale, max_nfev=POLISH, ftol=1e-4).x)


def _shaped(picked: Sequence[Term], values: np.ndarray) -> list[Term]:
    cuts = np.cumsum([len(term.shapes) for term in picked])[:-1]
    return [term.shaped(own) for term, own in zip(picked, np.split(values, cuts), strict=True)]


def _amplitudes(misfit: Misfit, picked: Sequence[Term]) -> np.ndarray:
    """The change of the model's parameters, and behind it the amplitudes of terms, that leave least of the rows."""
    nothing = np.zeros((len(misfit.prior_rows), len(picked)))
    columns = np.vstack([np.hstack([misfit.slopes, misfit.columns(picked)]), np.hstack([misfit.prior_slopes, nothing])])
    return _solved(columns.T @ columns, -columns.T @ np.concatenate([misfit.rows, misfit.prior_rows]))


def _grams(misfit: Misfit, columns: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Products of slopes, columns and rows among each other, of every group."""
    stacked = np.hstack([misfit.slopes, columns, misfit.rows[:, None]])
    groups = np.unique(misfit.group)
    return np.stack([stacked[misfit.group == g].T @ stacked[misfit.group == g] for g in groups]), groups


def _prior_gram(misfit: Misfit, count: int) -> np.ndarray:
    nothing = np.zeros((len(misfit.prior_rows), count))
    stacked = np.hstack([misfit.prior_slopes, nothing, misfit.prior_rows[:, None]])
    return stacked.T @ stacked


def _picked(gram: np.ndarray, k: int, count: int) -> list[list[int]]:
    """Which terms orthogonal matching pursuit picks, for 1, 2, ... `count` of them, beside k slopes that readjust."""
    omp = require_sparse_regression()
    taken = _solved(gram[:k, :k], gram[:k, k:])
    left = gram[k:, k:] - gram[k:, :k] @ taken
    norms, own = np.sqrt(np.maximum(np.diag(left)[:-1], 0.0)), np.sqrt(np.diag(gram)[k:-1])
    free = np.flatnonzero(norms**2 > SWALLOWED * own**2)
    scaled = left[np.ix_(free, free)] / np.outer(norms[free], norms[free])
    found = []
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of terms that are alike: it stops there
        for number in range(1, min(count, len(free)) + 1):
            coefficients = omp(scaled, -left[free, -1] / norms[free], n_nonzero_coefs=number)
            found.append([int(i) for i in free[np.flatnonzero(coefficients)]])
    return found


def _solved(matrix: np.ndarray, right: np.ndarray) -> np.ndarray:
    scale = 1 / np.sqrt(np.maximum(np.diag(matrix), 1e-300))
    inverse = np.linalg.pinv(matrix * np.outer(scale, scale), rcond=1e-12, hermitian=True)
    return (scale * (inverse @ (scale[:, None] * right.reshape(len(right), -1))).T).T.reshape(right.shape)


def require_sparse_regression() -> Any:
    """The sparse regression, loaded only where a proposal is asked for."""
    try:
        from sklearn.linear_model import orthogonal_mp_gram
    except ImportError:
        cure = "pip install 'mckibben-jax[propose]'"
        raise InputError("a proposal needs the package scikit-learn", cure=cure) from None
    return orthogonal_mp_gram
