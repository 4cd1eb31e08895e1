"""Where the search for motions begins: at the best fit to the motions read as force, if nothing else lies lower."""

from types import SimpleNamespace

import numpy as np
import pytest
from test_inverse_dynamics import released

from fitting.least_squares.fit import fit
from fitting.least_squares.starts import from_best_of_forces
from fitting.least_squares.summary import MissedMotions, SearchSummary
from fitting.report.text.search import failure_texts, search_text
from mckibben_jax.effects import CoulombFriction, IdealCylinder, ViscousDamping

B = 150.0  # N s/m, of the simulator's drag
MODEL = IdealCylinder(), CoulombFriction(), ViscousDamping()


@pytest.fixture(scope="module")
def releases(tmp_path_factory):
    """Releases of a muscle with a drag."""
    return released(tmp_path_factory.mktemp("releases"), viscous_damping={"B": B})[0]


def test_of_several_starts_all_but_one_are_of_the_motions_read_as_force(releases):
    found = fit([releases], MODEL, starts=5)
    assert found.search == SearchSummary(starts=1, reached=1, of_forces=SearchSummary(starts=5, reached=5))
    assert abs(found.values["viscous_damping.B"] - B) < 4 * found.error("viscous_damping.B")
    assert found.over_noise < 1.1
    assert not found.failures
    assert search_text(found) == (
        "motions read as force, 5 starts: 5 reached the same best point; from there on the motions themselves, "
        "1 start: 1 reached the same best point"
    )


def test_a_single_start_is_where_it_was_asked_for(releases):
    found = fit([releases], MODEL, starts=1, start={"viscous_damping.B": 140.0})
    assert found.search == SearchSummary(starts=1, reached=1)


def test_a_search_begins_elsewhere_too_where_that_is_lower():
    costs = {0.5: 3.0, 0.1: 2.0, 0.2: np.inf, 0.9: 3.0}
    searches = SimpleNamespace(look=lambda _, places: np.array([costs[float(place[0])] for place in places]))
    begin = from_best_of_forces(searches, None, np.array([0.5]), np.array([[0.1], [0.2], [0.9]]))
    np.testing.assert_array_equal(begin, [[0.5], [0.1]])


def test_a_search_begins_elsewhere_where_the_forces_lead_to_no_finite_number():
    searches = SimpleNamespace(look=lambda _, places: np.where(places[:, 0] == 0.5, np.inf, 1.0))
    begin = from_best_of_forces(searches, None, np.array([0.5]), np.array([[0.1], [0.2]]))
    np.testing.assert_array_equal(begin, [[0.5], [0.1], [0.2]])


@pytest.mark.parametrize(
    ("as_force", "said"), [(0.9, "small against the forces"), (4.0, "--shooting"), (None, "--shooting")]
)
def test_positions_that_are_missed_are_held_against_their_forces(as_force, said):
    (told,) = failure_texts(SimpleNamespace(failures=(MissedMotions(9.0, 1, 1, as_force),)))
    assert "missed by 9 times their noise" in told
    assert said in told
