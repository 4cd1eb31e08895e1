"""What is asked when LAPACK's fast drivers give up."""

import numpy as np
import pytest

from fitting.least_squares import decomposed

COLUMNS = np.random.default_rng(0).normal(size=(40, 6)) @ np.diag([1.0, 1.0, 1.0, 1.0, 1e-3, 0.0])
WANTED = np.random.default_rng(1).normal(size=(40, 2))


def given_up(*_, **__):
    raise np.linalg.LinAlgError("SVD did not converge")


@pytest.mark.parametrize("fast", [True, False])
def test_both_drivers_give_the_same(monkeypatch, fast):
    expected = np.linalg.pinv(COLUMNS, rcond=1e-10) @ WANTED
    if not fast:
        monkeypatch.setattr(np.linalg, "svd", given_up)
        monkeypatch.setattr(np.linalg, "lstsq", given_up)
    left, sizes, right = decomposed.svd(COLUMNS)
    np.testing.assert_allclose(left * sizes @ right, COLUMNS, atol=1e-13)
    np.testing.assert_allclose(decomposed.lstsq(COLUMNS, WANTED, 1e-10), expected, rtol=1e-9, atol=1e-12)
