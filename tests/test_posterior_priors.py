"""Priors against scipy, as they are written in a model file, and what they do where the data are silent."""

import numpy as np
import pytest
from scipy import stats

from fitting.errors import InputError
from fitting.least_squares.fit import fit
from fitting.model_files.model_file import read_model
from fitting.posterior.quick import quick_look
from fitting.posterior.sample import sample
from fitting.problem.priors import Prior, read_prior, spread
from mckibben_jax.effects import ForceOffset, IdealCylinder
from tests.exact_instruments import trusting
from tests.test_posterior import loops

LAWS = [
    (Prior("normal", 3.0, 0.5), stats.norm(3.0, 0.5), (0.0, 10.0)),
    (Prior("normal", 3.0, 2.0), stats.norm(3.0, 2.0), (2.0, 4.0)),
    (Prior("log-normal", 2.0, 1.5), stats.lognorm(np.log(1.5), scale=2.0), (1e-3, 100.0)),
    (Prior("half-normal", 0.0, 2.0), stats.halfnorm(scale=2.0), (0.0, 50.0)),
    (Prior("uniform", 1.0, 4.0), stats.uniform(1.0, 3.0), (0.0, 10.0)),
]


@pytest.mark.parametrize(("prior", "law", "ends"), LAWS)
def test_densities_and_spreads_are_those_of_scipy(prior, law, ends):
    lower, upper = prior.ends(*ends)
    x = np.linspace(lower + 1e-6, upper, 7)
    ours, theirs = prior.log_density(x), law.logpdf(x)
    np.testing.assert_allclose(ours - ours[0], theirs - theirs[0], atol=1e-10)
    grid = np.linspace(lower, upper, 400_001)
    weight = law.pdf(grid)
    mean = np.average(grid, weights=weight)
    expected = np.sqrt(np.average((grid - mean) ** 2, weights=weight))
    assert spread(prior, *ends) == pytest.approx(expected, rel=2e-3)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"kind": "normall", "mean": "7 mm", "sd": "1 mm"}, "normal"),
        ({"kind": "normal", "mean": "7 mm"}, "lacks sd"),
        ({"kind": "normal", "mean": "7 kPa", "sd": "1 mm"}, "a length"),
        ({"kind": "normal", "mean": "7 mm", "sd": "-1 mm"}, "positive"),
        ({"kind": "uniform", "from": "7 mm", "to": "6 mm"}, "above"),
        ({"kind": "log-normal", "median": "7 mm", "factor": "0.9"}, "above 1"),
        ({"kind": "half-normal", "sd": "1 mm", "mean": "2 mm"}, "mean"),
        ("normal", "no kind"),
    ],
)
def test_a_prior_that_makes_no_sense_is_one_message(given, words):
    with pytest.raises(InputError, match=words):
        read_prior(given, "m", "muscle.radius")


MODEL = """format = 1
[muscle]
length = "300 mm"
radius = { value = "7 mm", prior = { kind = "normal", mean = "7.05 mm", sd = "0.02 mm" } }
braid_angle = "20 deg"
[[effect]]
name = "ideal_cylinder"
[[effect]]
name = "force_offset"
F_off = { value = "1 N", prior = { kind = "half-normal", sd = "20 N" } }
"""


def read(path, text):
    (path / "model.toml").write_text(text, encoding="utf-8")
    known = {"ideal_cylinder": IdealCylinder, "force_offset": ForceOffset}
    return read_model(path / "model.toml", known)


def test_priors_are_read_from_a_model_file(tmp_path):
    found = read(tmp_path, MODEL).priors
    assert found["force_offset.F_off"] == Prior("half-normal", 0.0, 20.0)
    assert found["muscle.radius"].kind == "normal"
    np.testing.assert_allclose([found["muscle.radius"].first, found["muscle.radius"].second], [7.05e-3, 2e-5])


