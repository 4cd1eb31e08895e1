"""The moment at which a muscle is let go, where the logger began to read before: found, stated, or time 0 as it is."""

import numpy as np
import pytest
from folders import folder_of, only_run, table

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
