"""The banded algebra behind the estimated inputs, against the same with whole matrices in numpy."""

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from fitting.recordings import contrasts as algebra
from fitting.recordings.contrasts import FREE, clock, contrasts_of

RATIO = 0.03


@pytest.fixture(params=["even", "uneven"])
def made(request):
    """Times in mean steps, readings, contrasts, and the matrix D that takes readings to contrasts."""
    random = np.random.default_rng(3)
    time = np.arange(24.0) if request.param == "even" else np.cumsum(random.uniform(0.3, 2.0, 24))
    at = clock(time)
    readings = np.sin(at / 4) + 0.1 * random.normal(size=24)
    return at, readings, contrasts_of(at, readings, 1e-6), matrix(at)


def matrix(at):
    step, d = np.diff(at), np.zeros((len(at) - 2, len(at)))
    for i in range(len(at) - 2):
        d[i, i : i + 3] = 1 / step[i], -1 / step[i] - 1 / step[i + 1], 1 / step[i + 1]
    return d


def walk(at):
    """Covariance of readings whose slope walks at random, q = 1: the integrated Wiener process (n, n)."""
    since = at - at[0]
    first, last = np.minimum(*np.meshgrid(since, since)), np.maximum(*np.meshgrid(since, since))
    return first**2 * (3 * last - first) / 6


def whole(d, at, ratio):
    return d @ (np.eye(len(at)) + ratio * walk(at)) @ d.T


def dense(factor):
    """A lower Cholesky factor from its bands."""
    return sum(np.diag(factor[k, : factor.shape[1] - k], -k) for k in range(3))


def test_contrasts_are_second_differences_with_the_covariance_of_noise_and_a_walking_slope(made):
    at, readings, contrasts, d = made
    np.testing.assert_allclose(contrasts.z, d @ readings)
    factor = dense(contrasts.factor(RATIO))
    np.testing.assert_allclose(factor @ factor.T, whole(d, at, RATIO), atol=1e-12)


def test_a_slope_that_is_free_is_not_resisted(made):
    at, _, contrasts, d = made
    free = np.zeros(len(contrasts.z), bool)
    free[7] = True
    factor = dense(algebra.replace(contrasts, free=free).factor(RATIO))
    np.testing.assert_allclose(factor @ factor.T - whole(d, at, RATIO), FREE * np.diag(free), atol=1e-5)


def test_the_misfit_is_minus_twice_the_likelihood_of_the_contrasts(made):
    at, _, contrasts, d = made
    covariance = whole(d, at, RATIO)
    variance = contrasts.z @ np.linalg.solve(covariance, contrasts.z) / len(contrasts.z)
    likelihood = multivariate_normal(np.zeros(len(contrasts.z)), variance * covariance).logpdf(contrasts.z)
    assert contrasts.misfit_at(RATIO) == pytest.approx(-2 * likelihood - len(contrasts.z) * np.log(2 * np.pi))


@pytest.mark.parametrize(("least", "most"), [(5.0, np.inf), (0.0, 1e-9)])
def test_the_variance_stays_within_what_is_known_of_it(made, least, most):
    at, readings, *_ = made
    variance = contrasts_of(at, readings, least, most).variance(1.0)
    assert variance == (least if least else most)


def test_the_size_of_pure_noise_is_its_log_determinant(made):
    at, _, contrasts, d = made
    assert algebra.size_of_noise(at, contrasts) == pytest.approx(np.linalg.slogdet(d @ d.T)[1], rel=1e-9)


def test_bands_of_the_inverse_and_what_levels_gain_by_it(made):
    at, _, contrasts, d = made
    inverse = np.linalg.inv(whole(d, at, RATIO))
    bands = algebra.inverse_bands(contrasts.factor(RATIO))
    for k in range(3):
        np.testing.assert_allclose(bands[k, : len(inverse) - k], np.diag(inverse, -k), rtol=1e-7, atol=1e-10)
    np.testing.assert_allclose(algebra.explained(contrasts.weights, bands), np.diag(d.T @ inverse @ d), rtol=1e-7)
    values = np.arange(1.0, len(inverse) + 1)
    np.testing.assert_allclose(algebra.spread(contrasts.weights * values), d.T @ values, atol=1e-12)


def test_pieces_of_a_long_run_have_each_its_own_likelihood(made, monkeypatch):
    at, _, contrasts, d = made
    assert contrasts.pieces() is contrasts
    monkeypatch.setattr(algebra, "PIECES", 3)
    monkeypatch.setattr(algebra, "LONGEST", 6)
    pieces = contrasts.pieces()
    starts = [0, 8, 16]
    rows = np.concatenate([np.arange(start, start + 6) for start in starts])
    np.testing.assert_array_equal(pieces.z, contrasts.z[rows])
    factor = dense(pieces.factor(RATIO))
    blocks = np.zeros((18, 18))
    for k, start in enumerate(starts):
        own = slice(start, start + 6)
        blocks[6 * k : 6 * k + 6, 6 * k : 6 * k + 6] = whole(d, at, RATIO)[own, own]
    np.testing.assert_allclose(factor @ factor.T, blocks, atol=1e-12)


def test_readings_at_one_time_stand_apart():
    at = clock(np.array([0.0, 1.0, 1.0, 2.0, 3.0]))
    assert np.diff(at).min() == pytest.approx(algebra.NEAREST)
    assert at.mean() == pytest.approx(0.0, abs=1e-12)
