"""The misfit at equal contraction and pressure: what is even, and what is odd, in the direction of motion."""

from dataclasses import dataclass

import numpy as np

from fitting.comparison.bins import Bins, bins, medians
from fitting.comparison.settings import BINS
from fitting.problem.residuals import Samples


@dataclass(frozen=True)
class Cells:
    """The mean residual in cells of pressure and contraction, on either branch; NaN where nothing was measured."""

    pressure: Bins
    contraction: Bins
    mean: dict[int, np.ndarray]  # branch -> (pressure, contraction), N
    count: dict[int, np.ndarray]

    @property
    def even(self) -> np.ndarray:
        """(up + down)/2, N."""
        return 0.5 * (self.mean[1] + self.mean[-1])

    @property
    def odd(self) -> np.ndarray:
        """(up - down)/2, N."""
        return 0.5 * (self.mean[1] - self.mean[-1])

    @property
    def odd_share(self) -> float | None:
        """Share of the squared misfit that changes sign with the direction; None without both directions."""
        weight = self.count[1] + self.count[-1]
        both = np.isfinite(self.even)
        if not both.any():
            return None
        even, odd = (float(np.sum((weight * part**2)[both])) for part in (self.even, self.odd))
        return odd / (even + odd) if even + odd > 0 else None


def pressure_bins(samples: Samples, steady: np.ndarray, steps: int = 6) -> Bins:
    """Groups of pressure: of whole loops where the pressure is held (`steady`), else of samples."""
    return bins(np.where(steady, medians(samples.pressure, loop_numbers(samples)), samples.pressure), steps)


def loop_numbers(samples: Samples) -> np.ndarray:
    """The number (rows,) of the loop that each row is of, through all runs."""
    return np.unique(np.stack([samples.run, samples.loop]), axis=1, return_inverse=True)[1].ravel()


def cells(samples: Samples, residual: np.ndarray, steady: np.ndarray) -> Cells:
    """Sort the residual by pressure, contraction and branch."""
    pressure, contraction = pressure_bins(samples, steady, BINS.cells), bins(samples.contraction, BINS.cells)
    mean, count = {}, {}
    for branch in (-1, 0, 1):
        mask = samples.branch == branch
        count[branch] = _summed(np.ones(len(samples)), mask, pressure, contraction)
        total = _summed(residual, mask, pressure, contraction)
        with np.errstate(invalid="ignore", divide="ignore"):
            mean[branch] = np.where(count[branch] > 0, total / count[branch], np.nan)
    return Cells(pressure, contraction, mean, count)


def _summed(values: np.ndarray, mask: np.ndarray, pressure: Bins, contraction: Bins) -> np.ndarray:
    total = np.zeros((len(pressure), len(contraction)))
    np.add.at(total, (pressure.of[mask], contraction.of[mask]), values[mask])
    return total
