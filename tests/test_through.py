"""Fits that know what instruments can make of the rows: the linear map, and the values that come of it."""

import numpy as np
import pytest
import scipy.linalg
from hidden.instruments import EVERY_KIND
from hidden.simulator import NOISES, write
from hidden.study.protocols import PROTOCOLS
from hidden.study.sizes import base_of, hiding
from hidden.study.values import HOW, values_of

from fitting.diagnosis.diagnose import prepared
from fitting.instruments.columns import most_errors
from fitting.instruments.through import SIZES, Through, standard_number
from fitting.recordings.experiment import read_experiment
from mckibben_jax.effects import CoulombFriction, EndStop, IdealCylinder, SchulteFriction

BASE = (IdealCylinder(), CoulombFriction())
STOP = {"end_stop": {"K": 269.0, "eps_s": 0.203}}


def errors(rows=30, count=4, seed=1):
    return np.random.default_rng(seed).normal(size=(rows, count)) * [0.1, 1.0, 10.0, 1e-9][:count]


def test_the_map_is_the_inverse_root_of_the_covariance():
    """Against scipy's root of the whole matrix, with columns of zeros behind the errors."""
    u = errors()
    wanted = np.linalg.inv(scipy.linalg.sqrtm(np.eye(30) + u @ u.T))
    assert Through.of(u, SIZES[0])(np.eye(30)) == pytest.approx(wanted, abs=1e-10)


def test_what_was_seen_can_be_undone():
    through, rows = Through.of(errors(), SIZES[0]), np.random.default_rng(2).normal(size=(30, 3))
    assert through.undone(through(rows)) == pytest.approx(rows, abs=1e-9)
    assert through(rows[:, 0]) == pytest.approx(through(rows)[:, 0])


def test_exact_instruments_change_nothing():
    rows = np.random.default_rng(3).normal(size=30)
    exact = Through.of(errors(), SIZES[0]).exact
    assert np.array_equal(exact(rows), rows)
    assert exact.errors.shape == (30, SIZES[0])  # the same compiled program


@pytest.mark.parametrize(("count", "size"), [(0, 64), (64, 64), (65, 128), (1024, 1024), (1025, None)])
def test_errors_are_filled_up_to_a_standard_number(count, size):
    assert standard_number(count) == size


@pytest.fixture(scope="module", params=["rich", "isometric", "static map"])
def search(request, tmp_path_factory):
    """Recordings with all errors of instruments, in which an end stop is hidden."""
    data = PROTOCOLS[request.param].data(hiding(base_of({}), STOP), NOISES["ar"], 5, EVERY_KIND["laboratory"])
    folder = write(data, tmp_path_factory.mktemp("through") / "data", say_accuracy=True)
    return prepared([read_experiment(folder)], BASE, [EndStop()])


def test_there_is_room_for_all_errors_and_not_for_many_more(search):
    world = search.world
    felt = search.examiner.errors(search.base).columns.shape[1]
    runs = len(np.unique(world.samples.run))
    assert felt <= most_errors(world.accuracies, runs, lost=1) <= felt + 3 * runs
    assert search.seen.allows_for_instruments
    assert not world.allows_for_instruments


def test_a_fit_through_instruments_makes_small_what_the_tests_look_at(search):
    """What is left beyond the instruments: less than after a fit that trusts every reading, for the same effects."""
    added = search.world.with_added(["end_stop"])
    seen = search.seen.fit(added, search.alone.vector, ["end_stop"])
    trusting = search.world.fit(added, search.base.vector, ["end_stop"])
    assert search.examiner.left(seen) < search.examiner.left(trusting) + 1e-3 * len(seen.rows)
    assert search.world.rmse(trusting.rows) < search.world.rmse(seen.rows) + 1e-6
    assert search.world.rmse(seen.plain.rows) <= search.world.rmse(seen.rows) + 1e-9
    assert trusting.plain is trusting


def test_an_end_stop_is_found_where_it_is_though_gains_and_zeros_err(tmp_path):
    """A fit that trusts every reading ended with a tenth of the stiffness from the beginning of the stroke on."""
    truth = hiding(base_of({}), STOP | {"schulte_friction": {"f": 3.5e-4}})
    data = PROTOCOLS["rich"].data(truth, NOISES["ar"], 14, EVERY_KIND["laboratory"])
    experiment = read_experiment(write(data, tmp_path / "data", say_accuracy=True))
    search = prepared([experiment], BASE, [EndStop(), SchulteFriction()])
    search.fit_singles()
    search.fit_level([frozenset(["end_stop", "schulte_friction"])])
    fit = search.fits[frozenset(["end_stop", "schulte_friction"])]
    found = dict(zip(search.world.layout.names, fit.vector, strict=True))
    assert found["end_stop.eps_s"] == pytest.approx(STOP["end_stop"]["eps_s"], rel=0.1)
    assert found["end_stop.K"] == pytest.approx(STOP["end_stop"]["K"], rel=0.3)
    assert found["schulte_friction.f"] == pytest.approx(3.5e-4, rel=0.3)


def test_values_are_nearer_to_the_truth_than_those_of_the_curve_of_least_error():
    """The study (`hidden.study.values`) counts how many intervals hold the truth; here a few of its recordings."""
    names = ("bladder_neo_hookean", "end_stop", "weight", "linear_spring")
    found = [value for number in (0, 1) for name in names for value in values_of(name, number, ways=HOW[:2])]
    seen, bent = ([value for value in found if value.how == how] for how in HOW[:2])
    assert max(abs(value.off) for value in seen) < 4
    assert np.sqrt(np.mean([value.off**2 for value in seen])) < 2
    missed = [np.sqrt(np.mean([value.missed**2 for value in some])) for some in (seen, bent)]
    assert missed[0] < 0.5 * missed[1]
