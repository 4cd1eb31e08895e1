"""Rows seen through instruments that err: what they can make of them counts for little when rows are made small."""

from functools import lru_cache
from typing import Any

import equinox as eqx
import numpy as np

Array = Any  # of numpy on the host, of jax inside a compiled function
SIZES = (64, 128, 256, 512, 1024)  # of errors: a program is compiled for each
NEGLIGIBLE = 1e-8  # sum of squares of a column, in units of the noise: seen through it, rows change by half as much


class Through(eqx.Module):
    """A root of the inverse of 1 + U U', the covariance of white noise beside errors U of one standard deviation each.

    The columns of U are at right angles, for what they are of is U U' alone: the root is 1 - U M U' with a diagonal M,
    and errors that act alike, as those of a length and of a gain do in a run at one length, take one column.
    """

    errors: Array  # U (rows, size), with columns of zeros up to a standard number
    taken: Array  # M (size,)
    back: Array  # N (size,) of the root 1 + U N U' of 1 + U U'

    @classmethod
    def of(cls, errors: np.ndarray, least: int = 0) -> "Through":
        """For errors (rows, any number), in the smallest standard number of columns, and in at least so many.

        ValueError where more of them are independent than any standard number.
        """
        square, turn = np.linalg.eigh(errors.T @ errors)
        felt = square > NEGLIGIBLE
        count = int(felt.sum())
        size = standard_number(max(count, least))
        if size is None:
            raise ValueError(f"{count} independent errors; a search has room for {SIZES[-1]}")
        wide, taken, back = np.zeros((len(errors), size)), np.zeros(size), np.zeros(size)
        grown = np.sqrt(1 + square[felt])
        wide[:, :count], taken[:count], back[:count] = (
            errors @ turn[:, felt],
            1 / (grown * (1 + grown)),
            1 / (1 + grown),
        )
        return cls(wide, taken, back)

    @staticmethod
    def nothing(rows: int, size: int = SIZES[0]) -> "Through":
        """Instruments that do not err."""
        return _nothing(rows, size)

    @property
    def exact(self) -> "Through":
        """Instruments that do not err, for the same compiled program."""
        return _nothing(*self.errors.shape)

    @property
    def size(self) -> int:
        """The standard number of columns."""
        return self.errors.shape[1]

    def __call__(self, rows: Array) -> Array:
        """Rows (rows,) or columns (rows, q) as a search sees them."""
        return rows - self.errors @ _scaled(self.taken, (rows.T @ self.errors).T)

    def undone(self, rows: Array) -> Array:
        """The rows or columns that are seen so."""
        return rows + self.errors @ _scaled(self.back, (rows.T @ self.errors).T)


@lru_cache(maxsize=4)
def _nothing(rows: int, size: int) -> Through:
    """Megabytes of zeros, which each look at the rows of a model would else make anew."""
    return Through(np.zeros((rows, size)), np.zeros(size), np.zeros(size))


def _scaled(factors: Array, rows: Array) -> Array:
    return (rows.T * factors).T


def root(errors: np.ndarray) -> np.ndarray:
    """M (errors, errors) of the root 1 - U M U' of (1 + U U')^-1.

    With U' U = V diag(s^2) V' and r = sqrt(1 + s^2), M is V diag(1/(r (1 + r))) V': only a matrix as small as there are
    errors is decomposed, and an error that is not felt makes no 0/0.
    """
    square, turn = np.linalg.eigh(errors.T @ errors)
    grown = np.sqrt(1 + np.maximum(square, 0.0))
    return (turn / (grown * (1 + grown))) @ turn.T


def standard_number(errors: int) -> int | None:
    """The number of columns to which so many errors are filled up; None where they are too many for a search."""
    return next((size for size in SIZES if size >= errors), None)