def test_a_bad_prior_in_a_model_file_names_its_line(tmp_path):
    with pytest.raises(InputError, match="row 10") as caught:
        read(tmp_path, MODEL.replace("20 N", "20 kPa"))
    assert "a force" in str(caught.value)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ('prior = { kind = "uniform", from = "600 N", to = "700 N" }', "lies outside the range"),
        ('prior = { kind = "normal", mean = "-700 N", sd = "20 N" }', "lies outside the range"),
        ('proir = { kind = "half-normal", sd = "20 N" }', "did you mean 'prior'"),
    ],
)
def test_a_prior_that_would_say_nothing_is_refused(tmp_path, given, words):
    """Beyond the range of the parameter, or under a name that nobody reads."""
    with pytest.raises(InputError, match=words) as caught:
        read(tmp_path, MODEL.replace('prior = { kind = "half-normal", sd = "20 N" }', given))
    assert caught.value.row == 10


def test_a_wide_prior_or_one_at_the_end_of_a_range_is_taken(tmp_path):
    for given in ('mean = "0 N", sd = "1 MN"', 'mean = "510 N", sd = "20 N"'):
        read(tmp_path, MODEL.replace('kind = "half-normal", sd = "20 N"', f'kind = "normal", {given}'))


def test_each_data_set_of_a_model_file_has_its_own_priors(tmp_path):
    other = '[muscle_of.long]\nradius = { value = "8 mm", prior = { kind = "normal", mean = "8 mm", sd = "0.1 mm" } }\n'
    found = read(tmp_path, MODEL + other).priors
    assert found["muscle.radius@long"] == Prior("normal", pytest.approx(8e-3), pytest.approx(1e-4))
    assert found["muscle.radius"].first == pytest.approx(7.05e-3)


def test_a_prior_beyond_the_range_is_refused_before_anything_is_sampled():
    effects = (IdealCylinder(), ForceOffset(F_off=1.0))
    found = fit([loops(*effects, noise=5.0, priors={"muscle.radius": (7e-3, 1e-4)}, count=40)], effects, starts=2)
    with pytest.raises(InputError, match="lies outside the range"):
        quick_look(found, priors={"muscle.radius": Prior("normal", 7e-2, 1e-4)})


@pytest.mark.parametrize(
    ("prior", "words"),
    [
        (Prior("normal", 60.0, 5.0), "standard deviations away from their priors"),
        (Prior("log-normal", 30.0, 1.1), "standard deviations away from their priors"),
        (Prior("uniform", 30.0, 60.0), "the priors keep the model away from what fits"),
        (Prior("normal", 4.0, 1.0), None),
        (Prior("uniform", 0.0, 60.0), None),
    ],
)
def test_a_prior_against_which_the_data_speak_is_warned_of(prior, words):
    """The offset is 3 N; 40 readings at 5 N tell it within 1 N."""
    effects = (IdealCylinder(), ForceOffset(F_off=3.0))
    found = trusting(fit([loops(*effects, noise=5.0, count=40)], effects, starts=2))
    posterior = quick_look(found, priors={"force_offset.F_off": prior}, draws=1000)
    told = [w for w in posterior.warnings if "prior" in w]
    assert (len(told) > 0) == (words is not None), posterior.warnings
    assert posterior.calibrated == (words is None)
    assert words is None or words in told[0]


def test_a_stated_prior_speaks_where_the_data_are_silent():
    """At 30 Pa the radius cannot be seen: its posterior is its prior, here log-normal, in place of muscle.toml's."""
    effects = (IdealCylinder(), ForceOffset(F_off=1.0))
    priors = {"muscle.radius": (7e-3, 3e-4)}
    found = fit([loops(*effects, pressure=30.0, noise=5.0, priors=priors, count=40)], effects, starts=2)
    stated = {"muscle.radius": Prior("log-normal", 7.2e-3, 1.02)}
    q = sample(found, seed=0, max_steps=400, priors=stated).parameters["muscle.radius"]
    law = stats.lognorm(np.log(1.02), scale=7.2e-3)
    np.testing.assert_allclose([q.q05, q.median, q.q95], law.ppf([0.05, 0.5, 0.95]), atol=1.5e-5)
    assert q.contraction < 0.1
    assert q.prior_sensitivity > 0.05
    assert "log-normal" in q.prior
