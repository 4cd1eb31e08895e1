"""What is left of rows, of candidates and of the omnibus bases, when a model's parameters have given way to them."""

from dataclasses import dataclass

import numpy as np
from scipy import stats

from fitting.diagnosis.detection import enough
from fitting.diagnosis.nuisance import Nuisance, is_left
from fitting.diagnosis.omnibus import Basis
from fitting.diagnosis.settings import FLIP_TEST, FlipTestSettings
from fitting.least_squares.decomposed import orthonormal


@dataclass(frozen=True)
class Projected:
    """Whitened rows, candidates and omnibus basis, with what the model's parameters can make of them projected out.

    Rows may be several draws: then all that is said of them has one entry for each draw.
    """

    e: np.ndarray  # (rows,) or (rows, draws)
    z: np.ndarray  # (rows, candidates)
    pulled: np.ndarray  # spread of each candidate's score by errors of what is stated, over its spread by noise
    o: np.ndarray  # orthonormal (rows, q): what is smooth, then what is fine with that projected out
    smooth: int  # how many of these are smooth
    kept: np.ndarray  # norm of each candidate
    seen: np.ndarray  # which candidates the parameters do not take whole
    parameters: int
    misfit_p_bound: float  # p-value of the likelihood ratio below which the bases see a misfit

    @property
    def clean(self) -> np.ndarray:
        """Rows without what the basis takes."""
        return self.e - self.o @ (self.o.T @ self.e)

    @property
    def freedom(self) -> int:
        """Rows that neither parameters nor basis use up."""
        return max(len(self.e) - self.parameters - self.o.shape[1], 1)

    @property
    def unexplained(self) -> np.ndarray:
        """Sum of squares of the rows without what the basis takes."""
        return np.maximum(np.sum(self.e**2, axis=0) - np.sum((self.o.T @ self.e) ** 2, axis=0), 1e-300)

    @property
    def ratio_p(self) -> np.ndarray:
        """The p-value of the likelihood ratio of the basis, were the noise model right; 1 where there is no basis."""
        if not self.o.shape[1]:
            return np.ones_like(self.unexplained)
        taken = np.sum((self.o.T @ self.e) ** 2, axis=0)
        ratio = (taken / self.o.shape[1]) / (self.unexplained / self.freedom)
        return stats.f.sf(ratio, self.o.shape[1], self.freedom)

    @property
    def explained(self) -> np.ndarray:
        """The amount of each candidate whose likelihood ratio would be beyond its bound; infinite without a basis."""
        if not self.o.shape[1]:
            return np.full(self.z.shape[1], np.inf)
        taken = np.linalg.norm(self.o.T @ self.z, axis=0)
        return np.sqrt(enough(self.o.shape[1], self.misfit_p_bound)) / np.maximum(taken, 1e-300)

    @property
    def dull(self) -> np.ndarray:
        """How much larger a score must be than its flips, which know nothing of errors in what is stated."""
        return np.sqrt(1 + self.pulled**2)


def projected(
    e: np.ndarray,
    j: np.ndarray,
    z: np.ndarray,
    basis: Basis,
    by: Nuisance,
    settings: FlipTestSettings = FLIP_TEST,
) -> Projected:
    """Project out whitened slopes `j` (rows, k) of all that may give way; `by` says what is known of it."""
    curvature = np.linalg.pinv(j.T @ j + by.prior_slopes.T @ by.prior_slopes, rcond=1e-13, hermitian=True)
    pull = by.prior_slopes.T @ by.prior_rows
    step = curvature @ (j.T @ e + (pull if e.ndim == 1 else pull[:, None]))  # to the optimum of the whitened rows
    for_z = curvature @ (j.T @ z)
    z_left = z - j @ for_z
    smooth = basis.smooth - j @ (curvature @ (j.T @ basis.smooth))
    smooth = orthonormal(smooth[:, is_left(smooth, basis.smooth)])
    fine = basis.fine - j @ (curvature @ (j.T @ basis.fine))
    fine -= smooth @ (smooth.T @ fine)
    o = np.hstack([smooth, orthonormal(fine[:, is_left(fine, basis.fine)])])
    kept, seen = np.maximum(np.linalg.norm(z_left, axis=0), 1e-300), is_left(z_left, z)
    known = by.prior_slopes.T @ by.prior_slopes
    sway = by.prior_slopes @ (curvature @ (known @ for_z))
    pulled = np.where(seen, np.linalg.norm(sway, axis=0) / kept, 0.0)
    left, rank = e - j @ step, int(np.linalg.matrix_rank(j))
    return Projected(left, z_left, pulled, o, smooth.shape[1], kept, seen, rank, settings.misfit_p)
