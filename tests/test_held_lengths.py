"""Where a recording holds several lengths, each is a run, however the rig moved from one to the next."""

from itertools import pairwise

import numpy as np
import pytest
from folders import folder_of, table

from fitting.errors import InputError
from fitting.recordings.experiment import read_experiment
from fitting.recordings.held_lengths import held_stretches, wanders

RANDOM = np.random.default_rng(5)
LEVELS = (0.0, 0.02, 0.06, 0.11)


def staircase(samples=400, way=0, levels=LEVELS, noise=2.5e-4):
    """Contractions held for so many samples each, so many more on the way from one to the next."""
    parts = [np.full(samples, levels[0])]
    for before, after in pairwise(levels):
        parts += [np.linspace(before, after, way + 2)[1:-1], np.full(samples, after)]
    return np.concatenate(parts) + RANDOM.normal(0, noise, (len(levels) - 1) * way + len(levels) * samples)


def sweeps(place):
    """Pressures that are swept many times while a length is held, Pa."""
    return 3e5 + 1e5 * np.sin(np.arange(place.size) / 20)


@pytest.mark.parametrize("way", [0, 3, 20, 100])
def test_every_length_is_a_stretch_however_slowly_the_rig_moves_there(way):
    place = staircase(way=way)
    found = held_stretches(place, sweeps(place))
    assert [np.median(place[at]) for at in found] == pytest.approx(LEVELS, abs=2e-4)
    for number, at in enumerate(found):
        held = np.arange(number * (400 + way), number * (400 + way) + 400)
        assert set(held) <= set(at)  # what is held is lost nowhere
        assert len(at) <= 400 + way
        assert not wanders(place[at])


def test_a_length_that_comes_back_is_another_stretch():
    place = staircase(way=20, levels=(0.02, 0.08, 0.02))
    assert [round(np.median(place[at]), 2) for at in held_stretches(place, sweeps(place))] == [0.02, 0.08, 0.02]


def test_a_sensor_that_wanders_within_what_is_allowed_stays_in_one_stretch():
    wandering = 0.05 + np.linspace(0, 0.009, 500)
    (at,) = held_stretches(wandering, sweeps(wandering))
    assert len(at) == 500


@pytest.mark.parametrize("moving", [np.linspace(0, 0.2, 2000), 0.1 * (1 - np.cos(np.arange(2000) / 100))])
def test_a_length_that_moves_all_the_time_is_not_cut(moving):
    """It is no isometric test, whatever is called so."""
    (at,) = held_stretches(moving, sweeps(moving))
    assert len(at) == 2000
    assert wanders(moving[at])


@pytest.mark.parametrize("by", [0.011, 0.02, 0.05])
def test_a_rig_that_gives_way_where_the_pressure_steps_holds_no_length(by):
    """It stands between steps; cut there, what it gives way by would be lost."""
    steps = np.clip(3 * np.sin(np.arange(2000) / 100), -1, 1) / 2
    (at,) = held_stretches(0.05 + by * steps, 3e5 + 1e5 * steps)
    assert len(at) == 2000


def test_a_length_that_settles_once_is_not_cut():
    """Only the end would stay, and the creep that it shows would be gone."""
    settling = 0.05 * (1 - np.exp(-np.arange(2000) / 300))
    (at,) = held_stretches(settling, sweeps(settling))
    assert len(at) == 2000


def test_one_file_of_lengths_between_which_the_rig_creeps_is_read(tmp_path):
    """It was refused, and had to be cut into files by hand."""
    place = staircase(way=30)
    pressure = 3 + np.sin(np.arange(place.size) / 20)
    columns = {
        "time [s]": np.round(np.arange(place.size) * 0.1, 2), "pressure [bar]": pressure, "contraction [1]": place,
        "force [N]": 300 - 900 * place + 10 * pressure,
    }  # fmt: skip
    (data,) = read_experiment(folder_of(tmp_path, table(columns), test="isometric")).recordings
    assert [round(float(np.median(run.contraction)), 2) for run in data.runs] == list(LEVELS)
    assert any("carry no weight: between two lengths" in note for note in data.notes)


def test_a_test_in_which_the_length_moves_is_refused(tmp_path):
    moving = 0.1 * (1 - np.cos(np.arange(800) / 40))
    columns = {
        "time [s]": np.round(np.arange(800) * 0.1, 2), "pressure [bar]": 3.0, "contraction [1]": moving,
        "force [N]": 300 - 900 * moving,
    }  # fmt: skip
    with pytest.raises(InputError, match="the length is not held"):
        read_experiment(folder_of(tmp_path, table(columns), test="isometric"))
