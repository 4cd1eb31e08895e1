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
from fitting.instruments.columns import most_errors, most_independent
from fitting.instruments.through import SIZES, Through, standard_number
from fitting.least_squares.search import solve
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


def test_errors_that_act_alike_take_one_column():
    """Two columns in any proportion are one error of the root of the sum of their squares; what is not felt is none."""
    one = errors(count=1)
    through = Through.of(np.hstack([0.6 * one, -0.8 * one, 0.0 * one]))
    assert np.count_nonzero(np.any(through.errors, axis=0)) == 1
    rows = np.random.default_rng(4).normal(size=(30, 2))
    assert through(rows) == pytest.approx(Through.of(one)(rows), abs=1e-12)


def test_many_errors_take_as_many_columns_as_are_independent():
    """Two hundred errors in seventy directions have room in 128 columns, and at least as many as are asked for."""
    rng = np.random.default_rng(5)
    many = rng.normal(size=(300, 70)) @ rng.normal(size=(70, 200))
    assert Through.of(many).size == 128
    assert Through.of(many, least=200).size == 256
    with pytest.raises(ValueError, match="1100 independent errors"):
        Through.of(np.eye(1100))


@pytest.mark.parametrize("count", [3, None])
def test_all_slopes_are_seen_through_instruments_however_many_vary(search, count):
    """Only the first eight, sixteen or so columns are turned: against the map applied to plain slopes."""
    world = search.world
    effects, vary = world.with_added(["end_stop"]), np.arange(len(world.layout.names))[:count]
    subset = world.subset(effects, vary, world.start)
    through = search.seen.through
    plain = world.looked_at(subset)
    seen = solve(world.problem, subset, subset.place(subset.full), 60, np.array(True), np.array(0.0), through)
    wanted = through(np.asarray(plain.slopes))
    assert np.asarray(seen.slopes) == pytest.approx(wanted, abs=1e-9 * np.abs(wanted).max())
    assert np.asarray(seen.rows) == pytest.approx(through(np.asarray(plain.rows)), abs=1e-9)


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


def test_errors_of_runs_at_one_length_are_known_to_be_fewer(search):
    """As many independent ones are expected as there are: what is compiled for them is as small as it can be."""
    world = search.world
    columns = search.examiner.errors(search.base).columns
    independent = np.linalg.matrix_rank(columns, tol=1e-4)
    runs = len(np.unique(world.samples.run))
    held = runs * bool(np.all(world.samples.rate == 0))
    expected = most_independent(world.accuracies, runs, held, lost=1)
    assert independent <= expected <= independent + 6
    assert (expected < most_errors(world.accuracies, runs, lost=1)) == bool(held)


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


def test_a_single_effect_that_trusts_every_reading_begins_also_where_instruments_saw_it(search):
    """Its error is what people read: it is no larger than from the base alone, or from the fit through instruments."""
    search.fit_singles()
    added = frozenset(["end_stop"])
    effects, found = search.world.with_added(added), search.examiner.trusting[added]
    from_base = search.world.fit(effects, search.base.vector, sorted(added), decide=False, enough=1e-4)
    from_seen = search.world.fit(effects, search.fits[added].vector, decide=False, enough=1e-4)
    assert found.cost == pytest.approx(min(from_base.cost, from_seen.cost), rel=1e-9)
