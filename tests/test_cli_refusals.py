"""What is typed wrongly: one message with a cure, exit status 2, and nothing of the user's replaced."""

import json
import re

import pytest
from typed import copied, refused, run

from fitting.cli.run import check_places, check_results


@pytest.fixture
def data(springy, tmp_path):
    """A copy of a data set that a test may write into."""
    return copied(springy, tmp_path / "small")


@pytest.mark.parametrize(
    ("args", "words"),
    [
        (["--effects", "ideal_cylinder", "tipp"], "did you mean 'tip'"),
        (["--effects", "ideal_cylinder,tip"], "write spaces between: ideal_cylinder tip"),
        (
            ["--set", "muscle.radius=7 mm", "coulomb_friction.f_s=0.1"],
            "--set takes one value: write it again before each",
        ),
        (["--effects", "tip"], "no effect of the model pulls"),
        (["--set", "coulomb_friction.fs=1"], "did you mean 'coulomb_friction.f_s'"),
        (["--set", "coulomb_friction.f_s=7"], "outside its range"),
        (["--set", "muscle.radius=7"], "no unit"),
        (["--fix", "muscle.radios"], "did you mean 'muscle.radius'"),
        (["--model", "nowhere.toml"], "no such model file"),
        (["--effect-file", "nowhere.py"], "no such file"),
        (["--effects", "ideal_cylinder", "radial_gap"], "radial_gap needs shear modulus"),
        (["--baseline", "--model", "m.toml"], "one way only"),
        (["--json", "/nowhere/x.json", "--effects", "ideal_cylinder"], "cannot be written"),
    ],
)
def test_a_slip_is_one_message_with_the_cure(data, args, words):
    assert words in refused("compare", data, *args)


def test_no_data_and_wrong_data_are_said(tmp_path):
    assert "no such file or folder" in refused("compare", tmp_path / "nowhere")
    assert "no data set is named" in refused("add", "linear_spring")
    assert "no effect is named" in refused("add", tmp_path)


def test_bad_input_goes_to_json_field_by_field(data, tmp_path):
    path = data / "loops.csv"
    path.write_text(path.read_text().replace("0,0.050,", "0,abc,", 1))
    out = tmp_path / "e.json"
    message = refused("compare", data, "--json", out)
    error = json.loads(out.read_text())["error"]
    assert error["row"] == 3
    assert error["value"] == "abc"
    assert "row 3" in message
    assert "time [s]" in message


@pytest.mark.parametrize("args", [["compare"], ["effects", "--jsonx"], ["diagnose", "data/muscle_a", "--seed", "x"]])
def test_a_wrong_command_line_is_one_message_with_a_cure(args):
    assert re.fullmatch(rf"mckibben: .+ Cure: '.*{args[0]} --help' says what it takes\n", refused(*args))


@pytest.mark.parametrize(("option", "value"), [("--seed", -1), ("--starts", 0), ("--starts", -3)])
def test_numbers_that_mean_nothing_are_refused(data, option, value):
    assert "is not in the range" in run("fit", data, option, value, status=2).stderr


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--speed", "0 mm/s"], "--speed is not above 0"),
        (["--speed", "-5 mm/s"], "--speed is not above 0"),
        (["--rate", "0 Hz"], "--rate is not above 0"),
        (["--noise", "-1 N"], "--noise goes below 0"),
        (["--pressure", "-2 bar"], "--pressure goes below a vacuum"),
        (["--test", "quick release", "--load", "-3 kg"], "--load is not above 0"),
        (["--json", "no folder/x.json"], "cannot be written"),
    ],
)
def test_no_rig_is_asked_for_what_none_can_do(data, tmp_path, options, message):
    run("fit", data, "--starts", 1)
    assert message in refused("simulate", data / "model.toml", "--out", tmp_path / "made", *options)
    assert not (tmp_path / "made").exists()


def test_a_candidate_that_the_model_has_is_no_candidate(data):
    assert "has coulomb_friction already" in refused("discover", data, "--candidates", "coulomb_friction")


@pytest.mark.parametrize("option", ["--json", "--html"])
@pytest.mark.parametrize("file", ["loops.csv", "muscle.toml"])
def test_a_result_never_replaces_a_measurement(data, option, file):
    before = (data / file).read_bytes()
    assert "left alone" in refused("compare", data, option, data / file)
    assert (data / file).read_bytes() == before


def test_commands_that_read_no_data_replace_none_either(data):
    before = (data / "muscle.toml").read_bytes()
    assert "left alone" in refused("effects", "--json", data / "muscle.toml")
    assert (data / "muscle.toml").read_bytes() == before


@pytest.mark.parametrize("option", ["--json", "--html"])
@pytest.mark.parametrize(
    "content",
    ["Chapter 3. The muscle\n", "\ufeff- to do\n", "PK\x03\x04", "[section]\n", '{"a": 1}\n{"a": 2}\n', "<svg></svg>",
     1001 * " " + "text"],
)  # fmt: skip
def test_a_result_never_replaces_what_is_no_result(tmp_path, option, content):
    there = tmp_path / "thesis"
    there.write_text(content, encoding="utf-8")
    assert "left alone" in refused("effects", option, there)
    assert there.read_text(encoding="utf-8") == content


def test_a_device_takes_every_result_and_a_notebook_none(tmp_path):
    check_results("/dev/stdout", "/dev/null")
    notebook = tmp_path / "work.ipynb"
    notebook.write_text('{"cells": []}')
    assert "left alone" in refused("effects", "--json", notebook)


def test_a_page_is_drawn_and_a_posterior_kept_a_second_time(tmp_path):
    """Files of commands that are neither JSON nor pages replace their older selves."""
    for name in ("muscle.png", "draws.nc"):
        (tmp_path / name).write_bytes(b"\x89PNG or HDF")
        check_places(str(tmp_path / name))


@pytest.mark.parametrize(("option", "content"), [("--json", '{"a": 1}'), ("--json", ""), ("--html", "<!doctype html>")])
def test_an_older_result_is_replaced(tmp_path, option, content):
    there = tmp_path / "result"
    there.write_text(content)
    run("effects", option, there)
    assert len(there.read_text()) > len(content)
