"""How well a model predicts runs that it has not seen."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fitting.problem.residuals import Samples


@dataclass(frozen=True)
class HeldOutSettings:
    """Settings of the error on held-out runs. All were chosen."""

    folds: int = 10  # groups at most, where there are more than three times as many runs or loops
    fewest_groups: int = 4  # of whole runs, or of whole loops: fewer are cut finer
    refit_below: int = 500  # samples: each group of few points weighs much, and one step from the whole fit misjudges
    at_best: float = 0.05  # of the sum of squares: a step takes no more from a fit to a part of these readings; chosen


HELD_OUT = HeldOutSettings()


def folds(samples: Samples) -> np.ndarray:
    """Which left-out group each row belongs to: whole runs, else whole loops, else points of nearly one contraction."""
    for keys in ((samples.run,), (samples.run, samples.loop)):
        numbers = np.unique(np.stack(keys), axis=1, return_inverse=True)[1]
        if HELD_OUT.fewest_groups <= numbers.max() + 1 < max(len(samples) / 3, 5):
            return numbers % HELD_OUT.folds if numbers.max() + 1 > 3 * HELD_OUT.folds else numbers
    at = np.round(samples.contraction, 3)
    numbers = np.unique(at, return_inverse=True)[1]
    return numbers % HELD_OUT.folds


def left_out_rows(
    rows: np.ndarray, slopes: np.ndarray, prior_rows: np.ndarray, prior_slopes: np.ndarray, group: np.ndarray
) -> np.ndarray:
    """Rows of each group under the parameters fitted without it, in one Gauss-Newton step from the whole fit."""
    out, steps = rows.copy(), left_out_steps(rows, slopes, prior_slopes, group)
    for g, step in zip(np.unique(group), steps, strict=True):
        mine = group == g
        out[mine] = rows[mine] - slopes[mine] @ step
    return out


def left_out_steps(rows: np.ndarray, slopes: np.ndarray, prior_slopes: np.ndarray, group: np.ndarray) -> np.ndarray:
    """What is to be taken from the parameters for each group that is left out: (groups, parameters), to first order."""
    groups = [np.flatnonzero(group == g) for g in np.unique(group)]
    own = np.stack([slopes[at].T @ slopes[at] for at in groups])
    # at the optimum of all rows the others' gradient is minus this one's
    gradient = -np.stack([slopes[at].T @ rows[at] for at in groups])
    whole = slopes.T @ slopes + prior_slopes.T @ prior_slopes
    # of the whole: what the others know nothing of then counts as nothing, and stays where the whole fit has it
    scale = 1 / np.sqrt(np.maximum(np.diag(whole), 1e-300))
    inverse = np.linalg.pinv((whole - own) * np.outer(scale, scale), rcond=1e-12, hermitian=True)
    return scale * (inverse @ (scale * gradient)[:, :, None])[:, :, 0]


def difference(worse: np.ndarray, better: np.ndarray, group: np.ndarray) -> tuple[float, float]:
    """How far the mean square falls from one set of left-out rows to another, and its error over groups.

    Of one group alone the error is not known, and without a bound.
    """
    fall = worse**2 - better**2
    totals = np.array([fall[group == g].sum() for g in np.unique(group)])
    count = len(totals)
    if count < 2:
        return float(totals.sum() / len(fall)), float("inf")
    return float(totals.sum() / len(fall)), float(np.std(totals, ddof=1) * np.sqrt(count) / len(fall))


def log_difference(worse: np.ndarray, better: np.ndarray, group: np.ndarray) -> tuple[float, float]:
    """How far the logarithm of a group's mean square falls on average, and its error over groups.

    Where one group errs ten times as much as the others, the difference of mean squares is that group's alone; in the
    logarithm every group counts alike.
    """
    tiny = 1e-300
    falls = np.array([
        np.log(max(np.mean(worse[group == g] ** 2), tiny) / max(np.mean(better[group == g] ** 2), tiny))
        for g in np.unique(group)
    ])  # fmt: skip
    return float(falls.mean()), float(np.std(falls, ddof=1) / np.sqrt(len(falls)))


def rms(rows: Sequence[float] | np.ndarray) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(np.square(rows))))
