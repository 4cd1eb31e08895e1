"""Singular values, bases and least squares that always arrive.

LAPACK's fast (divide and conquer) drivers were seen to give up on well-formed matrices of finite numbers; then the
slower ones are asked.
"""

import numpy as np
from scipy import linalg


def svd(columns: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Left vectors (rows, k), singular values (k,) and right vectors (k, columns)."""
    try:
        return tuple(np.linalg.svd(columns, full_matrices=False))  # type: ignore[return-value]
    except np.linalg.LinAlgError:
        return linalg.svd(columns, full_matrices=False, lapack_driver="gesvd")


def orthonormal(columns: np.ndarray, least: float = 1e-6) -> np.ndarray:
    """An orthonormal basis of the span of columns (rows, q), of which each counts alike however long it is.

    Directions of less than the `least` share of the largest singular value are left out. The eigenvectors of the
    columns' products give it in a third of the time of their singular values; a second pass makes up for what squaring
    loses of the weakest directions.
    """
    scaled = columns / np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
    try:
        return _straightened(_straightened(scaled, least**2))
    except np.linalg.LinAlgError:
        left, strength, _ = svd(scaled)
        return left[:, strength > least * strength[0]]


def _straightened(columns: np.ndarray, least: float = 0.0) -> np.ndarray:
    """Columns of about the same span whose products are nearly those of an orthonormal basis."""
    if not columns.shape[1]:
        return columns
    square, turn = np.linalg.eigh(columns.T @ columns)
    kept = square > least * square[-1]
    return columns @ (turn[:, kept] / np.sqrt(square[kept]))


def lstsq(columns: np.ndarray, wanted: np.ndarray, rcond: float) -> np.ndarray:
    """The least solution (columns,) or (columns, m) of `columns @ solution = wanted`."""
    try:
        return np.linalg.lstsq(columns, wanted, rcond=rcond)[0]
    except np.linalg.LinAlgError:
        solved = linalg.lstsq(columns, wanted, cond=rcond, lapack_driver="gelss")
        assert solved is not None
        return np.asarray(solved[0])
