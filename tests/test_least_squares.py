"""Fits against closed forms, scipy and the independent simulator."""

import re
from argparse import Namespace
from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import optimistix as optx
import pytest
from hidden.simulator import Muscle as TrueMuscle
from hidden.simulator import Noise, Truth, dataset, loops, with_baseline, write
from scipy.optimize import least_squares
from small_muscle import loops as loops_of
from small_muscle import write as write_small

from fitting.errors import InputError
from fitting.least_squares.box import BoxLevenbergMarquardt, OfLower
from fitting.least_squares.evaluate import evaluate
from fitting.least_squares.fit import fit
from fitting.least_squares.uncertainty import clusters, covariances, ties
from fitting.recordings.experiment import read_experiment
from fitting.report.text.search import failure_texts, search_text
from fitting.showing import spoken
from mckibben_jax.effect import Pulling
from mckibben_jax.effects import CoulombFriction, EndStop, ForceOffset, IdealCylinder, Presliding, Tip
from mckibben_jax.parameter import parameter


@pytest.fixture(scope="module")
def offset_set(tmp_path_factory):
    """Loops of an ideal muscle with Coulomb friction and a load cell that reads 7 N too high."""
    truth = Truth(TrueMuscle(), with_baseline(f_s=0.012, force_offset={"F_off": 7.0}))
    recording = loops(truth, pressures=(1e5, 3e5), speeds=(0.02,), samples=200, noise=Noise(sd=0.5), seed=5)
    folder = tmp_path_factory.mktemp("offset")
    write(dataset(truth, [recording], name="offset", seed=5), folder)
    return read_experiment(folder)


def rosenbrock(x, args):
    return jnp.array([10 * (x[1] - x[0] ** 2), 1 - x[0]])


@pytest.mark.parametrize("upper", [(2.0, 2.0), (0.8, 2.0), (2.0, 0.5), (0.3, 0.05)])
def test_box_step_finds_what_scipy_finds(upper):
    """Inside the box and at its faces."""
    start = np.array([-0.5, -0.9])
    lower = np.array([-1.0, -1.0])
    solver = BoxLevenbergMarquardt(jnp.asarray(lower), jnp.asarray(upper), rtol=1e-14, atol=1e-20)
    found = optx.least_squares(rosenbrock, solver, jnp.asarray(start), max_steps=400, throw=False)
    rival = least_squares(lambda x: np.asarray(rosenbrock(x, None)), start, bounds=(lower, upper), xtol=1e-14)
    np.testing.assert_allclose(found.value, rival.x, atol=2e-6)


def test_a_search_does_not_miss_the_derivatives_of_steps_that_it_does_not_take():
    @jax.custom_jvp
    def only_where_lower(x, cost):
        return rosenbrock(x, None)

    @only_where_lower.defjvp
    def _(primals, tangents):
        (x, cost), rows = primals, rosenbrock(primals[0], None)
        slopes = jnp.where(0.5 * jnp.sum(rows**2) < cost, jax.jacfwd(rosenbrock)(x, None), jnp.nan)
        return rows, slopes @ tangents[0]

    solver, start = BoxLevenbergMarquardt(-jnp.ones(2), 2 * jnp.ones(2)), jnp.array([-0.5, -0.9])
    plain = optx.least_squares(rosenbrock, solver, start)
    sparing = optx.least_squares(
        lambda x, of: only_where_lower(x, of.cost), solver, start, args=OfLower((), jnp.asarray(jnp.inf))
    )
    assert plain.state.num_accepted_steps < plain.stats["num_steps"]  # or this shows nothing
    assert sparing.stats["num_steps"] == plain.stats["num_steps"]
    np.testing.assert_allclose(sparing.value, plain.value, rtol=1e-12)  # the two programs round differently


def winding(x, args):
    """A narrow winding valley along which each step gains little, and all of them together a tenth."""
    return jnp.stack([50 * (x[1] - 0.5 - 0.4 * jnp.sin(12 * x[0])), 1 + 0.05 * (1 - x[0])])


@pytest.mark.parametrize(("enough", "most"), [(0.0, 2000), (1e-4, 100), (1e-3, 5)])
def test_a_search_among_many_does_not_follow_a_winding_valley(enough, most):
    """It ends where a few steps in a row have each gained less than is enough; by itself it would go on."""
    solver = BoxLevenbergMarquardt(jnp.zeros(2), jnp.ones(2), enough=enough)
    found = optx.least_squares(winding, solver, jnp.array([0.0, 0.5]), max_steps=2000, throw=False)
    assert found.result == optx.RESULTS.successful
    assert found.stats["num_steps"] <= most
    if not enough:
        assert found.stats["num_steps"] > 100


