"""Identified muscles: the shipped ones are what their data say, and a user's own becomes a folder that can be sent."""

import dataclasses
import json
import re
import shutil

import numpy as np
import pytest
import small_muscle
from click.testing import CliRunner

from fitting.cli.main import main
from fitting.errors import InputError
from fitting.exporting.table import forces
from fitting.identified.differences import Difference, differences
from fitting.identified.identify import behaviour
from fitting.identified.record import FILE, Identified
from fitting.identified.shelf import named, own_folder, put, shelf
from fitting.least_squares.evaluate import evaluate
from fitting.least_squares.fit import fit
from fitting.model_files.model_file import read_model
from fitting.model_files.writer import write_model
from fitting.recordings.experiment import read_experiment
from fitting.report.text.identified import comparison_of_muscles, difference_text, muscle_report, shelf_report
from fitting.shipped import example_data
from mckibben_jax.effects import BladderNeoHookean, CoulombFriction, IdealCylinder
from mckibben_jax.laws.braid import ideal_force
from mckibben_jax.model import model
from mckibben_jax.muscle import Muscle

SHIPPED = {"dmsp10": "martens2017_dmsp10", "dmsp20": "martens2017_dmsp20", "rayon20": "tondu2012_rayon20",
           "rayon30": "tondu2012_rayon30"}  # fmt: skip


@pytest.fixture(autouse=True)
def own(tmp_path, monkeypatch):
    """A library of one's own that is empty."""
    monkeypatch.setenv("MCKIBBEN_LIBRARY", str(tmp_path / "library"))
    return tmp_path / "library"


def run(*words):
    return CliRunner().invoke(main, ["library", *map(str, words)])


# What ships ----------------------------------------------------------------------------------------------------------


def test_four_muscles_ship():
    assert [each.muscle.name for each in shelf()] == list(SHIPPED)
    assert all(each.is_shipped and each.muscle.source["citation"] for each in shelf())


@pytest.mark.parametrize(("name", "data"), SHIPPED.items())
def test_a_shipped_muscle_has_the_error_that_its_record_says(name, data):
    """Its model evaluated on the shipped raw data, of which its own are a copy."""
    each = named(name)
    for file in ("static.csv", "muscle.toml"):
        assert (each.folder / file).read_bytes() == (example_data(data) / file).read_bytes()
    experiment, stored = read_experiment(each.folder), read_model(each.folder / "model.toml")
    assert experiment.sha256 == each.muscle.sha256
    found = evaluate([experiment], stored.effects, stored.values, ())
    assert found.rmse == pytest.approx(each.muscle.rmse, rel=1e-3)
    assert np.max(np.abs(found.samples.measured)) == pytest.approx(each.muscle.full_scale)
    for parameter, known in each.muscle.parameters.items():
        assert known.value == pytest.approx(found.values[parameter], rel=1e-4, abs=1e-12)


# A user's own --------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def fitted(tmp_path_factory):
    """A data set with the model that was fitted to it beside it."""
    folder = small_muscle.write(tmp_path_factory.mktemp("own") / "mine", small_muscle.loops(points=25, repeats=2))
    experiment = read_experiment(folder)
    write_model(folder / "model.toml", fit([experiment], [IdealCylinder(), CoulombFriction()], starts=1), [experiment])
    return folder


@pytest.mark.slow
def test_a_muscle_is_added_shown_and_compared(fitted, own):
    """The whole way through the command line; the diagnosis compiles the whole library."""
    added = run("add", fitted)
    assert added.exit_code == 0, added.output
    assert "names no citation and no licence" in added.output
    assert {path.name for path in (own / "mine").iterdir()} == {"muscle.toml", "loops.csv", "model.toml", FILE}
    assert "mine" in run().output
    shown = run("show", "mine").output
    assert "nothing detectable" in shown
    assert "coulomb_friction.f_s" in shown
    compared = run("compare", "mine", "dmsp20", "--json", own / "told.json")
    assert "Only dmsp20 has Rubber wall, neo-Hookean (bladder_neo_hookean)" in " ".join(compared.output.split())
    assert "dmsp20" in json.loads((own / "told.json").read_text())["against"]


