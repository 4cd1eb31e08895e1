"""Parameters that differ a little from run to run can look like an effect, and must be allowed for.

Every effect's own parameters may differ by a few percent from run to run before anything is called missing by flips of
loops, and the zero of what is read by the noise of one reading; by less where runs of one state agree better than that.
Where every run has a pressure of its own, a zero that steps between runs looks like what depends on pressure. The
geometry may not differ: it is the same muscle. What only whole runs can tell is left to flips of these, if there are
enough of them.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import optimize, stats

from fitting.diagnosis.settings import NUISANCE, NuisanceSettings
from fitting.diagnosis.universe import CandidateFit
from fitting.least_squares.decomposed import lstsq, svd
from fitting.problem.residuals import Samples
from fitting.problem.unknowns import Unknowns


@dataclass(frozen=True)
class Nuisance:
    """How a fitted set may give way: slopes of its rows (rows, k), and rows (p) and slopes (p, k) of its priors."""

    slopes: np.ndarray
    prior_rows: np.ndarray
    prior_slopes: np.ndarray
    group: np.ndarray  # of each column: which parameter it lets differ between runs, -1 for what all share
    settings: NuisanceSettings = NUISANCE

    @property
    def stated(self) -> np.ndarray:
        """Slopes of the priors that state something of the muscle (rows, k), not how alike runs are."""
        return self.prior_slopes[: len(self.prior_slopes) - np.sum(self.group >= 0)]

    def project_out(self, columns: np.ndarray) -> np.ndarray:
        """What is left of columns (rows, m) when everything has given way to them, as far as priors let it."""
        whole = np.vstack([self.slopes, self.prior_slopes])
        target = np.vstack([columns, np.zeros((len(self.prior_slopes), columns.shape[1]))])
        return columns - self.slopes @ lstsq(whole, target, 1e-12)

    def left(self, rows: np.ndarray) -> float:
        """Sum of squares that is left when everything has given way."""
        whole = np.vstack([self.slopes, self.prior_slopes])
        target = np.concatenate([rows, self.prior_rows])
        step = lstsq(whole, target, 1e-12)
        return float(np.sum((target - whole @ step) ** 2))

    def left_at_most(self, rows: np.ndarray) -> np.ndarray:
        """Rows that are left when runs differ by what the rows want, but together by no more than is likely at all."""
        apart = self.group >= 0
        if not apart.any():
            return rows - self.slopes @ self._step(rows, np.zeros(len(apart)))
        most = stats.chi2.isf(self.settings.differ_p, max(np.sum(apart) - len(np.unique(self.group[apart])), 1))
        beyond = lambda tighter: float(np.sum(self._step(rows, np.expm1(tighter) * apart)[apart] ** 2) - most)  # noqa: E731
        tightest = self.settings.tightest_log
        tighter = 0.0 if beyond(0.0) <= 0 else tightest  # too little for an error millions of times the noise
        if tighter and beyond(tightest) < 0:
            tighter = optimize.root_scalar(beyond, bracket=(0.0, tightest), xtol=0.01).root
        return rows - self.slopes @ self._step(rows, np.expm1(tighter) * apart)

    def _step(self, rows: np.ndarray, tighter: np.ndarray) -> np.ndarray:
        """What best gives way to rows when columns are held by so much more than their priors hold them."""
        right = self.slopes.T @ rows + self.prior_slopes.T @ self.prior_rows
        return np.linalg.pinv(self._gram + np.diag(tighter), rcond=1e-12, hermitian=True) @ right

    @cached_property
    def _gram(self) -> np.ndarray:
        return self.slopes.T @ self.slopes + self.prior_slopes.T @ self.prior_slopes


def too_few(samples: Samples, level: float) -> bool:
    """Whether flips of whole runs could never reach the level, and there is more than one run."""
    runs = len(np.unique(samples.run))
    return runs > 1 and 2 * 2.0 ** (1 - runs) > level


def common_nuisance(fit: CandidateFit) -> Nuisance:
    """All runs have the same parameters."""
    return Nuisance(fit.slopes, fit.prior_rows, fit.prior_slopes, np.full(fit.slopes.shape[1], -1))


def nuisance_between_runs(
    fit: CandidateFit, layout: Unknowns, samples: Samples, settings: NuisanceSettings = NUISANCE
) -> Nuisance:
    """Each run has parameters of its own beside the common ones, near them."""
    own, group = differences(fit.slopes, fit.free, fit.vector, layout, samples.run, settings)
    count = own.shape[1]
    priors, common = fit.prior_slopes, np.zeros((len(fit.prior_rows), count))
    return Nuisance(
        np.hstack([fit.slopes, own]),
        np.concatenate([fit.prior_rows, np.zeros(count)]),
        np.block([[priors, common], [np.zeros((count, priors.shape[1])), np.eye(count)]]),
        np.concatenate([np.full(priors.shape[1], -1), group]),
        settings,
    )


def differences(
    slopes: np.ndarray,
    free: Sequence[str],
    vector: np.ndarray,
    layout: Unknowns,
    run: np.ndarray,
    settings: NuisanceSettings = NUISANCE,
) -> tuple[np.ndarray, np.ndarray]:
    """Columns (rows, runs x quantities) in each of which one run has a parameter or a zero of its own, and which.

    `slopes` (rows, k) are those of the `free` parameters at a `vector` of all unknowns; as large as runs may differ.
    The zeros of all runs may be off the same way by chance, so what they share is not taken out.
    """
    own = [k for k, name in enumerate(free) if not name.startswith("muscle.")]
    relative = slopes[:, own] * [settings.repeatable * _per_log(free[k], vector, layout) for k in own]
    every = np.column_stack([relative, np.full(len(run), settings.zero)])
    runs = np.unique(run)
    apart = [np.where((run == one)[:, None], every, 0.0) for one in runs]
    return np.hstack(apart), np.tile(np.arange(every.shape[1]), len(runs))


def as_far_as_seen(
    columns: np.ndarray,
    group: np.ndarray,
    rows: np.ndarray,
    common: np.ndarray,
    settings: NuisanceSettings = NUISANCE,
) -> np.ndarray:
    """Columns (rows, k) of differences between runs, made as small as the runs' agreement says.

    `rows` may hold several draws (rows, draws): then it is the middle one's.
    """
    out = columns.copy()
    for each, shares in shares_seen(columns, group, rows.reshape(len(rows), -1), common, settings).items():
        out[:, group == each] *= np.median(shares)
    return out


def shares_seen(
    columns: np.ndarray,
    group: np.ndarray,
    rows: np.ndarray,
    common: np.ndarray,
    settings: NuisanceSettings = NUISANCE,
) -> dict[int, np.ndarray]:
    """How far runs differ in each parameter, as shares of what is allowed, in every draw of rows (rows, draws).

    All is whitened. With what is common to all runs or smooth (`common`, orthonormal) projected out, the differences
    of one parameter have s_i^2 c^2 + 1 as variances; c, the share, is as likely too small as too large.
    """
    found = {}
    for each in np.unique(group[group >= 0]):
        mine = columns[:, group == each]
        differing = mine - common @ (common.T @ mine)
        side, size, _ = svd(differing)
        seen = size > settings.visible * np.max(np.linalg.norm(mine, axis=0), initial=1e-300)
        scores = side[:, seen].T @ rows
        found[int(each)] = np.array([_share(size[seen], score, settings.doubt) for score in scores.T])
    return found


def _share(size: np.ndarray, score: np.ndarray, doubt: float) -> float:
    if not len(size):
        return 1.0
    least = stats.chi2.ppf(doubt, len(size))
    beyond = lambda share: float(np.sum(score**2 / (1 + (share * size) ** 2)) - least)  # noqa: E731
    if beyond(1.0) >= 0:
        return 1.0
    if beyond(0.0) <= 0:
        return 0.0
    return float(optimize.root_scalar(beyond, bracket=(0.0, 1.0)).root)


def _per_log(name: str, vector: np.ndarray, layout: Unknowns) -> float:
    """How far a parameter's place moves for a change of its logarithm."""
    at = layout.at([name])[0]
    entry = layout.entries[at]
    if entry.logarithmic:
        return 1 / np.log(entry.upper / entry.lower)
    return abs(vector[at]) / (entry.upper - entry.lower)