def test_covariance_of_a_straight_line():
    """The textbook formula, and robust errors that are those of leaving out each sample where each is a cluster."""
    rng = np.random.default_rng(0)
    x = np.linspace(0, 1, 50)
    design = np.stack([np.ones_like(x), x], axis=1)
    y = design @ [1.0, 2.0] + rng.normal(0, 0.3, x.size)
    rows = design @ np.linalg.lstsq(design, y, rcond=None)[0] - y
    plain, robust = covariances(design, rows, np.zeros((0, 2)), np.arange(x.size))
    expected = np.linalg.inv(design.T @ design) * np.sum(rows**2) / (x.size - 2)
    np.testing.assert_allclose(plain, expected, rtol=1e-9)
    whole = np.linalg.lstsq(design, y, rcond=None)[0]
    without = [np.linalg.lstsq(np.delete(design, i, 0), np.delete(y, i), rcond=None)[0] - whole for i in range(x.size)]
    left_out = np.transpose(without) @ without
    assert np.all(np.diag(left_out) > np.diag(plain))  # here; where it is not, independent samples' errors stand
    np.testing.assert_allclose(robust, left_out, rtol=1e-9)


def test_errors_shared_by_a_run_widen_the_error_and_shared_errors_never_narrow_it():
    """Twelve runs of two loops with an offset each: clusters are runs, and the mean is as uncertain as twelve say."""
    rng = np.random.default_rng(1)
    run, loop = np.repeat(np.arange(12), 20), np.tile(np.repeat([0, 1], 10), 12)
    number = clusters(Namespace(run=run, loop=loop), np.ones((240, 1)))
    assert number.max() + 1 == 12
    assert clusters(Namespace(run=run[:100], loop=loop[:100]), np.ones((100, 1))).max() + 1 == 10  # few runs: loops
    offsets = rng.standard_normal(12)
    rows = 0.1 * rng.standard_normal(240) + offsets[run]
    rows -= rows.mean()
    plain, robust = covariances(np.ones((240, 1)), rows, np.zeros((0, 1)), number)
    assert np.sqrt(robust[0, 0]) == pytest.approx(np.std(offsets, ddof=1) / np.sqrt(12), rel=0.15)
    alternating = np.tile([1.0, -1.0], 120)
    plain, robust = covariances(np.ones((240, 1)), alternating, np.zeros((0, 1)), number)
    np.testing.assert_allclose(robust, plain)


def test_what_one_run_alone_decides_is_judged_by_its_loops():
    """Of what is in the third of nine runs only, the others know nothing: three loops of it are off by as much each."""
    rng = np.random.default_rng(2)
    run, loop = np.repeat(np.arange(9), 30), np.tile(np.repeat([0, 1, 2], 10), 9)
    samples, mine = Namespace(run=run, loop=loop), run == 2
    design = np.column_stack([np.ones(270), np.where(mine, 1.0, 0.0)])
    assert clusters(samples, design).max() + 1 == 8 + 3
    error = rng.standard_normal((2000, 27))[:, 3 * run + loop]  # the same throughout a loop
    slope, at = np.linalg.pinv(design), clusters(samples, design)
    spread = np.std(error @ slope[1])

    def width(cluster):
        left = [one - design @ (slope @ one) for one in error[:200]]
        robust = [covariances(design, rows, np.zeros((0, 2)), cluster)[1][1, 1] for rows in left]
        return np.sqrt(np.mean(robust))

    assert width(at) == pytest.approx(spread, rel=0.3)
    assert width(run) < 0.6 * spread
    points = Namespace(run=run, loop=np.tile(np.arange(30), 9))  # of static curves, which err together
    assert clusters(points, design).max() + 1 == 9
    known = np.vstack([design, [[0.0, 1e3]]])  # a prior that knows it better: no run decides anything
    assert clusters(samples, known).max() + 1 == 9


def test_a_prior_enters_the_covariance():
    """A parameter that the data cannot see keeps the width of its prior."""
    design = np.array([[1.0, 0.0]] * 10)
    plain, robust = covariances(design, np.full(10, 0.1), np.array([[0.0, 1 / 0.2]]), np.arange(10))
    assert np.sqrt(plain[1, 1]) == pytest.approx(0.2)
    assert np.sqrt(robust[1, 1]) == pytest.approx(0.2)


def test_fit_finds_the_truth_from_afar(offset_set):
    """Values within four robust errors of what the simulator put in, and the error at the noise."""
    found = fit([offset_set], [IdealCylinder(), CoulombFriction(f_s=0.2), ForceOffset(F_off=-100.0)], starts=4)
    assert found.converged
    for name, truth in {"coulomb_friction.f_s": 0.012, "force_offset.F_off": 7.0}.items():
        assert abs(found.values[name] - truth) < 4 * found.error(name)
    assert found.rmse == pytest.approx(0.5, rel=0.1)


def test_every_start_reaches_the_same_best_point(offset_set):
    """One well-behaved problem, several starts."""
    found = fit([offset_set], [IdealCylinder(), CoulombFriction(), ForceOffset()], starts=6)
    assert search_text(found) == "6 starts: 6 reached the same best point"