def record_of(fitted):
    """A record that costs no diagnosis."""
    each, experiment = named("rayon20").muscle, read_experiment(fitted)
    return dataclasses.replace(each, name="mine", sha256=experiment.sha256), experiment


def test_the_folder_is_a_data_set_whose_model_is_found_beside_it(fitted, own):
    record, experiment = record_of(fitted)
    folder = put(record, experiment, fitted / "model.toml", own)
    again = read_experiment(folder)
    assert again.sha256 == experiment.sha256
    assert read_model(folder / "model.toml").fitted_to([again])
    assert Identified.read(folder) == record
    assert named("mine").folder == folder
    assert named(str(folder)).muscle == record


def test_a_muscle_that_is_there_is_left_alone(fitted, own):
    record, experiment = record_of(fitted)
    put(record, experiment, fitted / "model.toml", own)
    with pytest.raises(InputError, match="left alone"):
        put(record, experiment, fitted / "model.toml", own)


def test_a_recording_outside_of_its_folder_cannot_be_sent(fitted, own, tmp_path):
    record, experiment = record_of(fitted)
    outside = tuple(dataclasses.replace(each, file="../loops.csv") for each in experiment.recordings)
    with pytest.raises(InputError, match="outside"):
        put(record, dataclasses.replace(experiment, recordings=outside), fitted / "model.toml", own)
    assert not own.exists()


def test_what_cannot_be_added_is_refused_with_a_cure(fitted, tmp_path):
    bare, changed = tmp_path / "bare", tmp_path / "changed"
    shutil.copytree(fitted, bare)
    (bare / "model.toml").unlink()
    shutil.copytree(fitted, changed)
    small_muscle.write(changed, small_muscle.loops(points=25, repeats=2, seed=1))
    for words, problem in (
        (("add", bare), "no model of the muscle"), (("add", changed), "not fitted to these data"),
        (("show", "dmsp11"), "did you mean 'dmsp10'"), (("remove", "dmsp10"), "unknown action"),
        (("compare",), "needs a name"), (("add", bare, changed), "one muscle is added at a time"),
    ):  # fmt: skip
        told = run(*words)
        assert told.exit_code == 2
        assert problem in told.output


BROKEN = ["", "[]", "{}", '{"format": 2}', '{"format": 1, "name": 3}']


@pytest.mark.parametrize("text", BROKEN)
def test_a_file_that_is_no_record_is_passed_by_and_said(text, own):
    (own / "broken").mkdir(parents=True)
    (own / "broken" / FILE).write_text(text)
    told = run()
    assert told.exit_code == 0
    assert "broken" in told.output
    assert "dmsp20" in told.output
    with pytest.raises(InputError, match="reads no identified muscle"):
        named(str(own / "broken"))


@pytest.mark.parametrize("change", [{"parameters": {}}, {"rmse": None}, {"verdict": 3}, {"behaviour": {}}])
def test_a_record_that_lacks_something_is_refused(change, own, fitted):
    told = named("dmsp20").muscle.as_dict() | change
    (own / "odd").mkdir(parents=True)
    (own / "odd" / FILE).write_text(json.dumps(told))
    with pytest.raises(InputError, match="reads no identified muscle"):
        Identified.read(own / "odd")


@pytest.mark.parametrize("name", ["../escaped", "/tmp/abs", "a/b", ".", "..", "", ".hidden", "dmsp20"])
def test_a_name_that_leads_elsewhere_or_is_taken_is_refused(name, fitted, own):
    record, experiment = record_of(fitted)
    with pytest.raises(InputError, match="name"):
        put(dataclasses.replace(record, name=name), experiment, fitted / "model.toml", own)
    assert not own.exists()


def test_two_of_one_name_are_told_apart_by_their_folders(own):
    muscle = named("dmsp10").muscle
    for folder in ("one", "other"):
        (own / folder).mkdir(parents=True)
        muscle.write(own / folder)
    with pytest.raises(InputError, match="several identified muscles"):
        named("dmsp10")
    assert named(str(own / "one")).muscle.name == "dmsp10"


