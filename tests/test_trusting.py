"""The error that is told of a set is the one that every other command finds: of a fit that trusts every reading."""

import pytest
from hidden.instruments import EVERY_KIND
from hidden.simulator import EVERY_NOISE, NOISES, write
from hidden.study.protocols import PROTOCOLS
from hidden.study.sizes import base_of, hiding

from fitting.diagnosis.diagnose import concluded, prepared, searched
from fitting.diagnosis.trusting import begun_again, fit_trusting
from fitting.least_squares.fit import fit
from fitting.recordings.experiment import read_experiment
from mckibben_jax.effects import CoulombFriction, EndStop, IdealCylinder, LinearSpring, Presliding, TimeDelay, Tip

BASE = [IdealCylinder(), CoulombFriction()]
HIDDEN = {"linear_spring": {"K": 300.0}, "end_stop": {"K": 270.0, "eps_s": 0.15}}


@pytest.fixture(scope="module")
def experiment(tmp_path_factory):
    """Few loops in which two effects hide and every instrument errs."""
    data = PROTOCOLS["poor"].data(hiding(base_of({}), HIDDEN), NOISES["ar"], 5, EVERY_KIND["laboratory"])
    return read_experiment(write(data, tmp_path_factory.mktemp("trusting") / "data", say_accuracy=True))


@pytest.fixture(scope="module")
def search(experiment):
    return searched([experiment], BASE, candidates=[LinearSpring(), EndStop(), Tip()])


def test_a_pair_that_is_named_leaves_what_a_fit_of_it_leaves(experiment, search):
    found = concluded(search)
    assert found.explanations == (("end_stop", "linear_spring"),)
    (named,) = (e for e in found.tried if e.effects == found.explanations[0])
    fitted = fit([experiment], [*BASE, LinearSpring(), EndStop()])
    assert named.rmse == pytest.approx(fitted.rmse, rel=1e-3)
    through = search.world.rmse(search.fits[frozenset(named.effects)].rows)
    assert through > 1.2 * named.rmse  # as instruments let it be seen, which is how it was judged


def test_the_size_of_what_does_not_explain_it_is_that_of_the_error_beside_it(experiment, search):
    """A dead weight of 0 kg was said to take away half a newton: its size was that which instruments left to it."""
    evidence = concluded(search).effects["end_stop"]
    fitted = fit([experiment], [*BASE, EndStop()])
    assert evidence.rmse == pytest.approx(fitted.rmse, rel=1e-3)
    assert evidence.estimate["K"].value == pytest.approx(fitted.values["end_stop.K"], rel=0.02)
    alone = search.fits[frozenset(["end_stop"])]
    through = dict(zip(search.world.layout.names, alone.vector, strict=True))["end_stop.K"]
    assert abs(through / fitted.values["end_stop.K"] - 1) > 0.05


def test_a_set_is_fitted_so_once(search, monkeypatch):
    pair = frozenset(["end_stop", "tip"])
    fit_trusting(search.examiner, search.fits, [pair])
    kept = search.examiner.trusting[pair]
    assert kept.cost <= search.world.at(kept.effects, search.fits[pair].vector).cost
    monkeypatch.setattr(type(search.world), "fit_all", lambda *_, **__: [])
    fit_trusting(search.examiner, search.fits, [pair])
    assert search.examiner.trusting[pair] is kept


def test_a_search_through_instruments_begins_again_where_a_fit_of_every_reading_ends(tmp_path):
    """It ended at 26 ms, and "not in the library" was said of a delay of 62 ms."""
    truth = hiding(base_of({}), {"time_delay": {"tau": 0.062386}})
    data = PROTOCOLS["rich"].data(truth, EVERY_NOISE["ar"], 1057814779, EVERY_KIND["laboratory"])
    experiment = read_experiment(write(data, tmp_path / "late", say_accuracy=True))
    found = prepared([experiment], BASE, candidates=[TimeDelay(), Presliding()])
    delay = [frozenset(["time_delay"])]
    found.fit_level(delay, True)
    fit_trusting(found.examiner, found.fits, delay)
    (again,) = begun_again(found.examiner, found.fits, delay).values()
    first = found.fits[delay[0]]
    tau = found.world.layout.at(["time_delay.tau"])[0]
    assert abs(again.vector[tau] - 0.0624) < 0.01 < abs(first.vector[tau] - 0.0624)
    assert found.examiner.left(again) < 0.5 * found.examiner.left(first)
    found.fits[delay[0]] = again
    assert begun_again(found.examiner, found.fits, delay) == {}  # nothing better is left to be found there
    assert concluded(searched([experiment], BASE, candidates=[TimeDelay(), Presliding()])).explanations == (
        ("time_delay",),
    )
