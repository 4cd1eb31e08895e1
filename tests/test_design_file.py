"""Design files: what they ask for, and what is said where they are wrong."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from design_texts import BRAID, BREAKING, BURST, FORCE, KNOWN, MINIMUM, RUBBER, stroke
from designing import ALONE

from fitting.cli.main import main
from fitting.designs.answer import model_text
from fitting.designs.file import read_design
from fitting.designs.order import read_order
from fitting.errors import InputError
from fitting.library.library import library
from fitting.model_files.model_file import read_model
from fitting.report.text.design import describe
from mckibben_jax.design.best import Limit, design, to_json
from mckibben_jax.design.merit import built
from mckibben_jax.design.pareto import Second
from mckibben_jax.effects import BladderNeoHookean, IdealCylinder

VARIED = BRAID + 'wall_thickness = ["0.3 mm", "3 mm"]\n'
FILE = KNOWN + BREAKING + RUBBER + VARIED + FORCE + stroke("20 %") + MINIMUM + BURST


def written(path, text=FILE):
    (path / "design.toml").write_text(text)
    return path / "design.toml"


def test_a_file_becomes_a_design(tmp_path):
    task = read_design(written(tmp_path))
    assert task.variables["braid_angle"] == pytest.approx((np.radians(12), np.radians(40)))
    assert task.at == {"contraction": 0.1, "pressure": 5e5}
    assert task.constraints[0] == Limit("stroke", {"pressure": 5e5}, min=0.2)
    found = design(task)
    made = to_json(found)
    assert made["outcome"] == "optimal"
    assert {"length_m", "radius_m", "braid_angle_rad", "wall_thickness_m", "shear_modulus_Pa"} <= set(made["muscle"])
    assert {"quantity", "value", "min", "max", "active", "multiplier"} <= set(made["constraints"][0])
    assert made["constraints"][1]["value"] == pytest.approx(1e5, rel=1e-5)
    assert "at its limit" in describe(found)


def test_the_rubber_of_the_muscle_is_that_of_its_wall(tmp_path):
    soft = read_design(written(tmp_path, FILE.replace("0.54 MPa", "0.3 MPa")))
    assert float(built(soft.muscle, soft.effects)["bladder_neo_hookean"].G) == pytest.approx(0.3e6)


def test_a_fitted_model_can_be_designed_with(tmp_path):
    (tmp_path / "model.toml").write_text(
        'format = 1\n[muscle]\nlength = "250 mm"\nradius = "7 mm"\nbraid_angle = "20 deg"\nwall_thickness = "0.5 mm"\n'
        '[[effect]]\nname = "ideal_cylinder"\n[[effect]]\nname = "tip"\nk = "1.2"\n'
        '[[effect]]\nname = "bladder_neo_hookean"\nG = "0.4 MPa"\n'
    )
    text = '[model]\nfile = "model.toml"\n[variables]\nbraid_angle = ["15 deg", "40 deg"]\n'
    text += '[objective]\nmaximise = "work"\nat = { pressure = "3 bar" }\n'
    text += '[[constraint]]\nquantity = "stroke"\nat = { pressure = "3 bar" }\nmin = 0.2\n'
    text += '[[constraint]]\nquantity = "minimum_pressure"\nmax = "0.4 bar"\n'
    task = read_design(written(tmp_path, text))
    assert float(task.muscle.length) == 0.25
    assert float(built(task.muscle, task.effects)["tip"].k) == 1.2
    assert float(built(task.muscle, task.effects)["bladder_neo_hookean"].G) == 0.4e6
    assert design(task).outcome == "optimal"


def test_a_design_is_a_model_to_go_on_with(tmp_path):
    task = read_design(written(tmp_path))
    muscle = task.muscle
    found = dataclasses.replace(design(ALONE), muscle=muscle)
    (tmp_path / "model.toml").write_text(model_text(task, found))
    stored = read_model(tmp_path / "model.toml", library())
    assert float(stored.muscle.radius) == pytest.approx(float(muscle.radius))
    assert {type(e) for e in stored.effects} == {IdealCylinder, BladderNeoHookean}


def test_a_design_replaces_what_the_program_wrote_and_nothing_else(tmp_path):
    spec = str(written(tmp_path))
    mine, made = tmp_path / "mine.toml", tmp_path / "made.toml"
    mine.write_text('name = "mine"\n')
    for place, status in ((made, 0), (made, 0), (mine, 2), (Path(spec), 2)):
        assert CliRunner().invoke(main, ["design", spec, "--save", str(place)]).exit_code == status
    assert mine.read_text() == 'name = "mine"\n'


def test_a_file_may_ask_for_more(tmp_path):
    text = FILE + '[tolerance]\nradius = "0.1 mm"\n[uncertainty]\nchance = "95 %"\n[pareto]\nsecond = "stroke"\n'
    order = read_order(written(tmp_path, text + 'at = { pressure = "5 bar" }\npoints = 4\n'))
    assert order.tolerances == {"radius": pytest.approx(1e-4)}
    assert order.chance == pytest.approx(0.95)
    assert order.second == Second("stroke", {"pressure": 5e5}, True, 4)


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ('[tolerance]\nradios = "0.1 mm"', "did you mean 'radius'"),
        ('[tolerance]\nradius = "0.1 bar"', "cannot be the unit"),
        ("[uncertainty]\nchance = 2", "between 50 % and 100 %"),
        ('[pareto]\nsecond = "strike"', "did you mean 'stroke'"),
        ('[pareto]\nsecond = "stroke"', "at which pressure"),
        ("starts = 0", "whole number"),
    ],
)
def test_wrong_wishes_are_refused(tmp_path, more, message):
    text = f"{more}\n{FILE}" if more.startswith("starts") else f"{FILE}{more}\n"
    with pytest.raises(InputError) as error:
        read_order(written(tmp_path, text))
    assert message in str(error.value)


REFUSED = {
    "unknown quantity": ('"stroke"', '"strike"', "did you mean 'stroke'"),
    "unknown variable": ("radius =", "radios =", "did you mean 'radius'"),
    "unit": ('"4 mm"', '"4 bar"', "cannot be the unit of a length"),
    "no unit": ('"4 mm"', "4", "no unit"),
    "range": ('["4 mm", "12 mm"]', '["12 mm", "4 mm"]', "does not rise"),
    "pair": ('["4 mm", "12 mm"]', '"12 mm"', "not a pair"),
    "no pressure": ('at = { pressure = "5 bar" }', "", "at which pressure"),
    "no limit": ('min = "20 %"', "", "has no limit"),
    "needs": ('breaking_stress = "28 MPa"\n', "", "burst_pressure needs breaking_stress"),
    "effect": ('"bladder_neo_hookean"', '"bladder_neohookean"', "did you mean 'bladder_neo_hookean'"),
    "goal": ('maximise = "force"', "", "not one goal"),
    "key": ("[variables]", "[variable]", "did you mean 'variables'"),
    "condition": ('max = "1 bar"', 'max = "1 bar"\nat = { pressure = "1 bar" }', "not at pressure"),
    "pushed": ("contraction = 0.1", "contraction = 0.9", "outside -0.2 .. 0.6"),
    "void": ('pressure = "5 bar"', 'pressure = "-5 bar"', "below vacuum"),
    "not there": ('length = "300 mm"\n', "", "lacks length"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_a_wrong_file_is_refused_with_a_cure(tmp_path, case):
    old, new, message = REFUSED[case]
    assert old in FILE
    with pytest.raises(InputError) as error:
        read_design(written(tmp_path, FILE.replace(old, new)))
    assert message in str(error.value)
    assert "Cure:" in str(error.value)
    assert "design.toml" in str(error.value)
