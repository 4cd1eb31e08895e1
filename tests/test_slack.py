"""A muscle that hangs slack: where its law goes, that it is found, and that rubber is found behind it."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hidden.simulator import COLOURED, LABORATORY, Muscle, Truth, dataset, isometric, with_baseline, write

from fitting.diagnosis.diagnose import diagnose, searched
from fitting.diagnosis.discover import discover
from fitting.diagnosis.settings import DIAGNOSIS, SEARCH
from fitting.recordings.experiment import read_experiment
from mckibben_jax.effect import name_of
from mckibben_jax.effects import LIBRARY, BladderNeoHookean, CoulombFriction, IdealCylinder, Slack
from mckibben_jax.effects.read import CORNER

NAMES = "bladder_neo_hookean bladder_mooney_rivlin slack dead_band tip force_offset linear_spring contraction_offset"
CANDIDATES = [kind() for kind in LIBRARY if name_of(kind) in NAMES.split()]  # few: each must be compiled
BASE = [IdealCylinder(), CoulombFriction()]
LOAD = 5.0  # N, under which the tube of the simulated muscle bends aside
FORCES = jnp.linspace(-300.0, 1000.0, 1301)


# The law ------------------------------------------------------------------------------------------------------------


def shown(force, slack=-LOAD):
    return Slack(F_s=jnp.asarray(slack)).read(force, jnp.zeros_like(force))


@pytest.mark.parametrize("slack", [-20.0, 0.0, 14.0])
def test_a_pull_is_read_as_it_is_and_a_push_as_what_the_slack_muscle_reads(slack):
    reading = shown(FORCES, slack)
    assert np.all(np.abs(reading - np.maximum(FORCES, slack)) <= CORNER + 1e-9)
    np.testing.assert_allclose(reading[-1], 1000.0, atol=2 * CORNER**2 / 900)
    np.testing.assert_allclose(reading[0], slack, atol=2 * CORNER**2 / 250)
    assert np.all(np.diff(reading) > 0)


def test_it_has_a_slope_everywhere_between_none_and_that_of_the_muscle():
    slopes = jax.vmap(jax.grad(lambda force: shown(force)))(FORCES)
    assert np.all((slopes >= 0) & (slopes <= 1))
    assert slopes[-1] == pytest.approx(1, abs=1e-5)
    assert slopes[0] == pytest.approx(0, abs=1e-4)
    corner = jax.grad(lambda force: shown(force))(jnp.asarray(-LOAD))
    assert corner == pytest.approx(0.5)


# Hidden in recordings whose instruments err -------------------------------------------------------------------------


def measured(folder, seed, **hidden):
    """Pressure cycles at four held lengths of a muscle with rubber; 0.2 to 5 bar."""
    muscle = Muscle(wall_thickness=1.5e-3)
    truth = Truth(muscle, with_baseline(bladder_neo_hookean={"G": 6e5}, **hidden))
    made = isometric(truth, noise=COLOURED, seed=seed, instruments=LABORATORY, samples=240)
    return read_experiment(write(dataset(truth, [made], "Slack", COLOURED, seed), folder))


@pytest.fixture(scope="module")
def hanging(tmp_path_factory):
    return measured(tmp_path_factory.mktemp("hanging"), 4, slack={"F_s": -LOAD})


@pytest.fixture(scope="module")
def pushing(tmp_path_factory):
    """A rig whose muscle cannot bend aside: the cell reads that it pushes."""
    return measured(tmp_path_factory.mktemp("pushing"), 4)


def test_a_slack_muscle_is_named_where_its_rubber_is_known(hanging):
    found = diagnose([hanging], [*BASE, BladderNeoHookean()], candidates=CANDIDATES)
    assert found.verdict == "missing"
    assert found.explanations == (("slack",),)
    value, error, _ = found.effects["slack"].estimate["F_s"]
    assert value == pytest.approx(-LOAD, abs=3 * error)


def test_a_muscle_that_pushes_is_not_called_slack(pushing):
    found = diagnose([pushing], [*BASE, BladderNeoHookean()], candidates=CANDIDATES)
    assert not any("slack" in names for names in found.explanations)


def test_rubber_and_slack_are_found_together_where_neither_shows_alone(hanging):
    steps = discover([hanging], BASE, candidates=CANDIDATES)
    added = {name for step in steps[1:] for name in step.added}
    assert "slack" in added
    assert added & {"bladder_neo_hookean", "bladder_mooney_rivlin"}
    assert steps[-1].rmse < 0.1 * steps[0].rmse


def test_a_slack_muscle_on_a_cell_that_reads_zero_is_found_too(tmp_path):
    """Its reading was "smaller than its standard error", and a wrong zero of the load cell was added with it."""
    steps = discover([measured(tmp_path, 4, slack={"F_s": 0.0})], BASE, candidates=CANDIDATES)
    added = {name for step in steps[1:] for name in step.added}
    assert "slack" in added
    assert "force_offset" not in added
    assert not any(attempt.effects == ("slack",) for step in steps for attempt in step.attempts)


def test_an_effect_is_fitted_with_the_simplest_that_gives_what_it_needs(hanging):
    """Where no other rule grows the sets: by itself slack cannot be fitted, and no pair of single ones has it."""
    settings = replace(DIAGNOSIS, search=replace(SEARCH, added=0))
    found = searched([hanging], BASE, CANDIDATES, settings=settings)
    with_slack = {added for added in found.fits if "slack" in added and len(added) == 2}
    assert with_slack == {frozenset({"slack", "bladder_neo_hookean"})}  # of two rubbers the one with fewer numbers
