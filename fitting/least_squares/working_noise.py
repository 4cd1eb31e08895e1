"""The working noise model: white noise and slow wanders, estimated from what a fit and a smooth basis leave.

In a diagnosis it buys power only; that the test holds its level rests on flips, except where loops are too few to be
flipped. The likelier values of a fit are sought beside this noise.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.linalg import cholesky, solve_triangular
from scipy.optimize import nnls
from scipy.signal import lfilter

from fitting.instruments.errors import InstrumentErrors
from fitting.least_squares.decomposed import orthonormal
from fitting.problem.residuals import Samples


@dataclass(frozen=True)
class NoiseSettings:
    """Settings of the noise model. "Chosen" says that nobody derived it."""

    memories: tuple[float, ...] = (
        0.3,
        0.5,
        0.7,
        0.8,
        0.9,
        0.95,
        0.98,
        0.99,
        0.995,
        0.999,
    )  # lag-1 correlations; chosen
    lags: tuple[int, ...] = (0, 1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128, 192)  # samples; chosen
    piece: int = 400  # samples whitened together; chosen for speed
    visible: float = 0.05  # of its variance that a kind of noise must leave where a basis is removed; chosen
    least_white: float = 1e-3  # white share of the variance, or slow noise could not be whitened; chosen


NOISE = NoiseSettings()
NOTHING = 1e-6  # share of a column that is rounding, as of directions (`orthonormal`)


@dataclass(frozen=True)
class Noise:
    """White noise and a non-negative mixture of first-order autoregressions, in variances."""

    white: float
    shares: np.ndarray  # (memories,)
    settings: NoiseSettings = NOISE

    @property
    def memories(self) -> np.ndarray:
        """Correlation of neighbouring samples of each autoregression (memories,)."""
        return np.array(self.settings.memories)

    @property
    def memory(self) -> float:
        """Correlation of neighbouring samples."""
        return float(self.shares @ self.memories / max(self.white + self.shares.sum(), 1e-300))

    def covariance(self, position: np.ndarray) -> np.ndarray:
        """Covariance of samples at these places of a run."""
        apart = np.abs(position[:, None] - position[None, :])
        correlated = sum(s * m**apart for s, m in zip(self.shares, self.memories, strict=True) if s > 0)
        return correlated + self.white * np.eye(len(position))


def white_noise(variance: float, settings: NoiseSettings = NOISE) -> Noise:
    """Noise without a memory."""
    return Noise(variance, np.zeros(len(settings.memories)), settings)


@dataclass(frozen=True)
class Kinds:
    """What each kind of noise leaves where a basis (rows, q; orthonormal) is removed: autocovariances (lags, kinds).

    What is removed takes slow noise with it. Autocovariances are therefore compared with those that each kind of noise
    would have after the same removal, or slow noise would be taken for less than it is.
    """

    basis: np.ndarray
    runs: list[slice]
    lags: list[int]
    left: np.ndarray
    settings: NoiseSettings = NOISE

    @classmethod
    def after_removal(cls, columns: np.ndarray, samples: Samples, settings: NoiseSettings = NOISE) -> "Kinds":
        """Where these columns (rows, q) are removed."""
        basis = orthonormal(columns)
        runs = stretches(samples)
        longest = max(run.stop - run.start for run in runs)
        lags = [lag for lag in settings.lags if longest > 2 * lag + 2] or [0]
        left = np.stack([_left_of(memory, basis, runs, lags) for memory in (0.0, *settings.memories)], axis=1)
        return cls(basis, runs, lags, left, settings)

    def noise(self, rows: np.ndarray) -> Noise:
        """The noise of rows (rows,)."""
        return self._of(rows - self.basis @ (self.basis.T @ rows))

    def noise_beside(self, rows: np.ndarray, slopes: np.ndarray, errors: InstrumentErrors) -> Noise:
        """The same where slopes (rows, k) and errors of instruments are removed as well.

        They are taken to remove as much of every kind of noise as of white noise, one part for each direction: of a map
        of 40 points they may remove more than half.
        """
        whole = without_own(np.column_stack([rows, self.basis, slopes, errors.shared]), errors)
        known = orthonormal(whole[:, 1:])
        left = len(rows) - known.shape[1] - sum(own.shape[1] for _, own in _own_of_runs(errors))
        share = max(left, 1) / max(len(rows) - self.basis.shape[1], 1)  # of the noise, that is left
        return self._of((whole[:, 0] - known @ (known.T @ whole[:, 0])) / np.sqrt(share))

    def _of(self, residual: np.ndarray) -> Noise:
        """From rows of which everything known has been removed."""
        found = [_mean_product(residual[:, None], residual[:, None], self.runs, lag) for lag in self.lags]
        weight = np.sqrt([sum(max(run.stop - run.start - lag, 0) for run in self.runs) for lag in self.lags])
        visible = self.left[0] > self.settings.visible
        visible[1:] &= len(self.lags) > 1
        shares = np.zeros(len(visible))
        if visible.any():  # scipy's search of no numbers ends the process
            shares[visible] = nnls(self.left[:, visible] * weight[:, None], np.array(found) * weight)[0]
        floor = self.settings.least_white * max(found[0], 1e-300)
        return Noise(max(shares[0], floor), shares[1:], self.settings)


def without_own(columns: np.ndarray, errors: InstrumentErrors) -> np.ndarray:
    """Columns (rows, q) without what errors of single runs could make of them, however large these were.

    A run whose errors could make more than half of its readings keeps them: a few readings would be explained wholly,
    whatever they are. What such errors make of a column wholly is 0, not rounding. Run by run, for a thousand runs have
    thousands of columns, each of which is 0 in all runs but one.
    """
    out = np.array(columns, dtype=float)
    for at, own in _own_of_runs(errors):
        out[at] -= own @ (own.T @ out[at])
    gone = np.linalg.norm(out, axis=0) < NOTHING * np.linalg.norm(columns, axis=0)
    return np.where(gone, 0.0, out)


def _own_of_runs(errors: InstrumentErrors) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Of each run whose errors could make at most half of its readings, its rows and an orthonormal basis of them."""
    for one in np.unique(errors.run):
        at = np.flatnonzero(errors.run == one)
        own = orthonormal(errors.per_run[at])
        if 2 * own.shape[1] <= len(at):
            yield at, own


