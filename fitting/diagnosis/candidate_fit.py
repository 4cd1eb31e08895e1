"""One set of effects, fitted among all candidates."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)  # one and the same fit is itself alone
class CandidateFit:
    """One set of effects, fitted: rows and slopes in standard deviations, of the measurements and of the priors."""

    effects: frozenset[str]
    vector: np.ndarray
    free: tuple[str, ...]
    rows: np.ndarray
    slopes: np.ndarray
    prior_rows: np.ndarray
    prior_slopes: np.ndarray
    at_bound: tuple[str, ...]
    confined: bool = False  # to stated sizes, as in the universe where it was fitted
    is_decided: bool = True  # whether the data hold what is `at_bound`; else it may as well be inside its range

    @property
    def cost(self) -> float:
        """Sum of squares over all rows."""
        return float(np.sum(self.rows**2) + np.sum(self.prior_rows**2))
