"""Do the intervals hold what they say? Coverage by simulation, warnings when physics is missing, and three samplers.

The long versions print what they found: `python -m pytest tests/test_posterior_studies.py -m slow -s`.
"""

import numpy as np
import pytest
from scipy import stats

from fitting.least_squares import fit
from fitting.posterior import sample
from fitting.sampling.nuts import sample_nuts
from fitting.sampling.priors import Prior
from fitting.sampling.quick import quick_look
from mckibben_jax.effects import (
    BladderNeoHookean,
    CoulombFriction,
    ForceOffset,
    IdealCylinder,
    Presliding,
    Tip,
    ViscousDamping,
)
from tests.test_posterior import fading, loops, straight_line

PRIORS = {
    "coulomb_friction.f_s": Prior("uniform", 0.005, 0.03),
    "force_offset.F_off": Prior("normal", 0.0, 2.0),
    "tip.k": Prior("log-normal", 1.1, 1.05),
}
SIZE = {"count": 40, "repeats": 2, "runs": 6}


def drawn(random):
    """A truth from the prior."""
    return {
        "coulomb_friction.f_s": random.uniform(0.005, 0.03),
        "force_offset.F_off": 2.0 * random.standard_normal(),
        "tip.k": 1.1 * 1.05 ** random.standard_normal(),
    }


def model_of(values):
    return (
        IdealCylinder(),
        Tip(k=values["tip.k"]),
        CoulombFriction(f_s=values["coulomb_friction.f_s"]),
        ForceOffset(F_off=values["force_offset.F_off"]),
    )


def errors_of(number):
    """White, fading, or shared by a run: each in its turn."""
    return (fading(0.0), fading(0.8), fading(0.7, white=0.5), fading(0.0, offset=0.7))[number % 4]


def ranks(number, how):
    """Where the truth lies among the draws, as a share, for every parameter; whether anything was warned of."""
    random = np.random.default_rng(number)
    truth = drawn(random)
    experiment = loops(*model_of(truth), noise=1.0, seed=number, errors=errors_of(number), **SIZE)
    found = fit([experiment], model_of(drawn(np.random.default_rng(0))), starts=2)
    posterior = how(found)
    draws = posterior.draws.values.reshape(-1, posterior.draws.values.shape[-1])
    share = {name: float(np.mean(draws[:, posterior.draws.names.index(name)] < truth[name])) for name in truth}
    return share, not posterior.calibrated


def by_quick(found):
    posterior = quick_look(found, priors=PRIORS, draws=1000)
    return posterior if posterior.settled else by_emcee(found)


def by_emcee(found):
    return sample(found, priors=PRIORS, max_steps=400, limit_s=1e4)


def coverage(count, how):
    """Shares of 90 % intervals that hold the truth, p of uniform ranks, by parameter; and the share of false alarms."""
    found = [ranks(number, how) for number in range(count)]
    held = {name: np.mean([0.05 < share[name] < 0.95 for share, _ in found]) for name in PRIORS}
    uniform = {name: stats.kstest([share[name] for share, _ in found], "uniform").pvalue for name in PRIORS}
    return held, uniform, np.mean([alarm for _, alarm in found])


def test_a_dozen_data_sets_from_the_prior():
    """Few, so only gross errors show: of 36 intervals of 90 %, 27 to 36 hold the truth in 99.8 of 100 cases."""
    held, uniform, _ = coverage(12, by_quick)
    assert stats.binom(36, 0.9).cdf(26) < 0.005
    assert sum(held.values()) * 12 >= 27
    assert min(uniform.values()) > 1e-3


@pytest.mark.slow
@pytest.mark.timeout(7200)
def test_coverage_of_200_data_sets_from_the_prior():
    held, uniform, alarms = coverage(200, by_quick)
    print({"held": held, "p_of_uniform_ranks": uniform, "false_alarms": alarms})
    assert all(0.86 <= share <= 0.94 for share in held.values())
    assert min(uniform.values()) > 0.01


LEFT_OUT = (
    BladderNeoHookean(G=2e5),
    Tip(k=1.05),
    Presliding(x_s=0.004),
    ViscousDamping(B=2000.0),
)


def warned(number):
    """Whether a fit without one of the effects is warned of."""
    extra = LEFT_OUT[number % len(LEFT_OUT)]
    truth = (IdealCylinder(), CoulombFriction(f_s=0.015), extra)
    experiment = loops(*truth, noise=1.0, seed=number, errors=fading(0.5), **SIZE)
    found = fit([experiment], (IdealCylinder(), CoulombFriction()), starts=2)
    return not quick_look(found, draws=500).calibrated


@pytest.mark.slow
def test_a_left_out_effect_is_warned_of():
    assert all(warned(number) for number in range(4))


@pytest.mark.slow
@pytest.mark.timeout(7200)
def test_a_left_out_effect_is_warned_of_in_95_of_100():
    share = np.mean([warned(number) for number in range(100)])
    print({"warned": share})
    assert share >= 0.95


def grid(found):
    """Quantiles on a brute grid: two parameters, the size of the noise integrated by hand (flat in its logarithm)."""
    slopes, rows, count = found.slopes, found.residual / found.samples.sigma, len(found.samples)
    at = np.array([found.values[name] for name in found.free])
    error = np.sqrt(np.diag(found.covariance))
    axes = [np.linspace(c - 7 * e, c + 7 * e, 401) for c, e in zip(at, error, strict=True)]
    x, y = np.meshgrid(*axes, indexing="ij")
    moved = rows[:, None] + slopes @ np.stack([x.ravel() - at[0], y.ravel() - at[1]])
    log = -0.5 * count * np.log(np.sum(moved**2, axis=0)).reshape(x.shape)
    weight = np.exp(log - log.max())
    quantiles = []
    for axis, values in enumerate(axes):
        mass = np.cumsum(weight.sum(axis=1 - axis))
        quantiles.append(np.interp([0.05, 0.5, 0.95], (mass - 0.5 * np.diff(mass, prepend=0)) / mass[-1], values))
    return np.array(quantiles), error


@pytest.mark.slow
def test_the_same_posterior_from_emcee_nuts_the_quick_look_and_a_grid():
    pytest.importorskip("blackjax")
    found, _ = straight_line()
    expected, error = grid(found)
    for how in (
        lambda: sample(found, seed=1, max_steps=400, limit_s=1e4),
        lambda: sample_nuts(found, seed=1, draws=700),
        lambda: quick_look(found, seed=1),
    ):
        posterior = how()
        for name, quantiles, width in zip(found.free, expected, error, strict=True):
            q = posterior.parameters[name]
            atol = 4 * 2.1 * width / np.sqrt(min(q.ess_tail, q.ess_bulk))
            np.testing.assert_allclose([q.q05, q.median, q.q95], quantiles, atol=atol, err_msg=posterior.method)


def test_readings_lie_in_the_band_as_often_as_they_should():
    found, _ = straight_line()
    shares = [band.inside for band in quick_look(found, draws=1000).bands]
    count = len(found.samples)
    assert np.mean(shares) == pytest.approx(0.9, abs=4 * np.sqrt(0.09 / count))


def test_the_quick_look_fails_its_own_check_where_it_must(monkeypatch):
    """Draws from far too narrow a proposal, rightly weighted: a few of them carry everything."""
    monkeypatch.setattr("fitting.sampling.moves.SCALE", 0.1)
    posterior = quick_look(straight_line()[0], draws=1000)
    assert not posterior.settled
    assert "fails its own check" in posterior.warnings[0]
