"""One set of effects, fitted among all candidates."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from fitting.least_squares.decomposed import lstsq


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
    through: bool = False  # whether it was fitted as instruments that err let it be seen

    @cached_property
    def plain(self) -> "CandidateFit":
        """The same with the rows of plain least squares, to first order, where it was fitted through instruments.

        Errors that people read are those of the readings: a fit of the same set, which trusts every reading, has them.
        """
        if not self.through:
            return self
        whole, target = np.vstack([self.slopes, self.prior_slopes]), np.concatenate([self.rows, self.prior_rows])
        rows = target - whole @ lstsq(whole, target, 1e-12)
        return replace(self, rows=rows[: len(self.rows)], prior_rows=rows[len(self.rows) :], through=False)

    @property
    def cost(self) -> float:
        """Sum of squares over all rows."""
        return float(np.sum(self.rows**2) + np.sum(self.prior_rows**2))