def test_where_ones_own_are_kept(monkeypatch, tmp_path):
    monkeypatch.delenv("MCKIBBEN_LIBRARY")
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    assert own_folder() == tmp_path / "mckibben" / "library"


# Numbers -------------------------------------------------------------------------------------------------------------


def test_what_a_muscle_does_is_that_of_the_laws():
    """The ideal cylinder in closed form; its loop is as wide as the forces of both branches are apart."""
    muscle = Muscle(length=0.3, radius=0.007, braid_angle=np.radians(20.0))
    whole = model(muscle, IdealCylinder(), CoulombFriction(f_s=0.01))
    does = behaviour(whole, [np.array([1e5, 2e5])], friction_is_seen=True)
    assert does.pressure == 2e5
    assert does.pull_at_rest == pytest.approx(float(ideal_force(0.0, 2e5, 0.007, np.radians(20.0))))
    assert does.stroke == pytest.approx(1 - np.sqrt(1 / 3) / np.cos(np.radians(20.0)), abs=1.1e-3)
    half = np.full(2, does.stroke / 2)
    there, back = forces(whole, half, np.full(2, 2e5), np.array([1.0, -1.0]))
    assert does.loop_width == pytest.approx(back - there)
    assert does.rubber == 0.0
    assert behaviour(whole, [np.array([9e5])], friction_is_seen=False).loop_width is None


def test_the_rubber_opposes():
    muscle = Muscle(length=0.3, radius=0.007, braid_angle=np.radians(20.0), wall_thickness=5e-4)
    whole, without = (model(muscle, IdealCylinder(), *more) for more in ((BladderNeoHookean(G=4e5),), ()))
    does = behaviour(whole, [np.array([3e5])], friction_is_seen=False)
    place, pressure, still = (np.array([value]) for value in (does.stroke / 2, 3e5, 0.0))
    lost = forces(without, place, pressure, still) - forces(whole, place, pressure, still)
    assert does.rubber == pytest.approx(lost[0])


def test_a_ratio_is_as_sure_as_both_numbers():
    """Against draws of both."""
    each = Difference("bladder_neo_hookean.G", "Pa", 6e5, 3e5, 2e4, 1e4)
    random = np.random.default_rng(0)
    ratios = random.normal(6e5, 2e4, 100_000) / random.normal(3e5, 1e4, 100_000)
    assert each.range == pytest.approx(np.quantile(ratios, [0.0228, 0.9772]), rel=0.01)
    assert each.is_large
    assert difference_text(each, "dmsp10") == "⟦bladder_neo_hookean.G⟧ is 2 times that of dmsp10 (1.8 to 2.2)."
    assert not dataclasses.replace(each, my_error=4e5).is_large
    assert dataclasses.replace(each, theirs=0.0).ratio is None
    opposite = dataclasses.replace(each, theirs=-3e5)
    assert opposite.is_large
    assert "that of dmsp10 is -300 kPa" in difference_text(opposite, "dmsp10")


def test_what_was_held_is_no_difference():
    """Nobody measured the friction of the maps."""
    names = {each.name for each in differences(named("dmsp10").muscle, named("dmsp20").muscle)}
    assert "bladder_neo_hookean.G" in names
    assert not names & {"coulomb_friction.f_s", "behaviour.loop_width", "muscle.moving_mass"}


def test_every_muscle_is_shown_whole_at_eighty_columns(monkeypatch, capsys):
    from fitting.report.text.layout import console

    monkeypatch.setenv("COLUMNS", "80")
    one, *others = shelf()
    for part in [*shelf_report(shelf(), "here"), *muscle_report(one),
                 *comparison_of_muscles(one.muscle, [each.muscle for each in others])]:  # fmt: skip
        console().print(part)
    said = capsys.readouterr().out
    assert all(name in said for name in SHIPPED)
    assert max(map(len, said.splitlines())) <= 80
    for other in others:  # the last column is not cut off
        for each in differences(one.muscle, other.muscle):
            assert each.ratio is None or re.search(rf"{each.ratio:.2g}( \(.* to .*\))? *$", said, re.M)
    assert "ratio (95 %)" in said
    assert "-0 N" not in said
