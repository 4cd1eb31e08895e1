"""Which samples and runs a diagnosis looks at, where there are more than it needs."""

from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fitting.problem.thinning import FEWEST_READINGS, thinned, thinned_runs
from fitting.recordings.records import Experiment, Recording, Run
from mckibben_jax.muscle import Muscle

PRESSURES, SPEEDS, EACH = 20, 10, 60
MUSCLE = Muscle(length=0.3, radius=0.007, braid_angle=0.35)


def run(number, pressure, speed):
    """A loop of one pressure and one speed."""
    time = np.arange(EACH) * 0.1
    way = 0.01 * speed * np.minimum(np.arange(EACH), np.arange(EACH)[::-1])
    still = np.zeros(EACH)
    return Run(
        name=str(number), time=time, pressure=still + 1e5 * (1 + pressure), contraction=way, rate=still + 0.01 * speed,
        pressure_rate=still, measured=100.0 * (1 + pressure) + still, weight=still + 1, branch=still,
        loop=still.astype(int), half=(np.arange(EACH) >= EACH // 2).astype(int), row=np.arange(EACH),
    )  # fmt: skip


@pytest.fixture
def many():
    """Every speed at every pressure, speed by speed as a protocol goes: in two files."""
    both = [(p, s) for p in range(PRESSURES) for s in range(1, SPEEDS + 1)]
    runs = tuple(run(number, *each) for number, each in enumerate(both))
    recordings = (Recording("a.csv", "loop", runs[:70], 0.5), Recording("b.csv", "loop", runs[70:], 0.5))
    return Experiment("many", Path("many"), MUSCLE, recordings, {}, "")


def kept(experiment):
    """Pressure and speed of every run that is kept."""
    return [(run.pressure[0], round(run.rate[0], 6)) for rec in experiment.recordings for run in rec.runs]


def test_of_many_runs_some_are_kept_that_have_enough_readings(many):
    few = thinned(many, 600)
    runs = [run for rec in few.recordings for run in rec.runs]
    assert len(runs) == 600 // FEWEST_READINGS
    assert min(len(run) for run in runs) >= FEWEST_READINGS
    assert sum(len(run) for run in runs) < 1000


def test_no_pressure_and_no_speed_of_a_protocol_is_skipped(many):
    """Every tenth run would be of one speed."""
    pressures, speeds = (Counter(values) for values in zip(*kept(thinned(many, 600)), strict=True))
    assert len(pressures) == PRESSURES
    assert len(speeds) >= SPEEDS - 1
    assert max(speeds.values()) <= 12  # of 50, where 5 are to be expected


def test_the_same_runs_are_kept_in_whatever_order_and_files_they_come(many):
    runs = [run for rec in many.recordings for run in rec.runs][::-1]
    other = replace(many, recordings=(replace(many.recordings[0], runs=tuple(runs)),))
    assert sorted(kept(thinned(other, 600))) == sorted(kept(thinned(many, 600)))


def test_a_recording_of_which_no_run_is_kept_is_gone(many):
    one = replace(many.recordings[0], runs=many.recordings[0].runs[:1])
    split = replace(many, recordings=(*(replace(one, runs=(r,)) for r in many.recordings[1].runs),))
    assert all(rec.runs for rec in thinned(split, 240).recordings)


def test_a_kind_of_test_of_which_there_are_few_runs_keeps_them(many):
    rare = replace(many.recordings[1], test="isometric", runs=many.recordings[1].runs[:4])
    mixed = replace(many, recordings=(many.recordings[0], rare))
    loops, few = thinned(mixed, 240).recordings
    assert [run.name for run in few.runs] == [run.name for run in rare.runs]
    assert len(loops.runs) < 70


def test_all_runs_stay_where_a_posterior_is_sampled(many):
    assert kept(thinned_runs(many, 600)) == kept(many)


def test_points_of_maps_and_a_few_runs_stay(many):
    points = replace(many, recordings=tuple(replace(rec, test="static") for rec in many.recordings))
    assert kept(thinned(points, 600)) == kept(many)
    some = replace(many, recordings=(replace(many.recordings[0], runs=many.recordings[0].runs[:10]),))
    assert kept(thinned(some, 40)) == kept(some)
