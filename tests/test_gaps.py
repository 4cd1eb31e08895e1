"""Holes in a recording are named, and other pauses are not."""

import numpy as np
import pytest
from folders import folder_of, loop_columns, table

from fitting import read_experiment

SILENT = slice(60, 75)


def noted(folder):
    return [note for note in read_experiment(folder).recordings[0].notes if "no reading for" in note]


def without(columns, rows, size=202):
    return {name: np.delete(np.broadcast_to(values, size), rows) for name, values in columns.items()}


def test_a_hole_is_named_with_its_rows(tmp_path):
    columns = loop_columns()
    time = next(np.asarray(values) for name, values in columns.items() if name.startswith("time"))
    (note,) = noted(folder_of(tmp_path, table(without(columns, SILENT))))
    rows = SILENT.start + 1, SILENT.start + 2  # behind the line of heads
    assert f"(rows {rows[0]}, {rows[1]})" in note
    assert note.startswith(f"run 1: no reading for {time[SILENT.stop] - time[SILENT.start - 1]:.2g} s")


def test_a_whole_recording_has_none(tmp_path):
    assert noted(folder_of(tmp_path, table(loop_columns()))) == []


def test_a_pause_in_which_nothing_moves_is_no_hole(tmp_path):
    columns = {name: np.array(np.broadcast_to(values, 202)) for name, values in loop_columns().items()}
    time = next(values for name, values in columns.items() if name.startswith("time"))
    time[SILENT.start :] += 30.0
    assert noted(folder_of(tmp_path, table(columns))) == []


def three_levels(pressures=(1.0, 2.0, 3.0), pause=15.0):
    """One file of loops at several pressures (bar), the logger pausing between them."""
    columns = {name: np.array(np.broadcast_to(values, 202)) for name, values in loop_columns().items()}
    time = next(name for name in columns if name.startswith("time"))
    several = {name: np.tile(values, len(pressures)) for name, values in columns.items()}
    scatter = np.random.default_rng(0).normal(0, 0.01, len(several[time]))
    several["pressure [bar]"] = np.repeat(pressures, 202) + scatter
    several[time] = np.concatenate([columns[time] + k * (columns[time][-1] + pause) for k in range(len(pressures))])
    return several


def test_loops_at_several_pressures_in_one_file_are_runs(tmp_path):
    recording = read_experiment(folder_of(tmp_path, table(three_levels()))).recordings[0]
    assert [run.name for run in recording.runs] == ["1", "2", "3"]
    assert [len(run) for run in recording.runs] == [202, 202, 202]
    assert [round(float(np.median(run.pressure)) / 1e5, 1) for run in recording.runs] == [1.0, 2.0, 3.0]
    assert any("(new runs from rows 204, 406)" in note for note in recording.notes)
    assert not [note for note in recording.notes if "no reading for" in note]


@pytest.mark.parametrize(("pressures", "pause"), [((2.0, 2.0, 2.0), 15.0), ((1.0, 2.0, 3.0), 0.1)])
def test_what_is_no_pause_or_no_other_pressure_begins_no_run(tmp_path, pressures, pause):
    columns = three_levels(pressures, pause)
    assert len(read_experiment(folder_of(tmp_path, table(columns))).recordings[0].runs) == 1


def test_names_of_runs_in_the_file_stand(tmp_path):
    columns = three_levels() | {"run": np.repeat(["a", "b"], 303)}
    assert [run.name for run in read_experiment(folder_of(tmp_path, table(columns))).recordings[0].runs] == ["a", "b"]


@pytest.mark.parametrize("times", [1.0, 14.0])
def test_readings_that_come_unevenly_have_none(tmp_path, times):
    """A logger that writes now and then: one pause in twenty is long."""
    rows = [k for k in range(202) if k % 20 >= times]
    left = np.setdiff1d(np.arange(202), rows)
    assert noted(folder_of(tmp_path, table(without(loop_columns(), left)))) == []
