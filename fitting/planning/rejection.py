"""How often the diagnosis would reject an explanation, counted over many drawn sets of rows at once."""

from dataclasses import dataclass

import numpy as np
from scipy import stats

from fitting.diagnosis import between_runs, flips, omnibus, projected
from fitting.diagnosis.working_noise import orthonormal

FLIPS = 800
JUDGED = 15  # draws by which it is judged how alike runs are


@dataclass(frozen=True)
class FlipGroups:
    """What is flipped as a whole, how many rows were measured before, the test's level, old rows whitened together."""

    number: np.ndarray
    old: int
    level: float
    together: np.ndarray


@dataclass(frozen=True)
class Drawn:
    """Drawn sets of whitened rows (rows, draws) of one explanation, and what the test looks along."""

    rows: np.ndarray
    slopes: np.ndarray
    prior: np.ndarray  # information
    differing: np.ndarray  # by what runs may differ
    group: np.ndarray  # parameter of each of these columns
    columns: np.ndarray  # signatures
    basis: omnibus.Basis
    flip_groups: FlipGroups

    def rejections(self, seed: int) -> np.ndarray:
        """Which draws the test rejects: as `flips.judged`, but without flips of whole runs; all draws together."""
        slopes, prior = self._nuisance()
        curvature = np.linalg.pinv(slopes.T @ slopes + prior, rcond=1e-13, hermitian=True)
        beside = lambda columns: columns - slopes @ (curvature @ (slopes.T @ columns))  # noqa: E731
        left, rows = beside(self.columns), beside(self.rows)
        smooth, fine = orthonormal(beside(self.basis.smooth)), beside(self.basis.fine)
        fine = orthonormal(fine - smooth @ (smooth.T @ fine))
        visible = np.linalg.norm(left, axis=0) > 1e-6 * np.linalg.norm(self.columns, axis=0)
        signs = flips.flipped_signs(self.flip_groups.number.max() + 1, seed)[:FLIPS]
        p_max = self._largest(left[:, visible], rows, signs)
        p_all = np.minimum(self._overall(smooth, rows, signs), self._overall(fine, rows, signs))
        found = np.minimum(2 * p_max, 4 * p_all) < self.flip_groups.level
        denied = self._denied(curvature @ (slopes.T @ self.rows))
        return found | denied | self._misfit(np.hstack([smooth, fine]), rows, slopes.shape[1])

    def _nuisance(self) -> tuple[np.ndarray, np.ndarray]:
        """Slopes along which the model may give way, and what is known of them."""
        if not self.differing.shape[1]:
            return self.slopes, self.prior
        common = orthonormal(np.hstack([self.slopes, self.basis.whole]))
        own = between_runs.as_far_as_seen(self.differing, self.group, self.rows[:, :JUDGED], common)
        prior = np.eye(len(self.prior) + own.shape[1])
        prior[: len(self.prior), : len(self.prior)] = self.prior
        return np.hstack([self.slopes, own]), prior

    def _scores(self, columns: np.ndarray, rows: np.ndarray) -> np.ndarray:
        """Sums over units: (units, columns, draws)."""
        count = self.flip_groups.number.max() + 1
        out = np.empty((count, columns.shape[1], rows.shape[1]))
        for number in range(count):
            mine = self.flip_groups.number == number
            out[number] = columns[mine].T @ rows[mine]
        return out

    def _largest(self, columns: np.ndarray, rows: np.ndarray, signs: np.ndarray) -> np.ndarray:
        scores = self._scores(columns / np.linalg.norm(columns, axis=0), rows)
        seen = np.abs(scores.sum(axis=0)).max(axis=0, initial=0.0)
        flipped = np.abs(np.tensordot(signs, scores, axes=1)).max(axis=1, initial=0.0)
        return np.mean(flipped >= seen * (1 - 1e-9), axis=0)

    def _overall(self, smooth: np.ndarray, rows: np.ndarray, signs: np.ndarray) -> np.ndarray:
        scores = self._scores(smooth, rows)
        seen = np.sum(scores.sum(axis=0) ** 2, axis=0)
        flipped = np.sum(np.tensordot(signs, scores, axes=1) ** 2, axis=1)
        return np.mean(flipped >= seen * (1 - 1e-9), axis=0)

    def _denied(self, steps: np.ndarray) -> np.ndarray:
        """Where runs would have to differ by more than they may: `steps` (parameters, draws), those of runs last."""
        free = len(self.group) - len(np.unique(self.group))  # what all runs share is no difference
        if not free:
            return np.zeros(steps.shape[1], bool)
        return stats.chi2.sf(np.sum(steps[-len(self.group) :] ** 2, axis=0), free) < projected.DENIED_P

    def _misfit(self, smooth: np.ndarray, rows: np.ndarray, parameters: int) -> np.ndarray:
        """A misfit many times the noise that the bases take up."""
        taken, whole = np.sum((smooth.T @ rows) ** 2, axis=0), np.sum(rows**2, axis=0)
        freedom = max(len(rows) - parameters - smooth.shape[1], 1)
        ratio = taken / smooth.shape[1] / (np.maximum(whole - taken, 1e-300) / freedom)
        large = whole > flips.MANY**2 * np.maximum(whole - taken, 1e-300)
        return large & (stats.f.sf(ratio, smooth.shape[1], freedom) < projected.MISFIT_P)
