"""The moment at which a muscle is let go, where the logger began to read before: found, stated, or time 0 as it is."""

import numpy as np
import pytest
from folders import folder_of, loop_csv, only_run, table

from fitting.errors import InputError
from fitting.recordings.let_go import let_go_at

RATE = 500.0  # Hz
WAYS = {"accelerated": lambda t: 5.0 * t**2,
        "damped": lambda t: 0.06 * (1 - (1 + t / 0.015) * np.exp(-t / 0.015)),
        "swinging": lambda t: 0.03 * (1 - (np.cos(25 * t) + 0.12 * np.sin(25 * t)) * np.exp(-3 * t)),
        "without mass": lambda t: 0.06 * (1 - np.exp(-t / 0.03))}  # fmt: skip


def readings(way, let_go, noise=2e-5, rounded=2e-5, seed=0):
    """Time and position (m) of a logger that begins to read at its time 0."""
    time = np.arange(0, 0.6, 1 / RATE)
    moved = WAYS[way](np.maximum(time - let_go, 0)) + 1.2e-3 + np.random.default_rng(seed).normal(0, noise, len(time))
    return time, np.round(moved / rounded) * rounded


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("let_go", [0.0501, 0.1, 0.2507])
@pytest.mark.parametrize("seed", range(3))
def test_the_moment_is_found_to_a_fraction_of_a_sampling_interval(way, let_go, seed):
    time, moved = readings(way, let_go, seed=seed)
    assert let_go_at(time, moved / 0.18) == pytest.approx(let_go, abs=0.75 / RATE)


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("shift", [0.0, 0.1])  # readings from where it is let go on; or from 0.1 s before
@pytest.mark.parametrize("noise", [0.0, 2e-5, 2e-4])
def test_a_time_that_is_0_where_the_muscle_is_let_go_is_left_alone(way, shift, noise):
    time, moved = readings(way, shift, noise)
    assert let_go_at(time - shift, moved / 0.18) == 0.0


@pytest.mark.parametrize("rate", [100, 500, 2000])
@pytest.mark.parametrize(("stroke", "noise"), [(0.02, 2e-4), (0.06, 2e-4), (0.06, 5e-5)])
def test_noise_moves_no_moment_that_is_right(rate, stroke, noise):
    """Readings from time 0 or from before on; a release that is recorded at 0 is left there whatever the seed."""
    random = np.random.default_rng(1)
    for begin in (0.0, -0.2):
        time = np.arange(begin, 0.6, 1 / rate)
        way = stroke * (1 - np.cos(12 * np.maximum(time, 0))) / 2
        moved = [let_go_at(time, (way + random.normal(0, noise, len(time))) / 0.18) for _ in range(40)]
        assert np.count_nonzero(moved) == 0, (begin, moved)


@pytest.mark.parametrize("drift", [2e-4, 4e-4, 2e-3])
def test_a_drift_before_it_is_let_go_moves_nothing(drift):
    time = np.arange(-0.5, 0.6, 1 / RATE)
    way = WAYS["damped"](np.maximum(time, 0)) + drift * np.minimum(time, 0) / 0.5
    way = way + np.random.default_rng(0).normal(0, 2e-5, len(time))
    assert let_go_at(time, way / 0.18) == 0.0


def test_a_fault_of_the_sensor_is_no_motion():
    time, moved = readings("damped", 0.5)
    moved[100] += 0.02
    assert let_go_at(time - 0.5, moved / 0.18) == 0.0
    assert let_go_at(time, moved / 0.18) == pytest.approx(0.5, abs=0.75 / RATE)


def test_readings_that_begin_in_the_motion_tell_no_moment():
    time, moved = readings("damped", 0.0)
    assert let_go_at(time[10:], moved[10:] / 0.18) == 0.0


def test_a_muscle_that_never_moves_is_left_alone():
    time, _ = readings("damped", 0.0)
    assert let_go_at(time, np.random.default_rng(0).normal(0, 1e-4, len(time))) == 0.0
    assert let_go_at(time, np.full(len(time), np.nan)) == 0.0


def release(let_go: float) -> str:
    time, moved = readings("damped", let_go)
    columns = {"time [s]": np.round(time, 4), "pressure [bar]": 3.0, "displacement [mm]": np.round(1e3 * moved, 3)}
    return table(columns | {"load [kg]": 20.0})


def test_the_readings_of_a_release_begin_there_and_say_so(tmp_path):
    """They were fitted as if the muscle had been let go at the first reading: 15 to 25 mm of misfit."""
    data, run = only_run(folder_of(tmp_path, release(0.1), test="quick release"))
    assert run.time[0] == pytest.approx(-0.1, abs=1e-3)
    assert (run.weight == (run.time >= 0)).all()
    (said,) = [note for note in data.notes if "let_go" in note]
    assert "begins to move" in said
    data, run = only_run(folder_of(tmp_path, release(0.0), test="quick release"))
    assert run.time[0] == 0.0
    assert not any("let_go" in note for note in data.notes)


def test_a_stated_moment_is_taken_as_it_is(tmp_path):
    _, run = only_run(folder_of(tmp_path, release(0.1), test="quick release", more='let_go = "90 ms"'))
    assert run.time[0] == pytest.approx(-0.09)
    _, run = only_run(folder_of(tmp_path, release(0.1), test="quick release", more='let_go = "0 s"'))
    assert run.time[0] == 0.0
    with pytest.raises(InputError, match="let_go"):
        only_run(folder_of(tmp_path, release(0.1), test="quick release", more='let_go = "3 mm"'))
    with pytest.raises(InputError, match="let_go"):
        only_run(folder_of(tmp_path, release(0.1), test="quick release", more="let_go = true"))
    with pytest.raises(InputError, match="leave let_go out"):
        only_run(folder_of(tmp_path, loop_csv(), more='let_go = "0.1 s"'))


def test_empty_cells_before_the_motion_are_no_rest(tmp_path):
    rows = release(0.0).splitlines()
    emptied = [",".join([*row.split(",")[:2], "", row.split(",")[3]]) for row in rows[1:26]]
    _, run = only_run(folder_of(tmp_path, "\n".join([rows[0], *emptied, *rows[26:]]) + "\n", test="quick release"))
    assert run.time[0] == 0.0
