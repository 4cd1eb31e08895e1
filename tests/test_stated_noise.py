"""Readings that scatter by far more than was stated of them are warned of, and others are not."""

import numpy as np
import pytest
from small_muscle import loops, write

from fitting import compare, fit, read_experiment
from fitting.report.text.warnings import comparison_warnings
from mckibben_jax import CoulombFriction, IdealCylinder


def told(folder):
    data = [read_experiment(folder)]
    warnings = comparison_warnings(compare(fit(data, [IdealCylinder(), CoulombFriction()], starts=1), data))
    return [each for each in warnings if each.startswith("Neighbouring readings")]


@pytest.mark.parametrize(
    ("stated", "warned"),
    [('noise = "0.03 N"', True), ('noise = "0.3 N"', False), ('noise = "3 N"', False), ("", False)],
    ids=["too good", "right", "too modest", "nothing stated"],
)
def test_a_load_cell_that_is_said_to_be_better_than_it_is(tmp_path, stated, warned):
    found = told(write(tmp_path / "m", loops(noise=0.3), extra=stated))
    assert bool(found) is warned
    if warned:
        assert "readings of the force scatter by 0.3" in found[0]
        assert "is stated to err by 0.03 N. Correct noise" in found[0]


@pytest.mark.parametrize("step", [0.0, 2e3])
def test_a_gauge_is_not_blamed_for_its_steps(tmp_path, step):
    """Rounding to 2 kPa scatters by 0.6 kPa, whatever the noise; without steps the same scatter is noise."""
    scatter = np.random.default_rng(1)
    read = lambda p: step * round(p / step) if step else p  # noqa: E731
    rows = [(r, t, read(p + scatter.normal(0, 1e3)), x, f) for r, t, p, x, f in loops()]
    stated = 'noise = "0.3 N"\n[recording.accuracy]\npressure = { noise = "0.05 kPa" }'
    found = told(write(tmp_path / "m", rows, extra=stated))
    if step:
        assert not found
    else:
        (warning,) = found
        assert "readings of the pressure scatter by 1" in warning
        assert "Correct the noise of the pressure in muscle.toml" in warning
