"""Muscles cut from one hose: they share its sizes, and one may be predicted from the others."""

import json
import re

import numpy as np
import pytest
from click.testing import CliRunner
from small_muscle import ANGLE, RADIUS, ideal

from fitting.cli.main import main
from fitting.comparison.compare import compare
from fitting.errors import InputError
from fitting.least_squares.evaluate import evaluate
from fitting.least_squares.fit import fit
from fitting.least_squares.left_out_sets import each_left_out
from fitting.model_files.model_file import read_model
from fitting.problem.unknowns import unknowns
from fitting.recordings.experiment import read_experiment
from fitting.recordings.hoses import with_hose_sizes
from fitting.report.text.comparison import judgement
from fitting.report.text.stated_sizes import denied_texts
from fitting.report.text.study import hose_texts
from mckibben_jax.effects import ConstantFriction, IdealCylinder, LinearSpring

MODEL = [IdealCylinder(), LinearSpring(), ConstantFriction()]
SPRING, FRICTION, NOISE = 300.0, 4.0, 0.3  # N/m, N, N
DESCRIBED = """name = "{name}"
{hose}
[muscle]
length = "{length} +/- 1 mm"
radius = "{radius}"
braid_angle = "23.5 +/- 1 deg"
{more}
[[recording]]
file = "loops.csv"
test = "loop"
noise = "0.3 N"
"""


def measured(folder, name, length=250, dead=0.0, radius="8.2 +/- 0.3 mm", hose='hose = "H"', more="", seed=0):
    """The folder of one muscle (mm): loops by closed forms at three pressures; `dead` of it does not contract."""
    there = np.linspace(0, 0.17, 40)
    course = np.concatenate([there, there[-2::-1]] * 2)
    sign, scatter, rows = np.sign(np.gradient(course)), np.random.default_rng(seed), []
    for run, pressure in enumerate((1e5, 2e5, 4e5)):
        active = course * length / (length - dead)
        force = (
            ideal(active, pressure)
            - 1e-3 * SPRING * course * length
            - FRICTION * sign
            + scatter.normal(0, NOISE, len(course))
        )
        rows += [
            f"{run},{0.1 * k:.1f},{pressure / 1e3},{x * length:.5f},{f:.4f}"
            for k, (x, f) in enumerate(zip(course, force, strict=True))
        ]
    folder = folder / name
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "loops.csv").write_text(
        "\n".join(["run,time [s],pressure [kPa],displacement [mm],force [N]", *rows]) + "\n"
    )
    (folder / "muscle.toml").write_text(DESCRIBED.format(name=name, length=length, radius=radius, hose=hose, more=more))
    return folder


def read(place, **muscles):
    """Data sets by name, each of these arguments of `measured`."""
    return [read_experiment(measured(place, name, **more)) for name, more in muscles.items()]


def run(*words):
    return CliRunner().invoke(main, [*map(str, words)], catch_exceptions=False)


@pytest.fixture(scope="module")
def three(tmp_path_factory):
    """Three muscles of one hose, 150, 250 and 350 mm long."""
    place = tmp_path_factory.mktemp("hose")
    return [measured(place, name, length, seed=length) for name, length in (("a", 150), ("b", 250), ("c", 350))]


def test_muscles_of_a_hose_share_all_sizes_but_their_lengths(three):
    names = unknowns([read_experiment(folder) for folder in three], MODEL).names
    assert {"muscle.length@a", "muscle.length@b", "muscle.length@c", "muscle.radius", "muscle.braid_angle"} <= {*names}
    assert not [name for name in names if name.startswith(("muscle.radius@", "muscle.braid_angle@"))]
    own = unknowns([read_experiment(folder) for folder in three], MODEL, own=("muscle.radius",)).names
    assert "muscle.radius@b" in own
    assert "muscle.radius" not in own


def test_of_two_hoses_each_has_sizes_of_its_own(tmp_path):
    layout = unknowns(read(tmp_path, a={}, b={}, c={"hose": ""}), MODEL)
    assert {"muscle.radius@H", "muscle.radius@c", "muscle.length@c"} <= {*layout.names}
    assert layout.names_of(1)["muscle.radius"] == layout.names_of(0)["muscle.radius"] == "muscle.radius@H"
    assert layout.datasets == ("a", "b", "c")


