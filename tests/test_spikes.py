"""Readings that stand alone among their neighbours carry no weight, and nothing real is taken for one."""

from dataclasses import replace

import numpy as np
import pytest
from hidden.instruments import EVERY_KIND
from hidden.simulator import EVERY_NOISE, Recording, Truth, dataset, isometric, loops, with_baseline, write
from hidden.study.protocols import WHOLE

from fitting import read_experiment
from fitting.recordings.settings import SPIKES
from fitting.recordings.spikes import spikes

TRUTH = Truth(WHOLE, with_baseline())


def read_back(made: Recording, folder):
    """The one recording as the program reads it."""
    return read_experiment(write(dataset(TRUTH, [made]), folder)).recordings[0]


def disturbed(made: Recording, channel: str, at: tuple[int, ...], by: float) -> Recording:
    """The same with some readings of a channel (SI) off by so much."""
    values = made.columns[channel].copy()
    values[list(at)] += by
    return replace(made, columns={**made.columns, channel: values})


@pytest.mark.parametrize(("channel", "by"), [("force", 60.0), ("pressure", -4e4), ("displacement", 4e-3)])
def test_a_spike_carries_no_weight_and_is_named(channel, by, tmp_path):
    made = disturbed(loops(TRUTH, noise=EVERY_NOISE["ar"], seed=3, samples=600), channel, (200, 201, 1700), by)
    recording = read_back(made, tmp_path / "data")
    (note,) = (note for note in recording.notes if "alone" in note)
    assert note.startswith("3 readings of ")
    assert all(f"{line}" in note for line in (202, 203, 1702))
    rows = np.concatenate([run.row[run.weight > 0] for run in recording.runs])
    assert not {202, 203, 1702} & set(rows.tolist())


def test_a_pressure_that_spikes_is_felt_as_its_neighbours(tmp_path):
    made = loops(TRUTH, noise=EVERY_NOISE["ar"], seed=3, samples=600)
    clean = read_back(made, tmp_path / "clean").runs[0]
    spiky = read_back(disturbed(made, "pressure", (250,), 5e4), tmp_path / "spiky").runs[0]
    assert np.max(np.abs(spiky.pressure - clean.pressure)) < 100.0


@pytest.mark.parametrize("kind", EVERY_KIND)
@pytest.mark.parametrize("made", [loops, isometric])
def test_erring_instruments_make_no_spikes(kind, made, tmp_path):
    recording = read_back(
        made(TRUTH, noise=EVERY_NOISE["ar"], seed=1, samples=300, instruments=EVERY_KIND[kind]), tmp_path / "data"
    )
    assert not [note for note in recording.notes if "alone" in note]


def test_steps_turning_points_and_overshoot_are_no_spikes():
    time = np.arange(200.0)
    step = np.where(time < 100, 0.0, 10.0)
    overshoot = step + 5.0 * (time == 100)
    triangle = 20 - np.abs(time - 100) * 0.2
    jump_at_turn = triangle + np.where(time > 100, -8.0, 0.0)
    for signal in (step, overshoot, triangle, jump_at_turn):
        assert not spikes(signal).any()
    assert np.flatnonzero(spikes(triangle + 5.0 * (time == 60))).tolist() == [60]


def test_a_reading_as_far_off_as_noise_goes_is_no_spike():
    """White noise of one unit: readings are off their neighbours by 1.1 (rms), and step by 0.95 (median)."""
    noise = np.random.default_rng(1).normal(size=4000)
    noise[2000] = 0.0
    bound = SPIKES.beyond_noise * 1.1 + SPIKES.beyond_steps * 0.95

    def found(share):
        return np.flatnonzero(spikes(noise + share * bound * (np.arange(4000) == 2000))).tolist()

    assert (found(0.75), found(1.25)) == ([], [2000])


def test_many_are_noise_and_stay():
    random = np.random.default_rng(0)
    signal = random.standard_normal(500)
    signal[5::20] += 40
    assert not spikes(signal).any()
