"""A data set of other files than CSV, from the first command to an answer; what cannot be read ends with status 2."""

import json

import numpy as np
import pytest
import scipy.io
from click.testing import CliRunner
from small_muscle import loops, write

from fitting.cli.main import main


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
