"""From what was typed to a task: a single CSV file is read as the folder that holds it would be."""

import pytest
from folders import folder_of, loop_columns, table

from fitting.cli.commands import simulate, sweep
from fitting.designs.sweep_files import KINDS
from fitting.errors import InputError
from fitting.recordings.records import TESTS
from fitting.study.request import Request
from fitting.study.task import task_of


def of_file(folder, **more):
    return task_of(Request(data=(str(folder / "data.csv"),), **more)).experiments[0]


def test_a_single_file_is_read_as_its_folder_is(tmp_path):
    """A copy of a run too: it is no repeat, and has no weight."""
    run = table({"run": 1} | loop_columns())
    again = "\n".join(f"2{row[1:]}" for row in run.splitlines()[1:])
    folder = folder_of(tmp_path, f"{run}{again}\n")
    (whole,) = task_of(Request(data=(str(folder),))).experiments[0].recordings
    (single,) = of_file(folder, test="loop").recordings
    assert single.notes == whole.notes
    assert any("run 2 of data.csv is a copy of run 1" in note for note in single.notes)
    assert [run.weight.sum() for run in single.runs] == [run.weight.sum() for run in whole.runs]
    assert single.runs[1].weight.sum() == 0


def test_commands_that_load_nothing_for_their_help_offer_what_the_program_has():
    assert simulate.KINDS == TESTS
    assert tuple(sweep.NEEDS) == KINDS


def test_a_single_file_needs_its_kind_of_test_and_its_muscle(tmp_path):
    folder = folder_of(tmp_path, table(loop_columns()))
    with pytest.raises(InputError, match="needs its kind of test"):
        of_file(folder)
    (folder / "muscle.toml").rename(tmp_path / "other.toml")
    with pytest.raises(InputError, match="needs its muscle"):
        of_file(folder, test="loop")
    assert of_file(folder, test="loop", muscle=str(tmp_path / "other.toml")).name == "Braid"
