"""A linear look at sets that are not fitted: what they might leave, from what their members change."""

from collections.abc import Mapping, Sequence
from functools import cached_property

import numpy as np

from fitting.diagnosis.candidate_fit import CandidateFit
from fitting.diagnosis.examine import Examiner
from fitting.diagnosis.nuisance import Nuisance, is_left
from fitting.least_squares.decomposed import lstsq


class LinearLook:
    """What is promised of larger sets by those that are fitted, by which a search chooses what to fit next.

    `alone` is the base without anything added, fitted as the sets are; all sums of squares are those that are left when
    instruments within their accuracy have given way.
    """

    def __init__(self, examiner: Examiner, fits: Mapping[frozenset[str], CandidateFit], alone: CandidateFit):
        self.examiner, self.fits, self.alone = examiner, fits, alone
        self._changes: dict[str, np.ndarray] = {}

    def together(self, group: Sequence[str]) -> float:
        """Sum of squares left if the changes that each effect makes alone could be mixed freely."""
        rows, slopes = self._alone_without_instruments
        columns = np.stack([*map(self._change, group), *slopes.T], axis=1)
        gram, right = columns.T @ columns, columns.T @ rows
        taken = lstsq(gram, right, 1e-12)
        return float(rows @ rows - right @ taken)

    def one_more(self, added: frozenset[str]) -> dict[frozenset[str], float]:
        """Sums of squares left if one more effect stood beside a fitted set, by the larger set."""
        fit, promise = self.fits[added], dict[frozenset[str], float]()
        names, columns = self.examiner.columns(fit, self.fits, glance=True)
        without, cost = self.examiner.without_instruments, self.examiner.left(fit)
        columns = without(columns)
        left = Nuisance(without(fit.slopes), fit.prior_rows, fit.prior_slopes).project_out(columns)
        left = np.where(is_left(left, columns), left, 0.0)
        gain = (without(fit.rows) @ left) ** 2 / np.maximum(np.sum(left**2, axis=0), 1e-300)
        for name, less in zip(names, gain, strict=True):  # a name for each of its shapes
            promise[added | {name}] = min(promise.get(added | {name}, np.inf), cost - float(less))
        return promise

    @cached_property
    def _alone_without_instruments(self) -> tuple[np.ndarray, np.ndarray]:
        """Rows and slopes of the base fitted like the sets, without what instruments can make of them."""
        without = self.examiner.without_instruments
        return without(self.alone.rows), without(self.alone.slopes)

    def _change(self, name: str) -> np.ndarray:
        """What an effect changes the rows by where it is fitted alone, without what instruments could do as well."""
        if name not in self._changes:  # every effect stands in many sets
            change = self.fits[frozenset([name])].rows - self.alone.rows
            self._changes[name] = self.examiner.without_instruments(change)
        return self._changes[name]
