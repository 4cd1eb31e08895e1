"""Designs for several models at once: limits hold in each, the objective is their mean, and a limit has one price."""

import dataclasses
import json
import re

import numpy as np
import pytest
import scipy.optimize
from click.testing import CliRunner
from design_texts import BRAID, FORCE, KNOWN, stroke
from designing import BAR, IDEAL, MUSCLE, RANGES, quantity

from fitting.cli.main import main
from mckibben_jax.design.best import Limit, Task, design
from mckibben_jax.design.merit import built
from mckibben_jax.design.several import design_for_all
from mckibben_jax.effects import Tip
from mckibben_jax.laws import braid

AT = {"contraction": 0.1, "pressure": 5 * BAR}
ANGLE = {"braid_angle": RANGES["braid_angle"]}
MOST = Limit("stroke", {"pressure": 5 * BAR}, max=0.3)
TASK = Task(MUSCLE, ANGLE, "force", AT, (MOST,), IDEAL)
TIPS = [(*IDEAL, Tip(k=1.0)), (*IDEAL, Tip(k=1.3))]


def angle_of(contraction):
    """The braid angle from which a muscle contracts at most by this much, by the closed form of the ideal law."""
    return scipy.optimize.brentq(lambda a: float(braid.largest_contraction(a)) - contraction, 0.05, 0.9)


def test_the_limit_holds_in_the_model_that_is_hardest_on_it():
    """A tip factor divides the stroke, and force and stroke fall with the angle: that without a tip sets the angle."""
    found, (plain, tipped) = design_for_all(TASK, TIPS)
    assert found.outcome == "optimal"
    assert float(found.muscle.braid_angle) == pytest.approx(angle_of(0.3), rel=1e-5)
    assert plain.constrained == pytest.approx((0.3,), rel=1e-5)
    assert tipped.constrained == pytest.approx((0.3 / 1.3,), rel=1e-5)
    assert found.constraints[0].value == pytest.approx(0.3, rel=1e-5)
    forces = [quantity("force", built(found.muscle, effects), **AT) for effects in TIPS]
    assert (plain.value, tipped.value) == pytest.approx(forces, rel=1e-9)
    assert found.value == pytest.approx(np.mean(forces), rel=1e-9)


def test_one_model_named_twice_is_that_model():
    both, said = design_for_all(TASK, [IDEAL, IDEAL])
    one = design(TASK)
    assert both.value == pytest.approx(one.value, rel=1e-6)
    assert both.constraints[0].multiplier == pytest.approx(one.constraints[0].multiplier, rel=1e-4)
    assert said[0] == said[1]


def test_a_limit_costs_what_the_mean_loses_when_it_moves():
    found, _ = design_for_all(TASK, TIPS)
    step = 1e-4
    moved, _ = design_for_all(dataclasses.replace(TASK, constraints=(dataclasses.replace(MOST, max=0.3 + step),)), TIPS)
    assert found.constraints[0].active
    assert found.constraints[0].multiplier == pytest.approx((moved.value - found.value) / step, rel=2e-3)


def test_a_limit_that_one_model_cannot_keep_is_named_once():
    asked = dataclasses.replace(TASK, constraints=(dataclasses.replace(MOST, min=0.4, max=None),))
    found, _ = design_for_all(asked, TIPS)
    assert found.outcome == "infeasible"
    assert found.fighting.count("stroke") == 1
    assert found.constraints[0].value < 0.4 < 1.3 * found.constraints[0].value * 1.05


MODEL = '[[effect]]\nname = "ideal_cylinder"\n[[effect]]\nname = "tip"\nk = "{k}"\n'
SIZES = 'format = 1\n[muscle]\nlength = "300 mm"\nradius = "8 mm"\nbraid_angle = "20 deg"\nwall_thickness = "1 mm"\n'
SPEC = '[model]\nfile = "here.toml"\n' + KNOWN + BRAID + FORCE + stroke("30 %").replace("min", "max")


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name, k in (("here", 1.0), ("there", 1.3)):
        (tmp_path / f"{name}.toml").write_text(SIZES + MODEL.format(k=k), encoding="utf-8")
    (tmp_path / "spec.toml").write_text(SPEC, encoding="utf-8")
    return tmp_path


