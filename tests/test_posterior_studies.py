"""Do the intervals hold what they say? Coverage by simulation, warnings when physics is missing, and three samplers.

The long versions print what they found: `python -m pytest tests/test_posterior_studies.py -m slow -s`; on two cores at
once, and with a page: `python -m tests.calibration`.
"""

import numpy as np
import pytest
from scipy import stats

from fitting.posterior.nuts import sample_nuts
from fitting.posterior.quick import quick_look
from fitting.posterior.sample import sample
from fitting.posterior.settings import MoveSettings
from tests.calibration.cases import GROUPS, Case, judged
from tests.calibration.page import inside, page
from tests.test_posterior import straight_line


def judged_all(count, group, quick=True):
    """Records of data sets drawn from the prior, see tests/calibration."""
    return [judged(Case(group, number, 0, quick)) for number in range(count)]


def test_eight_data_sets_from_the_prior():
    """Few, so only gross errors show: of 40 intervals of 90 %, 29 to 40 hold the truth in 999 of 1000 cases."""
    records = judged_all(8, GROUPS[0])
    held = np.concatenate([inside(records, name) for name in records[0]["parameters"]])
    ranks = [[r["parameters"][name]["rank"] for r in records] for name in records[0]["parameters"]]
    assert len(held) == 40
    assert stats.binom(40, 0.9).cdf(28) < 0.001
    assert held.sum() >= 29
    assert min(stats.kstest(each, "uniform").pvalue for each in ranks) > 1e-3


@pytest.mark.slow
@pytest.mark.timeout(14400)
def test_coverage_of_200_data_sets_from_the_prior(tmp_path):
    records = judged_all(200, GROUPS[0], quick=False)
    print(page(records, "this test", "Nothing left out."))
    for name in records[0]["parameters"]:
        assert 0.86 <= np.mean(inside(records, name)) <= 0.94
        assert stats.kstest([r["parameters"][name]["rank"] for r in records], "uniform").pvalue > 0.01


def test_a_left_out_effect_is_warned_of():
    """Four effects, each large enough to leave more than the noise."""
    records = [judged(Case(GROUPS[1], number, 0, True)) for number in (0, 10, 13, 15)]
    seen = [r for r in records if r["misfit"] > 0.5]
    assert len(seen) >= 2
    assert not any(r["calibrated"] for r in seen)


@pytest.mark.slow
@pytest.mark.timeout(14400)
def test_a_left_out_effect_is_warned_of_in_95_of_100():
    """Of those that leave half a standard deviation of a reading once the model has been fitted."""
    records = judged_all(200, GROUPS[1])
    print(page(records, "this test", "An effect left out."))
    assert np.mean([not r["calibrated"] for r in records if r["misfit"] >= 0.5]) >= 0.95


def test_the_page_counts_what_the_records_say():
    """Twenty invented data sets: one interval of ten misses, every effect is warned of but a faint one."""
    parameters = [
        {"a.b": {"truth": 0.0, "rank": rank, "q05": -1.0, "q95": 1.0, "sd": 1.0}} for rank in (0.5,) * 9 + (0.99,)
    ]
    common = {"noise": "white", "method": "quick look", "settled": True, "seconds": 1.0, "readings": 9, "scale": 1.0,
              "fit": {"a.b": {"robust": 1.0, "iid": 2.0}}}  # fmt: skip
    sound = [
        {**common, "group": GROUPS[0], "parameters": one, "calibrated": True, "warnings": [], "left_out": None,
         "misfit": 0.0} for one in parameters
    ]  # fmt: skip
    words = ["the misfit in loops.csv is 3 times the noise"]
    wrong = [
        {**common, "group": GROUPS[1], "parameters": one, "calibrated": size < 0.5, "warnings": words[: size >= 0.5],
         "left_out": "tip", "misfit": size} for one, size in zip(parameters, (0.1, *(2.0,) * 9), strict=True)
    ]  # fmt: skip
    told = page([*sound, *wrong], "a command", "a test")
    assert "| a.b | 90.0 % (59.6 to 98.2)" in told
    assert "Warned without reason: 0.0 %" in told
    assert "Warned of: 90.0 %" in told
    assert "100.0 % (70.1 to 100.0) where the effect leaves 0.5 standard" in told
    assert "| tip | 9 of 10 | 0.10 |" in told
    assert "| a.b | robust | 0.00 | 100.0 %" in told
    assert "| a.b | iid | 0.00 | 0.0 %" in told


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
    monkeypatch.setattr("fitting.posterior.moves.MOVE", MoveSettings(scale=0.1))
    posterior = quick_look(straight_line()[0], draws=1000)
    assert not posterior.settled
    assert "fails its own check" in posterior.warnings[0]
