"""What varies in a fit is one record."""

from dataclasses import replace

import pytest

from fitting.problem.unknowns import unknowns
from fitting.problem.varying import Varying
from fitting.recordings.experiment import read_experiment
from fitting.shipped import example_data
from mckibben_jax.effects import CoulombFriction, IdealCylinder


@pytest.fixture(scope="module")
def layout():
    """Muscle a with only its radius measured with an error."""
    experiment = read_experiment(example_data("muscle_a"))
    known = replace(experiment, priors={"muscle.radius": (float(experiment.muscle.radius), 1e-4)})
    return unknowns([known], [IdealCylinder(), CoulombFriction()])


@pytest.mark.parametrize(
    ("varying", "names"),
    [
        (Varying(), ("muscle.radius", "coulomb_friction.f_s")),
        (Varying(fix=["muscle.radius"]), ("coulomb_friction.f_s",)),
        (Varying(free=["muscle.length"]), ("muscle.length", "muscle.radius", "coulomb_friction.f_s")),
        (Varying(free=["muscle.length"]).fixing("muscle.length", "muscle.radius"), ("coulomb_friction.f_s",)),
    ],
)
def test_effects_and_what_has_a_prior_vary_unless_asked_otherwise(layout, varying, names):
    assert set(varying.names(layout)) == set(names)


def test_names_that_a_model_lost_are_asked_for_no_more():
    asked = Varying(("tip.k", "muscle.radius"), ("muscle.length",), ("tip.k",))
    assert asked.among({"muscle.radius", "muscle.length"}) == Varying(("muscle.radius",), ("muscle.length",), ())