def typed(*words):
    return CliRunner().invoke(main, ["design", *words])


def test_what_each_model_says_stands_below_the_design(folder):
    done = typed("spec.toml", "--also", "there.toml", "--json", "told.json", "--html", "page.html")
    assert done.exit_code == 0, done.output
    page = (folder / "page.html").read_text(encoding="utf-8")
    assert "The muscle to scale" in page
    assert re.search(r"<text[^>]*>at rest: 300 mm long", page)
    assert "the limits hold in all models" in done.output
    rows = {line.split()[0]: line for line in done.output.splitlines() if line.startswith(("here.toml", "there.toml"))}
    assert rows["here.toml"].split()[-1] == "0.3"
    assert rows["there.toml"].split()[-1] == "0.2308"
    told = json.loads((folder / "told.json").read_text(encoding="utf-8"))
    assert [each["model"] for each in told["models"]] == ["here.toml", "there.toml"]
    assert told["models"][1]["constraints"][0]["value"] == pytest.approx(0.3 / 1.3, rel=1e-5)
    mean = np.mean([each["objective"] for each in told["models"]])
    assert told["objective"]["value"] == pytest.approx(mean, rel=1e-9)


def test_a_rubber_that_the_design_file_states_is_said_to_replace_that_of_a_model(folder):
    for name, effect in (("here", "bladder_neo_hookean"), ("there", "bladder_mooney_rivlin")):
        with (folder / f"{name}.toml").open("a", encoding="utf-8") as file:
            file.write(f'[[effect]]\nname = "{effect}"\n' + ('G = "320 kPa"\n' if name == "here" else ""))
    (folder / "spec.toml").write_text(
        SPEC.replace('length = "300 mm"\n', 'length = "300 mm"\nwall_thickness = "1 mm"\n')
    )
    done = typed("spec.toml", "--also", "there.toml")
    assert done.exit_code == 0, done.output
    notes = [line for line in done.output.splitlines() if line.startswith("note: ")]
    assert notes == [
        "note: here.toml: shear_modulus = 540 kPa of the muscle replaces bladder_neo_hookean.G = 320 kPa",
    ]


def test_a_model_of_other_data_is_told_of(folder):
    for name, sha in (("here", "a"), ("there", "b")):
        with (folder / f"{name}.toml").open("a", encoding="utf-8") as file:
            file.write(f'[fitted_to]\ndata = {{muscle = "sha256:{sha}"}}\n')
    done = typed("spec.toml", "--also", "there.toml")
    assert "note: there.toml was fitted to other data than here.toml" in done.output


@pytest.mark.parametrize(
    ("words", "more", "said"),
    [
        (["--also", "here.toml"], "", "a model is named twice"),
        (["--also", "nowhere.toml"], "", "nowhere.toml"),
        (["--also", "there.toml", "--also", "../{folder}/there.toml"], "", "a model is named twice"),
        (["--also", "there.toml"], '[tolerance]\nradius = "0.1 mm"\n', "without tolerances and trade-offs"),
        (["--also", "there.toml", "--posterior", "chains.nc"], "", "leave one of them out"),
        (["--also", "rubber.toml"], "", "needs wall_thickness"),
    ],
)
def test_what_cannot_be_done_for_several_models_is_refused(folder, words, more, said):
    (folder / "spec.toml").write_text(more + SPEC.replace('wall_thickness = "1 mm"\n', ""), encoding="utf-8")
    for name in ("here", "there"):
        plain = (folder / f"{name}.toml").read_text(encoding="utf-8").replace('wall_thickness = "1 mm"\n', "")
        (folder / f"{name}.toml").write_text(plain, encoding="utf-8")
    (folder / "rubber.toml").write_text(
        SIZES.replace('wall_thickness = "1 mm"\n', "")
        + MODEL.format(k=1.1)
        + '[[effect]]\nname = "bladder_neo_hookean"\n',
        encoding="utf-8",
    )
    done = typed("spec.toml", *(word.format(folder=folder.name) for word in words))
    assert done.exit_code == 2
    assert said in done.output
    assert "Traceback" not in done.output
