"""Posteriors where something moves: longer steps serve the search, and the answer is that of the steps of the fit."""

import numpy as np
import pytest
from stick_slip import G

from fitting.least_squares.fit import fit
from fitting.posterior.quick import quick_look
from fitting.posterior.setup import set_up, with_coarser_steps
from fitting.recordings.experiment import read_experiment
from fitting.study.courses import release_courses
from fitting.study.simulate import write_data_set
from mckibben_jax.effects import CoulombFriction, IdealCylinder, ViscousDamping
from mckibben_jax.model import model
from mckibben_jax.muscle import Muscle
from tests.exact_instruments import trusting

TRUTH = {"coulomb_friction.f_s": 0.015, "viscous_damping.B": 60.0}


@pytest.fixture(scope="module")
def released(tmp_path_factory):
    """A muscle let go under two loads, and the fit of what made it."""
    folder = tmp_path_factory.mktemp("released") / "data"
    effects = IdealCylinder(), CoulombFriction(0.015), ViscousDamping(60.0)
    courses = release_courses([3e5], [5 * G, 15 * G], 0.4, 200.0)
    write_data_set(folder, model(Muscle(0.3, 0.007, np.radians(20)), *effects), "quick release", courses, 1e-4, 0)
    experiment = read_experiment(folder)
    return experiment, fit([experiment], [IdealCylinder(), CoulombFriction(), ViscousDamping()], starts=2)


def test_longer_steps_still_reach_the_end_of_the_motion(released):
    experiment, found = released
    target = set_up(found, [experiment], 4000).target
    fine = with_coarser_steps(target, 1)
    at = np.zeros(len(target.centre))
    rows, coarse = (np.asarray(each.parts(at)[2]) for each in (fine, with_coarser_steps(fine, 2)))
    assert np.abs(coarse - rows).max() < 1.0  # one standard deviation of a reading; a motion cut short is off by 1000


def test_the_quick_look_holds_the_truth_and_its_own_check(released):
    experiment, found = released
    look = quick_look(trusting(found), [experiment], draws=1000)
    assert look.settled
    for name, truth in TRUTH.items():
        one = look.parameters[name]
        assert one.median == pytest.approx(found.values[name], abs=0.5 * found.error(name, robust=False) + 1e-12)
        assert abs(one.median - truth) < 4 * one.sd
        assert one.sd == pytest.approx(found.error(name, robust=False), rel=0.3)
