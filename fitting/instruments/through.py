"""Rows seen through instruments that err: what they can make of them counts for little when rows are made small."""

from typing import Any

import equinox as eqx
import numpy as np

Array = Any  # of numpy on the host, of jax inside a compiled function
SIZES = (64, 128, 256, 512, 1024)  # of errors: a program is compiled for each


class Through(eqx.Module):
    """A root of the inverse of 1 + U U', the covariance of white noise beside errors U of one standard deviation each.

    `errors` is U (rows, errors), with columns of zeros up to a standard number; see `roots` for the others.
    """

    errors: Array
    taken: Array  # M (errors, errors)
    back: Array  # N (errors, errors)

    @classmethod
    def of(cls, errors: np.ndarray, size: int) -> "Through":
        """For errors (rows, at most `size`)."""
        count = errors.shape[1]
        wide, taken, back = np.zeros((len(errors), size)), np.zeros((size, size)), np.zeros((size, size))
        wide[:, :count] = errors
        taken[:count, :count], back[:count, :count] = roots(errors)
        return cls(wide, taken, back)

    @classmethod
    def nothing(cls, rows: int, size: int = SIZES[0]) -> "Through":
        """Instruments that do not err."""
        return cls.of(np.zeros((rows, 0)), size)

    @property
    def exact(self) -> "Through":
        """Instruments that do not err, for the same compiled program."""
        return Through.nothing(*self.errors.shape)

    def __call__(self, rows: Array) -> Array:
        """Rows (rows,) or columns (rows, q) as a search sees them."""
        return rows - self.errors @ (self.taken @ (self.errors.T @ rows))

    def undone(self, rows: Array) -> Array:
        """The rows or columns that are seen so."""
        return rows + self.errors @ (self.back @ (self.errors.T @ rows))


def roots(errors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """M and N (errors, errors) of the roots 1 - U M U' of (1 + U U')^-1, and 1 + U N U' of 1 + U U'.

    With U' U = V diag(s^2) V' and r = sqrt(1 + s^2), M is V diag(1/(r (1 + r))) V', and N is V diag(1/(1 + r)) V': only
    matrices as small as there are errors are decomposed, and an error that is not felt makes no 0/0.
    """
    square, turn = np.linalg.eigh(errors.T @ errors)
    root = np.sqrt(1 + np.maximum(square, 0.0))
    return (turn / (root * (1 + root))) @ turn.T, (turn / (1 + root)) @ turn.T


def standard_number(errors: int) -> int | None:
    """The number of columns to which so many errors are filled up; None where they are too many for a search."""
    return next((size for size in SIZES if size >= errors), None)
