"""Divided second differences of readings, and the algebra of their covariance, which has five bands.

They know neither the first level nor the first slope of a signal. Time is in mean steps, so that the noise of readings
(variance R) and a random walk of the slope (variance q per step) compare as they stand.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import cho_solve_banded, cholesky_banded

NEAREST = 1e-3  # mean steps between two readings at least: closer, their difference is rounding
FREE = 1e10  # variance of a free change of slope, in R per squared step: a jump of 10^5 errors is not resisted
PIECES, LONGEST = 10, 10_000  # of very long runs, in which q/R is searched: each at least ten bandwidths long


@dataclass(frozen=True)
class Contrasts:
    """Divided second differences of the readings of one run, and the covariance that the model gives them."""

    z: np.ndarray  # (n-2,), in the unit of the readings
    weights: np.ndarray  # (3, n-2), of the three readings in each
    noise: np.ndarray  # (3, n-2), lower bands of their covariance, per R
    walk: np.ndarray  # (3, n-2), the same per q
    least: float  # that R is at least
    most: float  # that R is at most: the same where R is known
    free: np.ndarray  # (n-2,), bool: where the slope changes abruptly

    def factor(self, ratio: float) -> np.ndarray:
        """Lower Cholesky factor, as bands (3, n-2), of the covariance of z per R, at this q/R."""
        bands = self.noise + ratio * self.walk
        bands[0] += np.where(self.free, FREE, 0.0)
        return cholesky_banded(bands, lower=True, check_finite=False)

    def variance(self, squares: float) -> float:
        """R by maximum likelihood within its bounds, from the sum of squares of the whitened z."""
        likeliest = squares / max(len(self.z) - int(self.free.sum()), 1)
        return min(max(likeliest, self.least), self.most)

    def misfit(self, size: float, squares: float) -> float:
        """Minus twice the restricted log-likelihood, R at its best; `size`: log determinant of the covariance per R."""
        variance, count = self.variance(squares), len(self.z) - int(self.free.sum())
        return size + count * float(np.log(variance)) + squares / variance

    def misfit_at(self, ratio: float) -> float:
        """Minus twice the restricted log-likelihood at this q/R."""
        factor = self.factor(ratio)
        squares = float(self.z @ cho_solve_banded((factor, True), self.z))
        return self.misfit(2 * float(np.log(factor[0]).sum()), squares)

    def pieces(self) -> "Contrasts":
        """These, or of a very long run ten pieces evenly spread: each has its own exact likelihood."""
        count = len(self.z)
        if count <= PIECES * LONGEST:
            return self
        starts = np.linspace(0, count - LONGEST, PIECES).astype(int)
        at = (starts[:, None] + np.arange(LONGEST)).reshape(-1)
        noise, walk = self.noise[:, at], self.walk[:, at]
        noise[1, LONGEST - 1 :: LONGEST] = walk[1, LONGEST - 1 :: LONGEST] = 0.0
        noise[2, LONGEST - 1 :: LONGEST] = noise[2, LONGEST - 2 :: LONGEST] = 0.0
        return replace(self, z=self.z[at], weights=self.weights[:, at], noise=noise, walk=walk, free=self.free[at])


def clock(time: np.ndarray) -> np.ndarray:
    """Time in mean steps, with mean 0; readings at one time within rounding stand NEAREST apart."""
    step = np.maximum(np.diff(time) * (len(time) - 1) / (time[-1] - time[0]), NEAREST)
    at = np.concatenate([[0.0], np.cumsum(step)])
    return at - at.mean()


def contrasts_of(at: np.ndarray, readings: np.ndarray, least: float, most: float = np.inf) -> Contrasts:
    """Those of `readings` (n,) taken at `at` (n,), in mean steps; the variance of one lies from `least` to `most`."""
    step = np.diff(at)
    before, after = 1 / step[:-1], 1 / step[1:]
    w = np.stack([before, -before - after, after])
    noise, walk = np.zeros_like(w), np.zeros_like(w)
    noise[0] = (w**2).sum(0)
    noise[1, :-1] = w[1, :-1] * w[0, 1:] + w[2, :-1] * w[1, 1:]
    noise[2, :-2] = w[2, :-2] * w[0, 2:]
    walk[0], walk[1, :-1] = (step[:-1] + step[1:]) / 3, step[1:-1] / 6
    slopes = np.diff(readings) / step
    return Contrasts(np.diff(slopes), w, noise, walk, least, most, np.zeros(len(at) - 2, bool))


def size_of_noise(at: np.ndarray, contrasts: Contrasts) -> float:
    """Log determinant of the covariance of z per R where q is 0 and rounding would spoil a Cholesky factor.

    With A the rows that pick the first two readings above `weights`, |A|^2 = |w w'| |x (X'X)^-1 x'|, X = (1, at).
    """
    spread = np.log(len(at)) + np.log(at @ at) - 2 * np.log(at[1] - at[0])
    return float(2 * np.log(contrasts.weights[2]).sum() + spread)


def spread(parts: np.ndarray) -> np.ndarray:
    """Sums (n,) over the samples of what each contrast gives (3, n-2) to its three."""
    sums = np.zeros(parts.shape[1] + 2)
    for k in range(3):
        sums[k : k + parts.shape[1]] += parts[k]
    return sums


def slopes(at: np.ndarray, level: np.ndarray, bend: np.ndarray) -> np.ndarray:
    """Slope (n,) per step of the natural cubic spline through `level` (n,), before each sample; after the first one.

    `bend` (n-2,) is its second derivative at the inner samples: 0 where the slope is free, so that it is cut there.
    """
    step, chord = np.diff(at), np.diff(level) / np.diff(at)
    bend = np.concatenate([[0.0], bend, [0.0]])
    return np.concatenate([
        [chord[0] - step[0] * (2 * bend[0] + bend[1]) / 6],
        chord + step * (bend[:-1] + 2 * bend[1:]) / 6,
    ])  # fmt: skip


def explained(w: np.ndarray, inverse: np.ndarray) -> np.ndarray:
    """Share (n,) by which the variance of each level is below R: the diagonal of w' inverse w."""
    share = spread(w**2 * inverse[0])
    share[1:-2] += 2 * w[1, :-1] * w[0, 1:] * inverse[1, :-1]
    share[2:-1] += 2 * w[2, :-1] * w[1, 1:] * inverse[1, :-1]
    share[2:-2] += 2 * w[2, :-2] * w[0, 2:] * inverse[2, :-2]
    return share


def inverse_bands(factor: np.ndarray) -> np.ndarray:
    """The lower bands (3, n) of the inverse of a matrix from those of its Cholesky factor (Takahashi 1973)."""
    pivot = (1 / factor[0] ** 2).tolist()
    first, second = (factor[1] / factor[0]).tolist(), (factor[2] / factor[0]).tolist()
    rows = []
    next_diagonal = next_beside = after_diagonal = 0.0  # of the rows one and two further down
    for p, a, b in zip(reversed(pivot), reversed(first), reversed(second), strict=True):
        beside = -(a * next_diagonal + b * next_beside)
        two_beside = -(a * next_beside + b * after_diagonal)
        after_diagonal, next_beside = next_diagonal, beside
        next_diagonal = p - a * beside - b * two_beside
        rows.append((next_diagonal, beside, two_beside))
    return np.array(rows[::-1]).T
