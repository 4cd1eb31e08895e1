"""Exponents of laws that were put in, and none where nothing can be known: a fit is only its rows and slopes here."""

from types import SimpleNamespace

import numpy as np
import pytest
from test_flips import autoregression

from fitting.comparison.fingerprint import exponents
from fitting.problem.residuals import Samples

PRESSURES, SPEEDS, HALF = (1e5, 2e5, 3e5, 4e5), (0.005, 0.01, 0.02), 60


def recorded() -> Samples:
    """One loop at every pressure and speed."""
    runs = [(pressure, speed) for speed in SPEEDS for pressure in PRESSURES]
    n = len(runs) * 2 * HALF
    run = np.repeat(np.arange(len(runs)), 2 * HALF)
    branch = np.tile(np.repeat([1.0, -1.0], HALF), len(runs))
    ramp = np.linspace(0.0, 0.2, HALF)
    zero = np.zeros(n)
    pressure, speed = np.array(runs)[run].T
    return Samples(
        dataset=zero.astype(int), recording=zero.astype(int), run=run, loop=zero.astype(int),
        half=(branch < 0).astype(int), row=np.arange(n), time=np.arange(n) * 0.1,
        contraction=np.tile(np.concatenate([ramp, ramp[::-1]]), len(runs)), pressure=pressure, rate=branch * speed,
        pressure_rate=zero, branch=branch, measured=zero, sigma=zero + 0.5,
        position=np.tile(np.arange(2 * HALF), len(runs)),
    )  # fmt: skip


SAMPLES = recorded()
X, P, SIGN = SAMPLES.contraction, SAMPLES.pressure / 4e5, SAMPLES.branch
# what a baseline can do: a pull of the braid, friction in proportion to pressure; its priors state nothing
SLOPES = np.stack([P * (1 - X) ** 2, P, SIGN * P], axis=1) / 0.5


def found(missing, noise=0.0, memory=0.0, seed=0, samples=SAMPLES):
    """The exponents of what a fit has left of a missing force and of noise, both in newtons."""
    rows = (noise * autoregression(memory, len(samples), np.random.default_rng(seed)) + missing) / samples.sigma
    slopes = SLOPES[: len(samples)]
    rows = rows - slopes @ np.linalg.lstsq(slopes, rows, rcond=None)[0]
    fit = SimpleNamespace(
        samples=samples, residual=rows * samples.sigma, slopes=np.vstack([slopes, np.zeros((1, 3))]),
        prior_rows=np.zeros(1),
    )  # fmt: skip
    return exponents(fit, np.ones(len(samples), bool))


@pytest.mark.parametrize("power", [-0.2, 0.0, 0.6, 2.0])
@pytest.mark.parametrize("shape", [np.sin(12 * X), 1 - 3 * X], ids=["wave", "slope"])
def test_an_even_law_has_its_exponent(power, shape):
    even, odd, fast = found(40 * P**power * shape, noise=0.5)
    assert even == pytest.approx(power, abs=0.06)
    assert odd is None
    assert fast is None


@pytest.mark.parametrize(("power", "speed"), [(0.5, 0.0), (0.5, 0.6), (2.0, 1.0)])
def test_an_odd_law_has_both_exponents(power, speed):
    fast = np.abs(SAMPLES.rate) / 0.02
    even, odd, own = found(40 * SIGN * P**power * fast**speed * (1 - 2 * X), noise=0.5)
    assert even is None
    assert odd == pytest.approx(power, abs=0.06)
    assert own == pytest.approx(speed, abs=0.06)


def test_a_ripple_that_few_hats_cannot_follow_has_its_exponent():
    """A period of a twelfth of the stroke, odd or even."""
    ripple = np.sin(2 * np.pi * X / 0.017)
    assert found(10 * P**2 * ripple, noise=0.5)[0] == pytest.approx(2.0, abs=0.06)
    assert found(10 * SIGN * P**2 * ripple, noise=0.5)[1] == pytest.approx(2.0, abs=0.06)


def test_what_fades_slowly_defines_no_exponent_where_independent_readings_would():
    """The same force in noise of the same size: an exponent is known if errors do not come in stretches."""
    force, seeds = 2.0 * np.sin(12 * X), range(12)
    white = [found(force, noise=0.8, seed=seed)[0] for seed in seeds]
    slow = [found(force, noise=0.8, memory=0.97, seed=seed)[0] for seed in seeds]
    stated = lambda many: sum(one is not None for one in many)  # noqa: E731
    assert stated(white) >= 10
    assert stated(slow) <= 3
    assert max(abs(one) for one in white if one is not None) < 0.4


def test_one_pressure_and_one_direction_define_nothing():
    """And a held length is one place."""
    one = SAMPLES.where(SAMPLES.pressure == 1e5)
    assert found(10 * np.sin(12 * one.contraction), samples=one)[0] is None
    up = SAMPLES.where(SAMPLES.branch > 0)
    assert found(10 * up.pressure / 4e5 * np.sin(12 * up.contraction), samples=up)[1:] == (None, None)
    held = SAMPLES.where(SAMPLES.contraction < 1e-9)
    law = 30 * (held.pressure / 4e5) ** 2
    assert found(law, samples=held)[0] == pytest.approx(2.0, abs=0.06)