def test_a_single_muscle_of_a_hose_has_plain_names(tmp_path):
    assert "muscle.radius" in unknowns(read(tmp_path, a={}), MODEL).names


@pytest.mark.parametrize(
    ("one", "other", "mean", "error"),
    [
        ("8.2 +/- 0.3 mm", "8.2 +/- 0.3 mm", 8.2, 0.3),  # one statement, copied
        ("8.0 +/- 0.1 mm", "8.3 +/- 0.2 mm", (8.0 / 0.01 + 8.3 / 0.04) / 125, 1 / np.sqrt(125)),
    ],
)
def test_measurements_of_one_size_are_averaged(tmp_path, one, other, mean, error):
    for each in with_hose_sizes(read(tmp_path, a={"radius": one}, b={"radius": other})):
        assert each.priors["muscle.radius"] == pytest.approx((mean * 1e-3, error * 1e-3))
        assert float(each.muscle.radius) == pytest.approx(mean * 1e-3)
        assert each.priors["muscle.length"] == (0.25, 1e-3)


def test_what_one_muscle_states_holds_for_all_of_the_hose(tmp_path):
    walls = {"more": 'wall_thickness = "1.5 +/- 0.1 mm"\nwall_outside = "0.4 mm"\nmoving_mass = "2 kg"'}
    _, other, stranger = with_hose_sizes(read(tmp_path, a=walls, b={}, c={"hose": 'hose = "K"'}))
    assert float(other.muscle.wall_thickness) == 1.5e-3
    assert other.priors["muscle.wall_thickness"] == pytest.approx((1.5e-3, 1e-4))
    assert float(other.muscle.wall_outside) == 0.4e-3
    assert float(other.muscle.moving_mass) == 0.0  # of its own fittings
    assert stranger.muscle.wall_thickness is None


@pytest.mark.parametrize(
    ("one", "other"),
    [("8.0 +/- 0.1 mm", "9.5 +/- 0.1 mm"), ("8.0 mm", "8.1 mm"), ("8.0 mm", "9.0 +/- 0.1 mm")],
)
def test_a_hose_with_two_radii_is_refused(tmp_path, one, other):
    with pytest.raises(InputError, match="of the hose 'H' state radius too differently") as refused:
        with_hose_sizes(read(tmp_path, a={"radius": one}, b={"radius": other}))
    assert "muscle.toml" in str(refused.value)
    assert all(part in str(refused.value) for part in ("a: 8", "b: "))


def test_a_name_for_two_things_is_refused(tmp_path):
    with pytest.raises(InputError, match="the name of a hose that it is not cut from"):
        with_hose_sizes(read(tmp_path, a={}, b={}, H={"hose": ""}))


@pytest.mark.parametrize("hose", ["hose = 5", 'hose = "a@b"'])
def test_a_hose_that_is_no_name_is_refused(tmp_path, hose):
    with pytest.raises(InputError, match="hose is no name"):
        read(tmp_path, a={"hose": hose})


def test_a_model_of_two_muscles_predicts_the_third_from_their_hose(three, tmp_path):
    model, result = tmp_path / "two.toml", tmp_path / "r.json"
    effects = ("ideal_cylinder", "linear_spring", "constant_friction")
    assert run("fit", *three[:2], "--effects", *effects, "--save", model).exit_code == 0
    assert read_model(model).hoses == {"a": "H", "b": "H"}
    said = " ".join(run("compare", three[2], "--model", model, "--json", result).output.split())
    predicted = json.loads(result.read_text())["predicted"]
    assert predicted["then_fitted"] == ["muscle.length"]
    assert predicted["rmse"] < 1.0  # 14 N with the radius that was stated
    assert "its sizes of the hose H are used" in said
    assert "those of the hose among them" in said
    again = run("compare", *three[:2], "--model", model)
    assert "FITTED" not in again.output  # every value of the very data is in the file


def test_the_model_file_of_two_hoses_is_taken_up_whole(three, tmp_path):
    stranger = measured(tmp_path, "d", 200, hose="", seed=9)
    model, effects = tmp_path / "m.toml", ("ideal_cylinder", "linear_spring", "constant_friction")
    data = (stranger, *three[:2])
    assert run("fit", *data, "--effects", *effects, "--save", model).exit_code == 0
    assert "FITTED" not in run("compare", *data, "--model", model, "--json", tmp_path / "r.json").output
    assert json.loads((tmp_path / "r.json").read_text())["rmse_N"] < 1.1 * NOISE