def noise_from(rows: np.ndarray, columns: np.ndarray, samples: Samples) -> Noise:
    """The noise of `rows` from which these columns (rows, q) have been removed."""
    return Kinds.after_removal(columns, samples).noise(rows)


def stretches(samples: Samples) -> list[slice]:
    """What may err together: runs; of a static map every point by itself, for each was set anew."""
    _, half, count = np.unique(np.stack([samples.run, samples.half]), axis=1, return_inverse=True, return_counts=True)
    alone = count[half] == 1
    apart = (np.diff(samples.run) != 0) | (alone[1:] & alone[:-1])
    edges = [0, *(np.flatnonzero(apart) + 1), len(samples)]
    return [slice(int(a), int(b)) for a, b in pairwise(edges)]


def _left_of(memory: float, basis: np.ndarray, runs: list[slice], lags: list[int]) -> np.ndarray:
    """Autocovariances at these lags of noise of unit variance after removal of an orthonormal basis (rows, q).

    With P = 1 - Q Q' and covariance C, those of P C P, summed along its diagonals run by run.
    """
    image = np.empty_like(basis)  # C Q
    for run in runs:
        image[run] = _correlated(memory, basis[run])
    half = image - 0.5 * basis @ (basis.T @ image)
    return np.array([memory**lag - 2 * _mean_product(basis, half, runs, lag, both=True) for lag in lags])


def _correlated(memory: float, columns: np.ndarray) -> np.ndarray:
    """A first-order autoregression's correlation matrix times columns: one filter forwards, one backwards."""
    if memory == 0.0:
        return columns
    forwards = lfilter([1.0], [1.0, -memory], columns, axis=0)
    backwards = lfilter([1.0], [1.0, -memory], columns[::-1], axis=0)[::-1]
    return forwards + backwards - columns


def _mean_product(a: np.ndarray, b: np.ndarray, runs: list[slice], lag: int, both: bool = False) -> float:
    """Mean over pairs of rows `lag` apart of a_i . b_(i+lag); averaged with b_i . a_(i+lag) if `both`."""
    total, count = 0.0, 0
    for run in runs:
        pairs = run.stop - run.start - lag
        if pairs > 0:
            first, second = slice(run.start, run.stop - lag), slice(run.start + lag, run.stop)
            total += np.vdot(a[first], b[second]) + (np.vdot(b[first], a[second]) if both else 0.0)
            count += pairs
    return float(total / count / (2 if both else 1))


@dataclass(frozen=True)
class Whitener:
    """Takes the correlation out of rows that may err together, as far as the noise model knows it.

    `parts` are rows with the lower factor of their covariance, which is computed once.
    """

    parts: tuple[tuple[np.ndarray, np.ndarray], ...]

    @classmethod
    def of(cls, noise: Noise, samples: Samples, together: np.ndarray) -> "Whitener":
        """For rows that may err together where `together` (rows,) is equal."""
        order = np.argsort(together, kind="stable")
        edges = np.flatnonzero(np.diff(together[order])) + 1
        pieces = (piece for member in np.split(order, edges) for piece in _pieces(member, noise.settings.piece))
        factors: dict[bytes, np.ndarray] = {}  # of pieces that are sampled alike, as most are
        parts = []
        for piece in pieces:
            place = samples.position[piece] - samples.position[piece[:1]]
            if place.tobytes() not in factors:
                factors[place.tobytes()] = cholesky(noise.covariance(place.astype(float)), lower=True)
            parts.append((piece, factors[place.tobytes()]))
        return cls(tuple(parts))

    def __call__(self, columns: np.ndarray) -> np.ndarray:
        """The rows, which may have columns, without correlation."""
        out = np.empty_like(columns, dtype=float)
        for at, factor in self.parts:
            out[at] = solve_triangular(factor, columns[at], lower=True)
        return out


def _pieces(member: np.ndarray, size: int) -> list[np.ndarray]:
    return np.array_split(member, int(np.ceil(len(member) / size)))
