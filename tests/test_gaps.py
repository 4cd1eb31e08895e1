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


@pytest.mark.parametrize("times", [1.0, 14.0])
def test_readings_that_come_unevenly_have_none(tmp_path, times):
    """A logger that writes now and then: one pause in twenty is long."""
    rows = [k for k in range(202) if k % 20 >= times]
    left = np.setdiff1d(np.arange(202), rows)
    assert noted(folder_of(tmp_path, table(without(loop_columns(), left)))) == []
