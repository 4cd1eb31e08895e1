"""Multiple shooting: the same motion in stretches, the same slopes for less, and fits that arrive from far away."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from stick_slip import G

from fitting.least_squares.fit import fit, fit_problem
from fitting.least_squares.search import rows_and_slopes
from fitting.least_squares.shooting import begin_by_shooting, shooting, with_shots
from fitting.least_squares.subset import subset_of
from fitting.problem.residuals import problem
from fitting.problem.unknowns import unknowns
from fitting.problem.varying import Varying
from fitting.recordings.experiment import read_experiment
from fitting.report.text.search import failure_texts
from fitting.study.courses import loop_courses, release_courses, step_courses
from fitting.study.simulate import write_data_set
from mckibben_jax.effect import name_of
from mckibben_jax.effects import CoulombFriction, IdealCylinder, KineticFriction, SupplyLag, ViscousDamping
from mckibben_jax.model import model
from mckibben_jax.motion import motion
from mckibben_jax.muscle import Muscle
from mckibben_jax.parameter import parameters
from mckibben_jax.state import State

MUSCLE = Muscle(0.3, 0.007, np.radians(20))
SLIDING = (IdealCylinder(), CoulombFriction(0.015), KineticFriction(4.0, 0.2), ViscousDamping(40.0))
NOISE = 5e-5


def written(folder, effects, test, courses, noise=NOISE):
    """The data set of a muscle whose truth is known."""
    write_data_set(folder, model(MUSCLE, *effects), test, courses, noise, 0)
    return read_experiment(folder)


@pytest.fixture(scope="module")
def releases(tmp_path_factory):
    """Three releases."""
    courses = release_courses([5e5], [8 * G, 20 * G, 40 * G], 0.5, 200.0)
    return written(tmp_path_factory.mktemp("shooting") / "releases", SLIDING, "quick release", courses)


def test_stretches_that_begin_on_the_motion_are_the_motion():
    times, steps = jnp.linspace(0, 1, 201), 1000
    given, states = model(MUSCLE, *SLIDING), State(0 * times, 0 * times + 5e5, time=times)
    whole = motion.moved(given, states, 200.0, 0.0, steps=steps)
    at = np.array([5, 40, 120])  # samples, every fifth step
    nodes = motion.Nodes(jnp.asarray(5.0 * at), whole.contraction[at], whole.rate[at])
    cut = motion.moved(given, states, 200.0, 0.0, steps=steps, nodes=nodes)
    np.testing.assert_allclose(cut.contraction, whole.contraction, atol=1e-12)
    assert cut.gaps is not None
    assert np.abs(np.stack(cut.gaps)).max() < 1e-12
    aside = nodes._replace(contraction=nodes.contraction + jnp.array([0.0, 1e-3, 0.0]))
    gaps = motion.moved(given, states, 200.0, 0.0, steps=steps, nodes=aside).gaps
    assert gaps is not None
    np.testing.assert_allclose(gaps[0][1], -1e-3, rtol=1e-9)  # what leads there falls short
    assert abs(gaps[0][2]) > 1e-6  # and what follows begins elsewhere


def test_slopes_from_few_tangents_are_those_along_any(releases):
    """One tangent for every node's place and one for its speed, against the derivative along directions at random."""
    recording = replace(releases.recordings[0], position="length")  # another length at rest moves what is read
    experiment = replace(releases, recordings=(recording,), priors={"muscle.length": (0.301, 0.002)})
    layout = unknowns([experiment], SLIDING)
    given, _ = problem([experiment], layout)
    names = Varying().names(layout)
    subset = subset_of(layout, layout.start, names)
    cut = shooting(given.coarser(4), 4)
    assert cut is not None
    wider = with_shots(subset, [each for each in cut.shots if each is not None])
    place = jnp.concatenate([subset.place(subset.full), 0.5 + 0.01 * jnp.sin(jnp.arange(cut.size))])
    rows, slopes = rows_and_slopes(cut, wider, place)
    assert slopes.shape == (cut.count, len(names) + 3 * 3 * 2)
    run = lambda at: cut.rows(*wider.point(at), wider.live)  # noqa: E731
    along = jax.jit(lambda at, way: jax.jvp(run, (at,), (way,)))
    for way in np.random.default_rng(0).normal(size=(4, place.size)):
        expected, change = along(place, way)
        np.testing.assert_allclose(rows, expected, rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(slopes @ way, change, atol=1e-9 * np.abs(change).max())


def test_nodes_lie_where_the_muscle_was_measured(releases):
    layout = unknowns([releases], SLIDING)
    cut = shooting(problem([releases], layout)[0], 8)
    assert cut is not None
    (shots,) = cut.shots
    assert shots is not None
    assert np.all(np.diff(shots.step, axis=1) >= 1)
    clock = 0.5 / float(cut.problem.blocks[0].taken)
    for run, step, seen in zip(releases.recordings[0].runs, shots.step, shots.seen, strict=True):
        truth = np.interp(step * clock, run.time, run.measured) / 0.3
        np.testing.assert_allclose(seen[:, 0], truth, atol=0.02 * np.ptp(truth))


def test_where_nothing_moves_the_search_begins_as_without(tmp_path):
    loops = loop_courses(MUSCLE, [2e5], [0, 0.2, 0], 0.02, 20.0)
    still = written(tmp_path / "loops", SLIDING[:2], "loop", loops, 0.5)
    layout = unknowns([still], SLIDING[:2])
    given, samples = problem([still], layout)
    subset = subset_of(layout, layout.start, Varying().names(layout))
    begin = np.full((2, len(Varying().names(layout))), 0.3)
    assert begin_by_shooting(given, subset, begin, 8) is begin
    one = fit_problem(layout, given, samples, layout.start, Varying().names(layout), starts=2)
    two = fit_problem(layout, given, samples, layout.start, Varying().names(layout), starts=2, shooting=8)
    assert one.values == two.values


def test_a_search_that_is_caught_says_so_and_shooting_gets_past(tmp_path):
    """Steps through a slow supply: followed from the start alone, friction and drag are taken for each other."""
    truth = (IdealCylinder(), CoulombFriction(0.012), ViscousDamping(60.0), SupplyLag(0.06))
    courses = step_courses([1.5e5, 4e5], [10 * G, 20 * G], 1.0, 250.0)
    steps, guess = written(tmp_path / "steps", truth, "step", courses), [type(effect)() for effect in truth]
    caught = fit([steps], guess, starts=2)
    assert caught.rmse > 10 * NOISE
    assert any("--shooting 8" in failure for failure in failure_texts(caught))
    arrived = fit([steps], guess, starts=1, shooting=8)
    assert arrived.rmse < 1.1 * NOISE
    assert arrived.search.stretches == 8
    assert not arrived.failures
    for effect in truth[1:]:
        for p in parameters(effect):
            name, value = f"{name_of(effect)}.{p.name}", float(getattr(effect, p.name))
            assert abs(arrived.values[name] - value) < 5 * arrived.error(name, robust=False), name
    stuck = fit([steps], guess, starts=1, shooting=8, start={"coulomb_friction.f_s": 0.2})  # there nothing moves at all
    assert stuck.rmse < 1.1 * NOISE
