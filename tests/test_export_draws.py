"""Draws of the parameters in an exported muscle: each draw, in every form, is the library's own model with it."""

import ctypes
import functools
import json
import re
import shutil
import sys

import benches
import numpy as np
import pytest
from click.testing import CliRunner
from small_muscle import loops, write
from test_export_c import CALLS, COMPILER, built, numbers, numpy_muscle
from trajectory import trajectory

from fitting.cli.main import main
from fitting.errors import InputError
from fitting.exporting.draws import Draws, parameters_of, with_parameters
from fitting.exporting.export import export
from fitting.exporting.laws import Told
from fitting.exporting.python_module import python_module
from mckibben_jax.effects import BladderNeoHookean, Creep, IdealCylinder, TextileFriction, Tip
from mckibben_jax.model import model

WHOLE = model(benches.MUSCLE, IdealCylinder(), BladderNeoHookean(), Tip(), TextileFriction(), Creep())
NAMES = ("muscle.length", "muscle.radius", "bladder_neo_hookean.G", "tip.k", "textile_friction.f_s", "creep.tau")
SPREAD = np.random.default_rng(3).normal(1, 0.03, (4, len(NAMES)))
DRAWS = Draws(NAMES, ("m", "m", "Pa", "1", "1", "s"), np.array(parameters_of(WHOLE, NAMES)) * SPREAD, "a test")
TOLD = Told(draws=DRAWS)
compiler = pytest.mark.skipif(COMPILER is None, reason="this machine has no C compiler (cc, gcc, clang)")
every_draw = pytest.mark.parametrize("k", [None, 0, 3])


@functools.cache
def course():
    """An even time (s) in binary fractions, pressure and displacement."""
    _, pressure, displacement = trajectory(float(benches.MUSCLE.length))
    return np.arange(len(pressure)) * 2.0**-9, pressure, displacement


@functools.cache
def expected(k):
    """The force along the course of the library's model with this draw, its parameters written as numbers."""
    whole = WHOLE if k is None else with_parameters(WHOLE, NAMES, DRAWS.values[k])
    return stepped(numpy_muscle(python_module(whole, "t")))


def stepped(muscle):
    time, pressure, displacement = course()
    state, forces = muscle.start(pressure[0], displacement[0]), []
    for t, p, x in zip(np.diff(time), pressure[1:], displacement[1:], strict=True):
        state, force = muscle.step(state, p, x, t)
        forces.append(force)
    return np.array(forces)


def agrees(found, k):
    return np.abs(found - expected(k)).max() / np.abs(expected(k)).max()


# -------------------------------------------------------------------------------------------------------- every form


def test_the_force_of_the_model_with_a_draw_is_that_of_the_module_written_for_it():
    """The chain's first link: no trace, no export, the model itself where the muscle moves."""
    time, pressure, displacement = course()
    whole = with_parameters(WHOLE, NAMES, DRAWS.values[3])
    length = float(whole.muscle.length)
    rate = np.diff(displacement, prepend=0) / length / (time[1] - time[0])
    found = np.asarray(whole.force(benches.run(time, displacement / length, pressure, rate=rate)))[1:]
    moves = np.diff(displacement) != 0
    assert moves.mean() > 0.7
    assert np.abs(found - expected(3))[moves].max() / np.abs(found).max() < 1e-9
    assert np.abs(expected(3) - expected(None)).max() > 1  # N: the draws differ


@every_draw
def test_a_draw_in_numpy_is_the_model_with_its_parameters(k):
    muscle = numpy_muscle(python_module(WHOLE, "t", TOLD))
    muscle.use(1)  # another one before: nothing of it stays
    muscle.use(k)
    assert agrees(stepped(muscle), k) < 1e-9
    alone = numpy_muscle(python_module(WHOLE if k is None else with_parameters(WHOLE, NAMES, DRAWS.values[k]), "t"))
    assert alone.LENGTH == muscle.LENGTH
    for at in ((0.12, 2.2e5, 1.0), (0.05, 3e5, -1.0)):
        np.testing.assert_allclose(muscle.linearise(*at), alone.linearise(*at), rtol=1e-9, atol=1e-9)
        assert muscle.pressure_for(muscle.force(*at), *at[::2]) == pytest.approx(at[1], rel=1e-6)


