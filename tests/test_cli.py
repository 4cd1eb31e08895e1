"""The command line as a user meets it: help, what each command says, the keys it writes, and what comes after."""

import gc
import json
import os
import subprocess
import sys

import pytest
from typed import copied, refused, run

from fitting.cli.commands.compare import command
from fitting.cli.main import COMMANDS, MANY, main
from fitting.diagnosis.findings import GroupKind, RestsOn
from fitting.diagnosis.outcomes import Verdict
from fitting.diagnosis.record import Diagnosis, Evidence, Explanation
from fitting.problem.estimate import Estimate
from fitting.study import changing
from fitting.study.request import DATA, MODEL, Request, names_of
from fitting.study.task import fit_task


@pytest.fixture
def data(springy, tmp_path):
    """A copy of a data set that a test may write into."""
    return copied(springy, tmp_path / "small")


# ----------------------------------------------------------------------------------------------------------- starting


@pytest.mark.parametrize("args", [["--help"], ["compare", "--help"], ["add", "--help"]])
def test_help_is_there_before_anything_heavy_is_loaded(args):
    code = f"import sys; sys.argv = ['mckibben', *{args!r}]\nfrom fitting.cli.main import main\n"
    code += "try: main()\nexcept SystemExit: pass\n"
    code += "heavy = {'jax', 'numpy', 'equinox', 'matplotlib', 'rich', 'pandas', 'scipy'} & set(sys.modules)\n"
    code += "assert not heavy, heavy"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "Usage" in done.stdout


@pytest.mark.parametrize(("name", "set_by_the_user", "used"), [
    ("compare", None, "cpu"), ("compare", "cuda", "cuda"), ("sweep", None, None), ("sweep", "cpu", "cpu"),
])  # fmt: skip
def test_only_a_sweep_takes_a_gpu_unless_the_user_says_so(name, set_by_the_user, used, monkeypatch):
    monkeypatch.setenv("JAX_PLATFORMS", "")  # so that what the command sets is taken away again after the test
    monkeypatch.delenv("JAX_PLATFORMS")
    if set_by_the_user:
        monkeypatch.setenv("JAX_PLATFORMS", set_by_the_user)
    assert main.get_command(None, name) is not None  # type: ignore[arg-type]
    assert os.environ.get("JAX_PLATFORMS") == used


def test_a_command_collects_seldom_and_leaves_the_process_as_it_was(monkeypatch):
    """Importing JAX makes nothing but what stays; a program that calls the command keeps its own setting."""
    usual, during = gc.get_threshold(), []
    monkeypatch.setattr(main, "get_command", lambda *_: during.append(gc.get_threshold()[0]))
    run("effects", status=2)  # nothing is loaded: there is no such command now
    assert (during[-1], gc.get_threshold()) == (MANY, usual)


def test_every_command_that_is_there_has_help_and_the_common_options():
    for name in main.list_commands(None):  # type: ignore[arg-type]
        assert name in COMMANDS
        words = run(name, "--help").output
        if name == "workbench":  # serves pages until it is stopped; results are downloaded there
            continue
        for option in ("--json", "--html", "--seed", "--quiet"):
            assert option in words, name


def test_a_misspelt_command_gets_the_nearest():
    assert "Did you mean 'compare'?" in refused("compair")


def test_list_options_take_names_up_to_the_next_option_or_path(tmp_path):
    here = str(tmp_path)
    understood = command.make_context("compare", ["--effects", "a", "b", here, "--fix", "c.d", "e.f"]).params
    assert (understood["effects"], understood["data"]) == (("a", "b"), (here,))
    assert understood["fix"] == ("c.d", "e.f")
    understood = command.make_context("compare", [here, "x", "--seed", "3"]).params
    assert (understood["data"], understood["seed"]) == ((here, "x"), 3)


