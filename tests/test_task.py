"""From what was typed to a task: a single CSV file is read as the folder that holds it would be."""

import pytest
from folders import folder_of, loop_columns, model_beside, table

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


def test_a_size_of_a_model_file_that_the_measurements_exclude_is_refused(tmp_path):
    """A search would move it to the end of its range, and everything would speak of another muscle."""
    folder = folder_of(tmp_path, table(loop_columns()))
    known = task_of(Request(data=(str(folder),), model=model_beside(folder))).experiments[0].muscle
    good = {"length": f"{float(known.length) * 1e3:.6f} mm", "radius": f"{float(known.radius) * 1e3:.6f} mm"}
    good["braid_angle"] = f"{float(known.braid_angle):.9f} rad"
    assert "are not used" not in task_of(Request(data=(str(folder),), model=model_beside(folder, **good))).origin
    for name, value in (("radius", "100 mm"), ("braid_angle", "89.9 deg")):
        with pytest.raises(InputError, match=f"muscle.{name} = .* lies outside what was measured"):
            task_of(Request(data=(str(folder),), model=model_beside(folder, **good | {name: value})))


def test_of_a_model_that_was_fitted_to_no_data_the_sizes_are_said_not_to_be_used(tmp_path):
    folder = folder_of(tmp_path, table(loop_columns()))
    file = model_beside(folder, length="200 mm", radius="100 mm", braid_angle="20 deg")
    text = (folder / "model.toml").read_text(encoding="utf-8").split("[fitted_to]")[0]
    (folder / "model.toml").write_text(text, encoding="utf-8")
    told = task_of(Request(data=(str(folder),), model=file))
    assert "its sizes of the muscle are not used, those of muscle.toml are" in told.origin
    assert not any(name.startswith("muscle.") for name in told.known)