@compiler
@every_draw
@pytest.mark.parametrize("precision", ["double", "float"])
def test_a_draw_in_c_is_the_model_with_its_parameters(k, precision, tmp_path):
    export(WHOLE, tmp_path / "arm.h", told=TOLD)
    define = "#define ARM_FLOAT\n" if precision == "float" else ""
    uses = "void choose(int draw) { arm_use(draw); }\nint draws(void) { return ARM_DRAWS; }\n"
    (tmp_path / "arm.c").write_text(f'{define}#include "arm.h"\n{uses}{CALLS.replace("NAME", "arm")}')
    library, found = built(tmp_path / "arm.c"), np.zeros((3, len(course()[0])))
    library.choose(1)
    library.choose(-1 if k is None else k)
    arrays = [numbers(np.ascontiguousarray(a)) for a in course()]
    library.run_arm(ctypes.c_int(found.shape[1]), *arrays, *(numbers(row) for row in found))
    assert agrees(found[0][1:], k) < {"double": 1e-9, "float": 2e-5}[precision]
    assert library.draws() == len(DRAWS.values)


@compiler
@pytest.mark.skipif(shutil.which("g++") is None, reason="this machine has no C++ compiler (g++)")
def test_two_muscles_with_draws_fit_into_one_program_of_cpp(tmp_path):
    import subprocess

    for name in ("left", "right"):
        export(WHOLE, tmp_path / f"{name}.h", told=TOLD)
    text = '#include "left.h"\n#include "right.h"\nvoid f() { left_use(0); right_use(1); }\n'
    (tmp_path / "both.cpp").write_text(text)
    command = ["g++", "-Wall", "-Wextra", "-Werror", "-Wno-unused-but-set-variable", "-fsyntax-only"]
    done = subprocess.run([*command, str(tmp_path / "both.cpp")], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[:2000]


@every_draw
def test_a_draw_in_mujoco_is_the_model_with_its_parameters(k, tmp_path, monkeypatch):
    mujoco = pytest.importorskip("mujoco", reason="MuJoCo is not installed: pip install 'mckibben-jax[mujoco]'")
    export(WHOLE, tmp_path / "mj", told=TOLD)
    monkeypatch.syspath_prepend(tmp_path / "mj")
    for name in ("muscle", "muscle_mujoco"):
        monkeypatch.delitem(sys.modules, name, raising=False)
    import muscle_mujoco

    try:
        scene, (time, pressure, displacement) = muscle_mujoco.load(str(tmp_path / "mj" / "lift.xml")), course()
        scene.opt.timestep = time[1]
        scene.actuator_user[0, 1] = -1 if k is None else k
        # the tendon hangs from a place that was made for the fitted length
        longer = DRAWS.values[k][0] - float(WHOLE.muscle.length) if k is not None else 0.0
        scene.actuator_user[0, 0] = longer
        data, forces = mujoco.MjData(scene), []
        muscle_mujoco.choose(scene, 0)
        state = muscle_mujoco.muscle.start(pressure[0], displacement[0])
        data.act[:] = np.concatenate([np.ravel(part) for part in state])
        for p, x in zip(pressure[1:], displacement[1:], strict=True):
            data.qpos[0], data.qvel[0], data.ctrl[0] = x, 0.0, p
            muscle_mujoco.muscle.use(1)  # whatever another muscle has chosen
            mujoco.mj_step(scene, data)
            forces.append(-data.actuator_force[0] - data.act[5] * scene.tendon_frictionloss[0])
        assert agrees(np.array(forces), k) < 1e-9
    finally:
        muscle_mujoco.uninstall()
        for name in ("muscle", "muscle_mujoco"):
            sys.modules.pop(name, None)


def test_a_draw_that_is_none_is_refused():
    muscle = numpy_muscle(python_module(WHOLE, "t", TOLD))
    for draw in (-1, len(DRAWS.values)):
        with pytest.raises(ValueError, match="there are draws 0 to 3"):
            muscle.use(draw)


def test_parameters_of_effects_that_are_left_out_are_no_draws(tmp_path):
    export(WHOLE.drop("tip"), tmp_path / "arm.py", told=TOLD)
    muscle = numpy_muscle((tmp_path / "arm.py").read_text())
    assert "tip.k" not in muscle.PARAMETERS
    np.testing.assert_array_equal(muscle.DRAWS[:, 0], DRAWS.values[:, 0])


@pytest.mark.parametrize("name", ["arm.csv", "arm.fmu"])
def test_forms_that_hold_no_draws_refuse_them(name, tmp_path):
    with pytest.raises(InputError, match="holds no draws"):
        export(WHOLE, tmp_path / name, told=TOLD)


# ---------------------------------------------------------------------------------------------------- from the data


@pytest.fixture(scope="module")
def fitted(tmp_path_factory):
    """A small muscle, fitted; and a posterior of it in its file of chains."""
    folder = write(tmp_path_factory.mktemp("data") / "small", loops())
    assert run("fit", folder, "--effects", "ideal_cylinder", "coulomb_friction").exit_code == 0
    return folder


def run(*arguments):
    return CliRunner().invoke(main, [str(argument) for argument in arguments])


def exported(folder, out, *more):
    done = run(
        "export", folder / "model.toml", "--to", "python", "--out", out / "m.py", "--json", out / "m.json", *more
    )
    assert done.exit_code == 0, done.output
    return numpy_muscle((out / "m.py").read_text()), json.loads((out / "m.json").read_text())


def test_draws_of_the_fit_scatter_as_its_errors_say(fitted, tmp_path):
    muscle, told = exported(fitted, tmp_path, "--draws", 2000)
    assert "normal distribution with the robust covariance" in told["draws"]["from"]
    assert muscle.PARAMETERS == ("muscle.radius", "muscle.braid_angle", "coulomb_friction.f_s")
    text = (fitted / "model.toml").read_text()
    assert run("fit", fitted, "--json", tmp_path / "fit.json", "--no-save").exit_code == 0, text
    errors = json.loads((tmp_path / "fit.json").read_text())["parameters"]
    for at, name in enumerate(muscle.PARAMETERS):
        assert muscle.DRAWS[:, at].std() == pytest.approx(errors[name]["robust_error"], rel=0.1)
        assert muscle.DRAWS[:, at].mean() == pytest.approx(muscle.FITTED[at], abs=errors[name]["robust_error"])
    again, _ = exported(fitted, tmp_path_of(tmp_path, "again"), "--draws", 2000)
    np.testing.assert_array_equal(again.DRAWS, muscle.DRAWS)


def tmp_path_of(folder, name):
    (folder / name).mkdir()
    return folder / name


def test_a_stored_posterior_is_what_is_drawn_from(fitted, tmp_path):
    done = run("posterior", fitted, "--steps", 200, "--quiet", "--limit", "60 s")
    assert done.exit_code in (0, 3), done.output  # 200 steps are few
    try:
        muscle, told = exported(fitted, tmp_path, "--draws", 50)
    finally:
        (fitted / "posterior.chains").unlink()
    assert told["draws"]["from"].startswith("the posterior sampled by emcee")
    assert "(posterior, emcee)" in told["force_error"]
    assert len(np.unique(muscle.DRAWS, axis=0)) == 50


def test_the_force_error_holds_for_fresh_readings(fitted, tmp_path):
    """99 of 100 readings of another recording of the same muscle lie within the stated number."""
    muscle, told = exported(fitted, tmp_path)
    assert told["force_error_N"] == muscle.FORCE_ERROR
    fresh = np.array(loops(seed=9)).T
    direction = np.sign(np.gradient(fresh[3]))
    off = np.abs(fresh[4] - muscle.force(fresh[3] / muscle.LENGTH, fresh[2], direction))
    turning = np.abs(np.gradient(fresh[3])) < 1e-9
    assert (off[~turning] < muscle.FORCE_ERROR).mean() > 0.98
    assert muscle.FORCE_ERROR < 4 * 0.3  # N: the noise of a reading is 0.3


def test_every_form_states_the_force_error(fitted, tmp_path):
    _, told = exported(fitted, tmp_path)
    number = f"{told['force_error_N']:.6g}"
    for form, name, where in (("c", "m.h", "m.h"), ("mujoco", "mj", "mj/lift.xml"), ("table", "m.csv", "m.csv")):
        assert run("export", fitted / "model.toml", "--to", form, "--out", tmp_path / name).exit_code == 0
        text = " ".join((tmp_path / where).read_text().split())
        assert number in text or number.rstrip("0") in text or str(told["force_error_N"]) in text
        assert "99 % of the" in text


def test_without_data_the_force_error_is_said_not_to_be_known(fitted, tmp_path):
    shutil.copy(fitted / "model.toml", tmp_path / "model.toml")
    muscle, told = exported(tmp_path, tmp_path_of(tmp_path, "out"))
    assert np.isnan(muscle.FORCE_ERROR)
    assert told["force_error_N"] is None
    assert "is not known: there are no data beside the model file (name the folder of the data" in told["force_error"]
    elsewhere, _ = exported(tmp_path, tmp_path_of(tmp_path, "more"), "--data", fitted)
    assert elsewhere.FORCE_ERROR > 0
    done = run("export", tmp_path / "model.toml", "--to", "python", "--draws", 3, "--out", tmp_path / "n.py")
    assert done.exit_code == 2
    assert "--data my_muscle/" in " ".join(done.output.split())


def test_other_data_than_those_that_were_fitted_say_nothing(fitted, tmp_path):
    folder = shutil.copytree(fitted, tmp_path / "changed")
    write(folder, loops(seed=5))
    _, told = exported(folder, tmp_path)
    assert "not the data that the model was fitted to" in told["force_error"]
    done = run("export", folder / "model.toml", "--to", "python", "--draws", 3, "--out", tmp_path / "n.py")
    assert done.exit_code == 2


def test_the_error_of_a_model_without_an_effect_is_not_known(fitted, tmp_path):
    muscle, told = exported(fitted, tmp_path, "--without", "coulomb_friction")
    assert np.isnan(muscle.FORCE_ERROR)
    assert "with coulomb_friction, left out here, the model errs by" in told["force_error"]


def test_values_that_were_edited_beyond_what_was_measured_have_no_error(fitted, tmp_path):
    """It was that of the nearest value which the data allow, a thousandth of the true one."""
    folder = shutil.copytree(fitted, tmp_path / "edited")
    text = re.sub(r'radius = \{value = "[^"]*"', 'radius = {value = "20 mm"', (folder / "model.toml").read_text())
    (folder / "model.toml").write_text(text)
    muscle, told = exported(folder, tmp_path_of(tmp_path, "out"))
    assert np.isnan(muscle.FORCE_ERROR)
    assert "muscle.radius = 20 mm lies outside what was measured" in told["force_error"]


def test_how_far_draws_differ_is_said_beside_what_the_model_lacks(fitted, tmp_path):
    done = run(
        "export", fitted, "--to", "python", "--draws", 300, "--out", tmp_path / "m.py", "--json", tmp_path / "m.json"
    )
    assert done.exit_code == 0, done.output
    told, muscle = json.loads((tmp_path / "m.json").read_text()), numpy_muscle((tmp_path / "m.py").read_text())
    assert "The force differs between them by" in " ".join(done.output.split())
    rows = np.array(loops()).T[:, ::20]
    found = [muscle.force(rows[3] / muscle.LENGTH, rows[2], 1) for k in range(100) if muscle.use(k) is None]
    assert told["draws"]["scatter_N"] == pytest.approx(np.sqrt(np.mean(np.var(found, axis=0))), rel=0.3)


def test_chains_of_another_model_are_not_drawn_from(fitted, tmp_path):
    folder = shutil.copytree(fitted, tmp_path / "other")
    done = run("posterior", folder, "--steps", 5, "--quiet", "--fix", "muscle.radius")
    assert done.exit_code in (0, 3), done.output
    _, told = exported(folder, tmp_path, "--draws", 3)
    assert "holds no posterior of this model" in told["draws"]["from"]


def test_draws_are_refused_where_no_form_holds_them(fitted, tmp_path):
    done = run("export", fitted / "model.toml", "--to", "table", "--draws", 3, "--out", tmp_path / "n.csv")
    assert done.exit_code == 2
    assert "holds no draws of the parameters" in " ".join(done.output.split())


# ---------------------------------------------------------------------------------------- fitted to several data sets


@pytest.fixture(scope="module")
def two(tmp_path_factory):
    """Two muscles that share no friction, fitted together; the first one's folder has the model."""
    place = tmp_path_factory.mktemp("two")
    one, other = write(place / "one", loops()), write(place / "other", [(*row[:4], 1.1 * row[4]) for row in loops()])
    effects = ("--effects", "ideal_cylinder", "coulomb_friction", "--own", "coulomb_friction.f_s")
    assert run("fit", one, other, *effects).exit_code == 0
    return one, other


def test_a_model_of_several_data_sets_is_exported_for_each_of_them(two, tmp_path):
    one, other = two
    both = ("--data", one, "--data", other)
    told, pulls = {}, {}
    for name in ("one", "other"):
        muscle, told[name] = exported(one, tmp_path_of(tmp_path, name), *both, "--draws", 200, "--of", name)
        assert muscle.PARAMETERS == ("muscle.radius", "muscle.braid_angle", "coulomb_friction.f_s")
        pulls[name] = muscle.force(0.1, 3e5, 1)
        drawn = [muscle.force(0.1, 3e5, 1) for k in range(50) if muscle.use(k) is None]
        assert np.mean(drawn) == pytest.approx(pulls[name], rel=0.01)
    assert pulls["other"] == pytest.approx(1.1 * pulls["one"], rel=0.02)
    assert told["one"]["force_error_N"] == told["other"]["force_error_N"] > 0
    first, _ = exported(one, tmp_path_of(tmp_path, "first"), *both)
    assert first.force(0.1, 3e5, 1) == pytest.approx(pulls["one"], rel=1e-12)


def test_only_the_data_set_that_is_exported_is_asked_what_it_tells(two, tmp_path):
    """The friction of the other set alone is where its fit began."""
    one, _ = two
    text = (one / "model.toml").read_text()
    lines = [re.sub('"fitted"', '"held"', line) if "f_s@other" in line else line for line in text.splitlines()]
    file = tmp_path / "model.toml"
    file.write_text("\n".join(lines))
    assert "held" in file.read_text()
    for name in ("one", "other"):
        done = run("export", file, "--to", "c", "--of", name, "--out", tmp_path / f"{name}.h")
        assert done.exit_code == 0, done.output
        assert ("The data do not determine" in " ".join(done.output.split())) == (name == "other")


def test_the_other_data_sets_of_a_model_are_asked_for(two, tmp_path):
    one, _ = two
    _, told = exported(one, tmp_path)
    assert "the model was fitted to 2 data sets: one, other" in told["force_error"]
    done = run("export", one / "model.toml", "--to", "python", "--draws", 3, "--out", tmp_path / "n.py")
    assert done.exit_code == 2
    assert "--data one --data other" in " ".join(done.output.split())
    done = run("export", one / "model.toml", "--to", "python", "--of", "others", "--out", tmp_path / "n.py")
    assert done.exit_code == 2
    assert "did you mean 'other'" in " ".join(done.output.split())


def test_a_run_of_the_second_muscle_is_simulated(two, tmp_path):
    one, other = two
    peaks = {}
    for name in ("one", "other"):
        out = tmp_path / name
        assert (
            run("simulate", one / "model.toml", "--out", out, "--of", name, "--data", one, "--data", other).exit_code
            == 0
        )
        peaks[name] = max(float(row.split(",")[-1]) for row in (out / "loop.csv").read_text().splitlines()[1:])
    assert peaks["other"] == pytest.approx(1.1 * peaks["one"], rel=0.02)