def test_what_is_typed_to_ask_again_asks_for_the_same(tmp_path):
    """Every option of a model and of its data, lists too: each ends where the next option begins."""
    asked = Request(
        data=(str(tmp_path),), model="m.toml", effects=("a", "b"), baseline=True, settings=("x=1", "y=2"),
        fix=("c.d",), free=("e.f", "g.h"), own=("i.j",), define=("drag = -B*v",), effect_file="mine.py",
        muscle="muscle.toml", test="loop",
    )  # fmt: skip
    names = names_of(MODEL, DATA)
    assert all(getattr(asked, name) != getattr(Request(), name) for name in names)
    assert Request.of(command.make_context("compare", list(asked.again)).params) == asked


# ----------------------------------------------------------------------------------------------------------- compare


def test_compare_names_the_model_first_and_writes_the_promised_keys(data, tmp_path):
    out, page = tmp_path / "c.json", tmp_path / "c.html"
    words = run("compare", data, "--json", out, "--html", page).stdout
    first = words.splitlines()[0]
    assert "ideal_cylinder + coulomb_friction" in first
    assert "baseline" in first
    assert "mckibben diagnose" in words
    found = json.loads(out.read_text())
    for key in ("verdict", "negligible", "leading", "explanations", "rmse_N", "noise_floor_N", "full_scale_N",
                "p_value", "by_recording", "fingerprint"):  # fmt: skip
        assert key in found
    assert found["by_recording"][0].items() >= {"file": "loops.csv", "unit": "N", "rmse": found["rmse_N"]}.items()
    assert set(found["fingerprint"]) == {
        "odd_share", "pressure_exponent_even", "pressure_exponent_odd", "speed_exponent_odd", "cycle_drift",
    }  # fmt: skip
    assert found["fingerprint"]["pressure_exponent_even"] == pytest.approx(0.0, abs=0.15)
    assert found["provenance"]["data"]["Small muscle"]["sha256"]
    assert page.read_text().startswith("<!doctype html>")


def test_quiet_prints_nothing(data):
    assert run("compare", data, "--quiet").output == ""


def test_a_single_file_works_with_its_muscle_and_test(data):
    words = run("compare", data / "loops.csv", "--muscle", data / "muscle.toml", "--test", "loop").stdout
    assert "RESULT" in words
    assert "--test" in refused("compare", data / "loops.csv")


def test_a_value_that_is_set_is_held(data, tmp_path):
    out = tmp_path / "c.json"
    settings = ("--set", "muscle.radius=8.05 mm", "--set", "coulomb_friction.f_s=0.02")
    run("compare", data, *settings, "--json", out, "--quiet")
    parameters = json.loads(out.read_text())["fit"]["parameters"]
    assert parameters["coulomb_friction.f_s"]["value"] == 0.02
    assert parameters["coulomb_friction.f_s"]["state"] == "fixed"
    assert "muscle.radius" not in parameters


# ----------------------------------------------------------------------------------------------------- fit, add, drop


def test_fit_saves_a_model_that_the_next_command_takes_up(data, tmp_path):
    out = tmp_path / "f.json"
    words = run("fit", data, "--json", out).stdout
    assert str(data / "model.toml") in words.replace("\n          ", "")
    found = json.loads(out.read_text())
    assert found["converged"] is True
    assert found["parameters"]["coulomb_friction.f_s"].keys() >= {
        "value", "robust_error", "iid_error", "at_bound", "held", "tied_with", "unit",
    }  # fmt: skip
    again = tmp_path / "c.json"
    first = run("compare", data, "--json", again).stdout.splitlines()
    assert "model.toml" in "".join(part.strip() for part in first[:4])  # a long path takes several lines
    assert json.loads(again.read_text())["rmse_N"] == pytest.approx(found["rmse_N"], rel=1e-6)


def test_an_edited_model_is_used_and_left_alone(data):
    run("fit", data, "--quiet", "--starts", 1)
    path = data / "model.toml"
    path.write_text(path.read_text().replace('name = "coulomb_friction"', 'name = "coulomb_friction"  # mine'))
    before = path.read_text()
    assert "left alone" in " ".join(run("fit", data, "--starts", 1).stdout.split())
    assert path.read_text() == before


