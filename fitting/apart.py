"""Few runs: parameters that differ a little from run to run cannot be told from an effect, and must be allowed for.

Where runs are many, flips of whole runs tell the two apart. Where they are too few to be flipped, every effect's own
parameters may differ by a few percent from run to run before anything is called missing. The geometry may not: it is
the same muscle.
"""

from dataclasses import dataclass

import numpy as np

from fitting.residuals import Samples
from fitting.universe import Trial
from fitting.unknowns import Unknowns

REPEATABLE = 0.03  # standard deviation of a parameter from run to run, relative


@dataclass(frozen=True)
class Yielding:
    """How a fitted set may give way: slopes of its rows (rows, k), and rows (p) and slopes (p, k) of its priors."""

    slopes: np.ndarray
    prior_rows: np.ndarray
    prior_slopes: np.ndarray

    def left(self, rows: np.ndarray) -> float:
        """Sum of squares that is left when everything has given way."""
        whole = np.vstack([self.slopes, self.prior_slopes])
        target = np.concatenate([rows, self.prior_rows])
        step = np.linalg.lstsq(whole, target, rcond=1e-12)[0]
        return float(np.sum((target - whole @ step) ** 2))


def too_few(samples: Samples, level: float) -> bool:
    """Whether flips of whole runs could never reach the level, and there is more than one run."""
    runs = len(np.unique(samples.run))
    return runs > 1 and 2 * 2.0 ** (1 - runs) > level


def together(trial: Trial) -> Yielding:
    """All runs have the same parameters."""
    return Yielding(trial.slopes, trial.prior_rows, trial.prior_slopes)


def from_run_to_run(trial: Trial, layout: Unknowns, samples: Samples) -> Yielding:
    """Each run has parameters of its own beside the common ones, near them."""
    own = [k for k, name in enumerate(trial.free) if not name.startswith("muscle.")]
    relative = trial.slopes[:, own] * [REPEATABLE * _per_log(trial, layout, k) for k in own]
    runs = np.unique(samples.run)
    apart = np.hstack([np.where((samples.run == run)[:, None], relative, 0.0) for run in runs])
    count = apart.shape[1]
    priors, common = trial.prior_slopes, np.zeros((len(trial.prior_rows), count))
    return Yielding(
        np.hstack([trial.slopes, apart]),
        np.concatenate([trial.prior_rows, np.zeros(count)]),
        np.block([[priors, common], [np.zeros((count, priors.shape[1])), np.eye(count)]]),
    )


def _per_log(trial: Trial, layout: Unknowns, k: int) -> float:
    """How far a parameter's place moves for a change of its logarithm."""
    at = layout.at([trial.free[k]])[0]
    entry = layout.entries[at]
    if entry.logarithmic:
        return 1 / np.log(entry.upper / entry.lower)
    return abs(trial.vector[at]) / (entry.upper - entry.lower)
