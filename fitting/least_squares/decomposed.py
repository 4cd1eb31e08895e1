"""Singular values and least squares that always arrive.

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


def lstsq(columns: np.ndarray, wanted: np.ndarray, rcond: float) -> np.ndarray:
    """The least solution (columns,) or (columns, m) of `columns @ solution = wanted`."""
    try:
        return np.linalg.lstsq(columns, wanted, rcond=rcond)[0]
    except np.linalg.LinAlgError:
        solved = linalg.lstsq(columns, wanted, cond=rcond, lapack_driver="gelss")
        assert solved is not None
        return np.asarray(solved[0])