def test_add_lets_the_error_fall_and_drop_lets_it_rise(data, tmp_path):
    out = tmp_path / "a.json"
    words = run("add", data, "linear_spring", "--json", out, "--starts", 2).stdout
    assert "+ Spring in parallel (linear_spring): error" in words
    assert f"NEXT      mckibben diagnose {data}\n" in words
    found = json.loads(out.read_text())
    assert found["rmse_N"] < 0.2 * found["before"]["rmse_N"]
    assert found["held_out_rmse_N"] < 0.2 * found["before"]["held_out_rmse_N"]
    assert found["parameters"]["linear_spring.K"]["value"] == pytest.approx(400 / 0.25, rel=0.05)
    assert "linear_spring" in (data / "model.toml").read_text()
    assert "It replaces a model" not in words  # which began with what was there
    assert "is in the model already" in refused("add", data, "linear_spring")
    words = run("drop", data, "linear_spring", "--json", out, "--starts", 2).stdout
    assert "It replaces a model" not in words
    assert json.loads(out.read_text())["rmse_N"] > 1.0


@pytest.mark.parametrize("change", [("add", "linear_spring"), ("drop", "coulomb_friction")])
def test_the_models_before_and_after_a_change_are_sought_by_shooting(data, monkeypatch, change):
    sought = []
    monkeypatch.setattr(changing, "fit_task", lambda task: sought.append(task.shooting) or fit_task(task))
    verb, effect = change
    run(verb, data, effect, "--shooting", 3, "--starts", 1, "--no-save")
    confined = {"add": 0, "drop": 2}[verb]  # without friction a size is denied, and both models are sought again
    assert sought == [3] * (2 + confined)


def test_it_is_said_which_model_another_replaces(data):
    """Where a command has begun with the baseline beside a model that knows more."""
    run("add", data, "linear_spring", "--starts", 1)
    words = " ".join(run("fit", data, "--baseline", "--starts", 1).stdout.split())
    assert "It replaces a model that was there: ideal_cylinder + linear_spring + coulomb_friction." in words
    assert "linear_spring" not in (data / "model.toml").read_text()


def test_a_rival_is_replaced_and_it_is_said(data):
    words = " ".join(run("add", data, "textile_friction", "--no-save", "--starts", 2).stdout.split())
    assert "in place of Coulomb friction of the strands (coulomb_friction)" in words
    assert not (data / "model.toml").exists()


# ---------------------------------------------------------------------------------------------------------- diagnose


def test_diagnose_writes_the_promised_keys(data, tmp_path, monkeypatch):
    def diagnose(experiments, effects, **options):
        from fitting.least_squares.fit import fit

        base = fit(experiments, effects, starts=1)
        best = Explanation(("linear_spring",), rmse=0.31, held_out_rmse=0.32, fall=9.0, p_value=0.4, adequate=True)
        evidence = Evidence(
            "linear_spring", 0.01, 0.31, 0.32, 0.2, 0.1, {"end_stop": 0.9}, {"K": Estimate(1600.0, 20.0, "N/m")}, True
        )
        return Diagnosis(
            Verdict.MISSING, False, (("linear_spring",),), (), (), None, 0.001, 0.01,
            RestsOn(6, (GroupKind.LOOP,)), 5.0, 5.5, 0.3, 900.0,
            {"linear_spring": evidence}, (best,), base, base.residual,
        )  # fmt: skip

    monkeypatch.setattr("fitting.study.diagnosing.diagnose", diagnose)
    out = tmp_path / "d.json"
    words = run("diagnose", data, "--json", out, "--html", tmp_path / "d.html").stdout
    assert "Spring in parallel (linear_spring) is missing." in words
    assert "WHERE     Worst at " in words
    assert f"mckibben add {data} linear_spring" in " ".join(words.split())
    found = json.loads(out.read_text())
    assert found.keys() >= {
        "verdict", "negligible", "leading", "explanations", "rmse_N", "noise_floor_N", "full_scale_N", "p_value",
        "by_recording", "effects", "fingerprint", "next_measurement",
    }  # fmt: skip
    assert found["effects"]["linear_spring"].keys() >= {
        "p_value", "rmse_N", "held_out_rmse_N", "detection_limit_N", "absorbed_share", "alike", "estimate",
    }  # fmt: skip


