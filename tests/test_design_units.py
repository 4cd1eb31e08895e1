"""A design is answered in the units of its file."""

import json

import pytest
from click.testing import CliRunner

from fitting.cli.main import main
from fitting.designs.stated_units import stated_units
from fitting.showing import own_units

SPEC = """
starts = 1
[muscle]
length = "180 mm"
braid_angle = "20 deg"
wall_thickness = "1 mm"
shear_modulus = "0.4 MPa"
[model]
effects = ["ideal_cylinder"]
[variables]
radius = ["4 mm", "12 mm"]
[objective]
maximise = "force"
at = { contraction = 0.15, pressure = "4 bar" }
[[constraint]]
quantity = "force"
at = { contraction = 0.1, pressure = "2 bar" }
max = "50 kgf"
"""


@pytest.mark.parametrize(
    ("table", "own"),
    [
        ({"at": {"pressure": "4 bar"}, "muscle": {"shear_modulus": "0.4 MPa"}}, {"Pa": "bar"}),
        (
            {"a": ["1 psi", "2 psi"], "b": {"max": "3 lbf"}, "radius": "0.5 inch"},
            {"Pa": "psi", "N": "lbf", "m": "inch"},
        ),
        ({"a": "1 bar", "b": "2 psi"}, {}),  # they do not agree
        ({"a": "300 kPa", "b": "20 N", "c": "7 mm"}, {}),  # the usual ones
        ({"file": "model 3.toml", "effects": ["ideal_cylinder"], "seed": 3, "share": "1 %", "angle": "20 deg"}, {}),
    ],
)
def test_the_units_on_which_a_file_agrees(table, own):
    assert own_units(stated_units(table)) == own


def test_the_answer_speaks_them_and_numbers_for_machines_are_in_si(tmp_path):
    spec, result = tmp_path / "design.toml", tmp_path / "result.json"
    spec.write_text(SPEC, encoding="utf-8")
    done = CliRunner().invoke(main, ["design", str(spec), "--json", str(result)])
    assert done.exit_code == 0, done.output
    assert "force at contraction 0.15, pressure 4 bar: " in done.output
    assert "max 50 kgf" in done.output
    assert " N" not in done.output
    (limit,) = json.loads(result.read_text())["constraints"]
    assert limit["max"] == pytest.approx(50 * 9.80665)
