"""Where the force error that an export tells holds: only where was measured."""

import numpy as np
import pytest

from fitting.exporting.force_error import _corner

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
    assert _corner(PRESSURE[kept], CONTRACTION[kept]) == said
