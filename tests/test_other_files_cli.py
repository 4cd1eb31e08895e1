"""A data set of other files than CSV, from the first command to an answer; what cannot be read ends with status 2."""

import json

import numpy as np
import pytest
import scipy.io
from click.testing import CliRunner
from other_files import rows_of, workbook
from small_muscle import loops, write

from fitting.cli.main import main
from fitting.recordings.experiment import read_experiment
from fitting.workbench.data import guess, keep
from fitting.workbench.form import Filled, Size, describe


def as_mat(folder):
    """The CSV of a small muscle as a MATLAB file in its place."""
    run, time, pressure, displacement, force = np.array(loops()).T
    scipy.io.savemat(
        folder / "loops.mat",
        {"run": run, "time": time, "pressure": pressure, "displacement": displacement, "force": force},
    )
    (folder / "loops.csv").unlink()
    toml = folder / "muscle.toml"
    units = 'units = { time = "s", pressure = "Pa", displacement = "m", force = "N" }'
    toml.write_text(toml.read_text().replace('"loops.csv"', f'"loops.mat"\n{units}'))
    return folder


def test_compare_answers_the_same_whatever_the_kind_of_file(tmp_path):
    answers = []
    for folder in (write(tmp_path / "csv", loops()), as_mat(write(tmp_path / "mat", loops()))):
        done = CliRunner().invoke(main, ["compare", str(folder), "--json", str(folder / "out.json"), "--quiet"])
        assert done.exit_code == 0, done.output
        answers.append(json.loads((folder / "out.json").read_text())["rmse_N"])
    assert answers[1] == pytest.approx(answers[0], rel=1e-3)  # the CSV is rounded


def test_a_damaged_file_ends_with_status_2_and_one_message(tmp_path):
    folder = as_mat(write(tmp_path / "mat", loops()))
    (folder / "loops.mat").write_bytes((folder / "loops.mat").read_bytes()[:900])
    done = CliRunner().invoke(main, ["compare", str(folder)])
    assert done.exit_code == 2
    told = " ".join(done.output.split())
    assert "this is no MATLAB file, or it is damaged or breaks off. Cure: save it again" in told
    assert "Traceback" not in done.output


def test_files_that_are_dropped_into_the_workbench_may_be_of_any_kind(tmp_path):
    """One workbook with two sheets of readings: the first one is taken, and its name is written down."""
    pytest.importorskip("openpyxl", reason="openpyxl is not installed: pip install 'mckibben-jax[files]'")
    (tmp_path / "place").mkdir()
    content = workbook({"Monday": rows_of(), "Tuesday": rows_of()})
    dropped = guess(keep([("loops.xlsx", content)], tmp_path / "place"))
    columns = {file: [(c.meaning, c.unit) for c in found] for file, found in dropped.columns.items()}
    muscle = {"length": Size("300", "", "mm"), "radius": Size("7", "", "mm"), "braid_angle": Size("20", "", "deg")}
    folder = describe(dropped, "A", Filled(muscle, dropped.tests, columns))
    assert 'sheet = "Monday"' in (folder / "muscle.toml").read_text()
    assert len(read_experiment(folder).recordings[0].runs[0]) == 202
