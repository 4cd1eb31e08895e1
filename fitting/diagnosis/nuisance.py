"""How the parameters of a fitted model may give way before anything is called missing from it."""

from dataclasses import dataclass

import numpy as np

from fitting.diagnosis.candidate_fit import CandidateFit
from fitting.instruments.errors import InstrumentWhitener
from fitting.least_squares.decomposed import lstsq

SEEN = 1e-6  # share of a column below which what is left of it is rounding, and points anywhere


@dataclass(frozen=True)
class Nuisance:
    """How a fitted set may give way: slopes of its rows (rows, k), and rows (p) and slopes (p, k) of its priors."""

    slopes: np.ndarray
    prior_rows: np.ndarray
    prior_slopes: np.ndarray

    @classmethod
    def of(cls, fit: CandidateFit) -> "Nuisance":
        """That of a fitted set."""
        return cls(fit.slopes, fit.prior_rows, fit.prior_slopes)

    def beside(self, columns: np.ndarray) -> "Nuisance":
        """The same with more that may give way, of which nothing is known: unit columns of these (rows, m)."""
        unit = columns / np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
        unknown = np.zeros((len(self.prior_rows), columns.shape[1]))
        return Nuisance(np.hstack([self.slopes, unit]), self.prior_rows, np.hstack([self.prior_slopes, unknown]))

    def project_out(self, columns: np.ndarray) -> np.ndarray:
        """What is left of columns (rows, m) when everything has given way to them, as far as priors let it."""
        whole = np.vstack([self.slopes, self.prior_slopes])
        target = np.vstack([columns, np.zeros((len(self.prior_slopes), columns.shape[1]))])
        return columns - self.slopes @ lstsq(whole, target, 1e-12)

    def left(self, rows: np.ndarray, without: InstrumentWhitener) -> float:
        """Sum of squares that is left when parameters, and instruments within their accuracy, have given way."""
        whole = np.vstack([without(self.slopes), self.prior_slopes])
        target = np.concatenate([without(rows), self.prior_rows])
        return float(np.sum((target - whole @ lstsq(whole, target, 1e-12)) ** 2))


def is_left(left: np.ndarray, whole: np.ndarray) -> np.ndarray:
    """Of which columns (rows, q) more is left than rounding when something was taken from the whole ones (q,)."""
    return np.linalg.norm(left, axis=0) > SEEN * np.linalg.norm(whole, axis=0)
