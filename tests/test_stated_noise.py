"""Readings that scatter by far more than was stated of them are warned of, and others are not."""

import numpy as np
import pytest
from folders import folder_of
from small_muscle import loops, write

from fitting import compare, fit, read_experiment
from fitting.recordings.noise import noise_of, source_of_noise
from fitting.recordings.presumed import presumed
from fitting.recordings.records import NoiseSource
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


POINTS = "load [N],pressure [bar],length [mm],branch\n" + "".join(
    f"{120 * p - 20 * k:g},{p:g},{300 - 6 * k:g},contraction\n" for p in (1.0, 2.0, 4.0) for k in range(6)
)


@pytest.mark.parametrize(
    ("stated", "added"),
    [
        ('length = { noise = "0.5 mm" }', (0.5e-3, 0.0)),
        ('length = { resolution = "1 mm" }', (1e-3 / 12**0.5, 0.0)),
        ('pressure = { noise = "2 kPa" }', (0.0, 2e3)),
        ('pressure = { noise = "2 kPa" }\nlength = { noise = "0.5 mm" }', (0.5e-3, 2e3)),
        ('pressure = { zero = "2 kPa" }', (0.0, 0.0)),
    ],
)  # fmt: skip
def test_a_point_of_a_map_errs_by_what_a_ruler_and_a_gauge_err_by(tmp_path, stated, added):
    """Weights hang on and a ruler is read: the load is exact, the length is not. In the law (eq 10) of the textbook."""
    folder = folder_of(tmp_path, POINTS, test="static", more=f'noise = "0.1 N"\n[recording.accuracy]\n{stated}')
    experiment = read_experiment(folder)
    (recording,) = experiment.recordings
    (run,) = recording.runs
    a, b, area = 3 / np.tan(np.pi / 9) ** 2, 1 / np.sin(np.pi / 9) ** 2, np.pi * 7e-3**2
    left = 1 - run.contraction
    by_length = run.pressure * area * 2 * a * left * added[0] / 0.3
    by_pressure = area * (a * left**2 - b) * added[1]
    wanted = np.sqrt(0.1**2 + np.mean(by_length**2 + by_pressure**2))
    assert noise_of(recording) == pytest.approx(wanted, rel=1e-4)


def test_a_loop_whose_length_is_smoothed_errs_as_its_load_cell_does(tmp_path):
    folder = write(
        tmp_path / "m", loops(), extra='noise = "0.3 N"\n[recording.accuracy]\nlength = { noise = "0.5 mm" }'
    )
    assert [noise_of(each) for each in read_experiment(folder).recordings] == [0.3]


def test_a_ruler_that_is_read_badly_makes_no_zero_of_the_load_cell(tmp_path):
    """What is presumed of the load cell goes by its own noise: a zero of 9 N would excuse what is missing."""
    stated = 'noise = "0.1 N"\n[recording.accuracy]\nlength = { noise = "2 mm" }'
    (recording,) = read_experiment(folder_of(tmp_path, POINTS, test="static", more=stated)).recordings
    assert noise_of(recording) > 5.0
    assert presumed(recording).force.zero_per_run == pytest.approx(0.1)
    assert source_of_noise(recording) is NoiseSource.STATED_OF_ALL