def test_each_muscle_left_out_is_predicted_by_the_others(three, tmp_path):
    experiments, stranger = [read_experiment(folder) for folder in three], measured(tmp_path, "wide", 250, seed=5)
    found = {each.dataset: each for each in each_left_out(fit(experiments, MODEL, starts=2))}
    assert [*found] == ["a", "b", "c"]
    for name, each in found.items():
        assert each.then_fitted == (f"muscle.length@{name}",)
        assert each.fitted_first == ()
        assert each.then == pytest.approx(NOISE, rel=0.15)
        assert each.then <= each.predicted
        assert each.beyond <= each.then
    # the same the long way: a model of the others is saved, and then compared with the muscle
    alone = fit(experiments[1:], MODEL, starts=2)
    values = {name.removesuffix("@a"): value for name, value in alone.values.items() if "@" not in name}
    assert found["a"].predicted == pytest.approx(evaluate(experiments[:1], MODEL, values, ()).rmse, rel=1e-3)
    rows = (stranger / "loops.csv").read_text().splitlines()
    wide = [",".join([*row.split(",")[:4], f"{1.1 * float(row.split(',')[4]):.4f}"]) for row in rows[1:]]
    (stranger / "loops.csv").write_text("\n".join([rows[0], *wide]) + "\n")  # a hose of 5 % more radius
    *_, other = each_left_out(fit([*experiments, read_experiment(stranger)], MODEL, starts=2))
    assert other.then > 20 * NOISE


def test_what_only_its_own_data_tell_is_fitted_before_anything_is_predicted(three):
    experiments = [read_experiment(folder) for folder in three[:2]]
    own = fit(experiments, MODEL, own=("constant_friction.F_c",), starts=2)
    for each in each_left_out(own):
        assert each.fitted_first == (f"constant_friction.F_c@{each.dataset}",)


def test_leaving_out_is_a_choice_of_fit(three, tmp_path):
    effects = ("--effects", "ideal_cylinder", "linear_spring", "constant_friction")
    page = tmp_path / "page.html"
    said = run(
        "fit", *three, *effects, "--no-save", "--leave-out", "--json", tmp_path / "r.json", "--html", page
    ).output
    assert "LEFT OUT  Each data set was predicted by a fit of the others" in said
    left_out = json.loads((tmp_path / "r.json").read_text())["left_out"]
    assert [each["dataset"] for each in left_out] == ["a", "b", "c"]
    assert all(each["unit"] == "N" and each["rmse_own_fitted"] < 1.2 * NOISE for each in left_out)
    part = page.read_text().split("<h2>Each data set left out</h2>")[1].split("</section>")[0]
    told = [re.findall(r"<td[^>]*>(.*?)</td>", row) for row in part.split("<tr")[2:]]
    assert [row[0] for row in told] == ["a", "b", "c"]
    assert all(" ".join(row[1:3]) in " ".join(said.split()) for row in told)  # predicted, in N and of full scale
    refused = run("fit", three[0], "--no-save", "--leave-out")
    assert refused.exit_code == 2
    assert "name two data sets or more" in refused.output
    both = run("fit", *three, "--each", "--leave-out")
    assert both.exit_code == 2
    assert "take --leave-out without --each" in both.output


def test_lengths_that_are_all_too_long_are_told_with_their_cure(tmp_path):
    short = read(tmp_path, a={"length": 150, "dead": 24.0, "seed": 1}, b={"length": 250, "dead": 24.0, "seed": 2})
    said = denied_texts(fit(short, MODEL, starts=2))
    assert any(text.startswith("Every muscle would be shorter than it was measured, by") for text in said)
    right = read(tmp_path / "right", a={"length": 150, "seed": 1}, b={"length": 250, "seed": 2})
    assert not any("Every muscle" in text for text in denied_texts(fit(right, MODEL, starts=2)))