def test_a_stop_that_is_not_there_is_fitted_as_absent(offset_set):
    """Its stiffness at or near the end of its range, and the search converged all the same."""
    found = fit(
        [offset_set], [IdealCylinder(), CoulombFriction(), ForceOffset(), EndStop(eps_s=0.1)], fix=["end_stop.eps_s"]
    )
    assert found.values["end_stop.K"] < 1.0
    assert found.converged


def test_a_stop_that_is_declared_beyond_the_data_is_looked_for_inside_them(tmp_path):
    """Where its search begins (0.2) it can do nothing, for nothing was measured there."""
    stop = lambda eps, pressure, sign: 6e3 * np.maximum(eps - 0.155, 0)  # noqa: E731
    experiment = read_experiment(write_small(tmp_path, loops_of(stop, points=30, repeats=2)))
    found = fit([experiment], (IdealCylinder(), CoulombFriction(), EndStop()), starts=4)
    assert found.held == ()
    assert found.values["end_stop.eps_s"] == pytest.approx(0.155, abs=0.001)
    assert found.values["end_stop.K"] == pytest.approx(6e3 / 0.25, rel=0.02)
    assert found.rmse == pytest.approx(0.3, rel=0.1)


def test_what_the_data_cannot_see_is_held(offset_set):
    """Points without history say nothing of friction: it is held and named, and stops nothing."""
    still = tuple(
        replace(r, test="static", runs=tuple(replace(run, rate=0 * run.rate, branch=0 * run.branch) for run in r.runs))
        for r in offset_set.recordings
    )
    found = fit([replace(offset_set, recordings=still)], [IdealCylinder(), CoulombFriction(), ForceOffset()], starts=2)
    assert found.held == ("coulomb_friction.f_s",)
    assert "force_offset.F_off" in found.free


def test_ties_are_named():
    """Two columns that nearly coincide are tied, a third is free."""
    rng = np.random.default_rng(1)
    a, c = rng.normal(size=(2, 400))
    tied = ties(("a", "b", "c"), np.stack([a, a + 0.01 * rng.normal(size=400), c], axis=1))
    assert tied == {"a": ("b",), "b": ("a",)}


def test_the_order_of_effects_changes_nothing(offset_set):
    """A model is a set."""
    one = fit([offset_set], [IdealCylinder(), CoulombFriction(), Presliding(), Tip()], starts=1)
    two = fit([offset_set], [Tip(), Presliding(), CoulombFriction(), IdealCylinder()], starts=1)
    assert one.values == two.values


class Rooted(Pulling):
    """A force that is a number only beyond a contraction."""

    x: jax.Array = parameter(-0.4, "1", "where it begins", range=(-0.5, 0.5), starts=(-0.4, 0.4))

    def force(self, muscle, state):
        return jnp.sqrt(state.contraction - self.x)


@pytest.mark.parametrize(("own", "pressure"), [({}, "100 kPa"), ({"Pa": "bar"}, "1 bar")])
def test_where_a_model_is_no_number_is_said_in_the_users_units(offset_set, own, pressure):
    with spoken(own):
        found = fit([offset_set], [IdealCylinder(), Rooted()], starts=4)
        told = failure_texts(found)
    said = rf"start \d: the model gives no finite number at row \d+ \(contraction 0.\d+, {pressure}, "
    assert told
    assert all(re.match(said, failure) for failure in told), told


def test_a_start_that_is_no_number_hides_no_parameter(offset_set):
    """Beyond 0.1 the force is none at the start: the search begins elsewhere, and what varies is not called unseen."""
    found = fit([offset_set], [IdealCylinder(), Rooted()], start={"rooted.x": 0.1}, starts=2)
    assert found.held == ()
    assert found.values["rooted.x"] < 0.1
    assert np.isfinite(found.residual).all()


FAR = {"rooted.x": 0.5}


@pytest.mark.parametrize(
    "tried",
    [
        lambda *model: fit(*model, start=FAR, fix=["rooted.x"]),
        lambda *model: fit(*model, start=FAR, starts=1),
        lambda *model: evaluate(*model, FAR, ()),
    ],
    ids=["nothing varies", "every start fails", "evaluated"],
)
def test_a_model_that_is_no_number_is_refused_with_the_row(offset_set, tried):
    with pytest.raises(InputError, match="no finite number") as caught:
        tried([offset_set], [IdealCylinder(), Rooted()])
    first = offset_set.recordings[0].runs[0]
    assert caught.value.file == offset_set.folder / offset_set.recordings[0].file
    assert caught.value.row == first.row[first.weight > 0][0]
    assert re.match(r"contraction 0\.\d+, 100 kPa, ", caught.value.value)
    assert "--set" in caught.value.cure


def test_fit_without_anything_to_vary(offset_set):
    """Everything fixed: the model is evaluated as it stands."""
    found = fit([offset_set], [IdealCylinder()])
    assert found.free == ()
    assert np.isfinite(found.rmse)