# --------------------------------------------------------------------------------------------- an effect of one's own


def test_an_effect_of_the_users_own_counts_like_any_other(data, tmp_path):
    file = tmp_path / "mine.py"
    file.write_text(
        "import jax\nfrom mckibben_jax.effect import Pulling\nfrom mckibben_jax.parameter import parameter\n\n\n"
        "class MySpring(Pulling):\n"
        '    """A spring of my own."""\n\n'
        '    k: jax.Array = parameter(100.0, "N", "pull at full contraction", range=(0.0, 1e4))\n\n'
        "    def force(self, muscle, state):\n        return -self.k * state.contraction\n"
    )
    words = run("add", data, "my_spring", "--effect-file", file, "--no-save", "--starts", 2).stdout
    assert "my_spring.k" in words
    assert "A spring of my own" in run("effects", "my_spring", "--effect-file", file).stdout
    file.write_text("import jax\nclass Broken(:\n")
    assert "row 2" in refused("effects", "--effect-file", file)


# --------------------------------------------------------------------------------------------------- looking things up


def test_effects_are_listed_and_explained(tmp_path):
    out = tmp_path / "e.json"
    words = run("effects", "--json", out).stdout
    for name in json.loads(out.read_text()):
        assert name in words
    assert "range" in run("effects", "tip").stdout
    assert "did you mean 'tip'" in refused("effects", "tipp")


def test_equations_are_listed_and_explained():
    assert "cylinder with conical ends" in run("equations").stdout
    assert "mckibben_jax.laws.braid.ideal_force" in run("equations", "10").stdout
    assert "no equation '225'" in refused("equations", "225")


def test_cite_names_the_review_the_effects_and_the_data(data):
    words = run("cite", data).stdout
    assert "Tondu" in words
    assert "coulomb_friction" in words
    assert "Small muscle" in words


def test_init_writes_a_file_to_fill_in(data):
    (data / "muscle.toml").unlink()
    run("init", data)
    assert "still to be filled in" in refused("compare", data)
    assert "left alone" in refused("init", data)


def test_the_demo_can_reveal_what_was_put_in(tmp_path):
    assert "bladder_neo_hookean" in run("demo", "--reveal").stdout
    assert "unknown shipped data set" in refused("demo", "muscle_z")


def test_a_simulated_data_set_is_one_that_the_model_describes(data, tmp_path):
    run("fit", data, "--quiet", "--starts", 1)
    model, there, out = data / "model.toml", tmp_path / "simulated", tmp_path / "s.json"
    run("simulate", model, "--pressure", "1,3 bar", "--turns", "0,0.2,0", "--noise", "0.2 N", "--out", there)
    run("compare", there, "--model", model, "--json", out, "--quiet")
    assert json.loads(out.read_text())["rmse_N"] == pytest.approx(0.2, rel=0.1)
    assert "left alone" in refused("simulate", model, "--out", there)


# ------------------------------------------------------------------------------------------------- what comes after


def test_a_reader_who_leaves_costs_no_model(data):
    """As `| head -1` does: the pipe breaks at the second line, and the model is saved all the same."""
    typed = [sys.executable, "-m", "fitting.cli", "fit", str(data), "--starts", "1", "--json", str(data / "r.json")]
    with subprocess.Popen(typed, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as running:
        running.stdout.readline()
        running.stdout.close()
        assert running.stderr.read() == b""
    assert running.returncode == 0
    assert (data / "model.toml").exists()
    assert "parameters" in json.loads((data / "r.json").read_text())


def test_the_next_command_names_the_same_data_and_model(data):
    """A single file needs its kind of test and its muscle again."""
    file = [data / "loops.csv", "--muscle", data / "muscle.toml", "--test", "loop"]
    said = run("compare", *file, "--effects", "ideal_cylinder", "coulomb_friction").stdout
    (after,) = (line.split(maxsplit=1)[1] for line in said.splitlines() if line.startswith("NEXT"))
    assert after.startswith("mckibben diagnose --effects ideal_cylinder coulomb_friction --muscle ")
    assert "--test loop" in after
    assert after.endswith("loops.csv")