def test_a_study_says_who_shares_sizes_and_who_might(tmp_path):
    assert hose_texts(read(tmp_path, a={}, b={}, c={})) == [
        "a, b and c are cut from H and share all sizes but length and moving mass."
    ]
    bare = {"hose": ""}
    said = hose_texts(read(tmp_path / "bare", a=bare, b=bare, c={"hose": "", "radius": "8.0 +/- 0.3 mm"}))
    assert len(said) == 1
    assert said[0].startswith("a and b state the same radius and braid angle. If they are cut from one hose")
    assert hose_texts(read(tmp_path / "one", a=bare)) == []


def test_the_simulated_hose_is_found(three):
    found = fit([read_experiment(folder) for folder in three], MODEL, starts=2)
    for name, truth in (("muscle.radius", RADIUS), ("muscle.braid_angle", ANGLE), ("linear_spring.K", SPRING)):
        estimate = found.estimate(name)
        assert abs(estimate.value - truth) < 3 * estimate.error


def test_a_small_error_is_no_praise_for_another_muscle(tmp_path):
    short = read(tmp_path, a={"length": 150, "dead": 24.0, "seed": 1}, b={"length": 250, "dead": 24.0, "seed": 2})
    assert "But its muscle is not the one that was measured: ⟦muscle.length@a⟧ lies 1" in judged(short)
    right = read(tmp_path / "right", a={"length": 150, "seed": 1}, b={"length": 250, "seed": 2})
    assert judged(right).endswith("N.")
    assert "But" not in judged(right)


def judged(experiments):
    return judgement(compare(fit(experiments, MODEL, starts=2), experiments))


def test_one_statement_in_two_units_is_one(tmp_path):
    folders = [measured(tmp_path, name, 200, seed=k) for k, name in enumerate("ab")]
    text = (folders[1] / "muscle.toml").read_text()
    for stated, as_metres in (("7.0 mm", "0.007 m"), ("6.95 +/- 0.3 mm", "0.695 +/- 0.03 cm")):
        for folder, said in zip(folders, (stated, as_metres), strict=True):
            lines = [f'radius = "{said}"' if line.startswith("radius") else line for line in text.splitlines()]
            (folder / "muscle.toml").write_text("\n".join(lines))
        a, b = with_hose_sizes([read_experiment(folder) for folder in folders])
        assert float(a.muscle.radius) == pytest.approx(float(b.muscle.radius), rel=1e-9)
        assert a.priors.get("muscle.radius", (0, 0))[1] == pytest.approx(3e-4 if "+/-" in stated else 0)


def test_a_size_that_is_stated_as_0_is_a_statement(tmp_path):
    folders = [measured(tmp_path, name, 200, seed=k) for k, name in enumerate("ab")]
    for folder in folders:
        path = folder / "muscle.toml"
        path.write_text(path.read_text().replace("[muscle]\n", '[muscle]\nwall_outside = "0 +/- 0.1 mm"\n', 1))
    for each in with_hose_sizes([read_experiment(folder) for folder in folders]):
        assert each.priors["muscle.wall_outside"] == (0.0, pytest.approx(1e-4))


def test_a_hose_without_a_name_is_refused(tmp_path):
    folder = measured(tmp_path, "a", 200)
    path = folder / "muscle.toml"
    path.write_text(re.sub(r'hose = "\w+"', 'hose = "?"', path.read_text()))
    with pytest.raises(InputError, match="hose is no name"):
        read_experiment(folder)


def test_a_friction_that_the_others_do_not_tell_is_not_known_from_the_muscle_left_out(tmp_path):
    """Points of rest say nothing of friction: loops were predicted with what they had told of it themselves."""
    loops = measured(tmp_path, "a", 200, seed=1)
    still = measured(tmp_path, "b", 200, seed=2)
    rows = [line.split(",") for line in (still / "loops.csv").read_text().splitlines()]
    keep = [k for k, head in enumerate(rows[0]) if not head.startswith(("time", "run"))]
    text = "\n".join(",".join(row[k] for k in keep) for row in [rows[0], *rows[1::40]])
    (still / "loops.csv").write_text(text + "\n")
    path = still / "muscle.toml"
    path.write_text(path.read_text().replace('test = "loop"', 'test = "static"'))
    experiments = [read_experiment(folder) for folder in (loops, still)]
    found = {each.dataset: each for each in each_left_out(fit(experiments, MODEL, starts=2))}
    assert "constant_friction.F_c" in found["a"].fitted_first
    assert "constant_friction.F_c" not in found["b"].fitted_first
