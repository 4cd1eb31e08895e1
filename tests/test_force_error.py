"""Where the force error that an export tells holds: only where was measured."""

from types import SimpleNamespace

import numpy as np
import pytest

from fitting.exporting.force_error import _elsewhere
from fitting.exporting.reach import reach
from fitting.exporting.table import guessed_rows

PRESSURE, CONTRACTION = (grid.ravel() for grid in np.meshgrid(np.linspace(0, 6e5, 13), np.linspace(0.0, 0.2, 21)))


@pytest.mark.parametrize(
    ("kept", "said"),
    [
        (PRESSURE >= 0, ""),  # the whole box
        (2e5 * (CONTRACTION > 0.15) <= PRESSURE, ", but at contraction 0.18 or more only above 200 kPa"),
        (PRESSURE >= 3e6 * CONTRACTION, ", but at contraction 0.18 or more only above 550 kPa"),  # slack below
        (0.1 * (PRESSURE > 3e5) < CONTRACTION, ""),  # another corner: nothing is slack there
    ],
)
def test_a_box_that_readings_do_not_fill_where_the_muscle_is_slack_is_said_to_be_so(kept, said):
    found = reach(PRESSURE[kept], CONTRACTION[kept])
    assert str(found).partition(" to 0.2")[2] == said
    assert found.holds(PRESSURE[kept], CONTRACTION[kept]).all()
    slack = (found.far < CONTRACTION) & (found.far_pressure > PRESSURE)
    assert not found.holds(PRESSURE[slack], CONTRACTION[slack]).any()
    assert slack.any() == bool(said)


class Pull:
    """Readings at which only the uncertainty of the force differs."""

    def __init__(self):
        self.pressure, self.contraction = np.array([1e5, 2e5, 3e5, 4e5]), np.array([0.0, 0.05, 0.1, 0.15])


def test_the_place_of_the_largest_uncertainty_is_named_where_most_readings_have_far_less():
    fit = SimpleNamespace(samples=Pull())
    every = np.ones(4, bool)
    said = _elsewhere(fit, every, np.array([1.0, 1.0, 20.0, 1.0]), 40.0)
    assert said == (
        "That uncertainty is largest at 300 kPa and contraction 0.1; at half of the readings it is below 2 N. "
    )
    assert _elsewhere(fit, every, np.array([20.0, 18.0, 20.0, 19.0]), 40.0) == ""
    assert _elsewhere(fit, every, np.zeros(4), 0.0) == ""  # no parameter varies


def test_rows_of_a_table_that_nobody_should_trust_are_counted():
    """Nothing was measured above 300 kPa, and 0 N is no push."""
    columns = {
        "pressure [kPa]": np.array([100.0, 100.0, 300.0, 400.0]),
        "contraction [1]": np.array([0.0, 0.1, 0.1, 0.1]),
        "force [N]": np.array([-3.0, 0.0, 5.0, -1e-5]),
    }
    found = guessed_rows(columns, reach(np.array([1e5, 3e5, 1e5, 3e5]), np.array([0.0, 0.0, 0.1, 0.1])))
    assert (found.rows, found.beyond, found.pushing) == (4, 1, 1)
    assert [text.split(" rows")[0] for text in found.texts] == ["1 of 4", "The force is negative in 1 of 4"]
    assert guessed_rows(columns, None).beyond is None
