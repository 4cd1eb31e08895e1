"""The muscle in MuJoCo: the two scenes against our own motion, held without drift or chatter, and swung."""

import importlib
import sys

import benches
import jax.numpy as jnp
import numpy as np
import pytest
from scipy import constants
from test_export import exported
from trajectory import STEP, trajectory

from fitting.exporting.export import export
from mckibben_jax.effects import (
    BladderNeoHookean,
    CoulombFriction,
    Creep,
    IdealCylinder,
    KineticFriction,
    MaxwellSlip,
    TextileFriction,
)
from mckibben_jax.model import model
from mckibben_jax.motion.motion import moved
from mckibben_jax.state import State

mujoco = pytest.importorskip("mujoco", reason="MuJoCo is not installed: pip install 'mckibben-jax[mujoco]'")
DRY = (IdealCylinder(), BladderNeoHookean(), TextileFriction(), KineticFriction())
REMEMBERS = (*DRY[:3], MaxwellSlip(), Creep())
LENGTH = float(benches.MUSCLE.length)
DRIFT, CHATTER = 1e-4, 1e-4  # rad in 8 s, rad/s: a hundredth of what the joint's friction makes uncertain; chosen


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Writes the folder of a model and gives its callbacks; afterwards MuJoCo asks nobody."""
    callbacks = []

    def write(*effects):
        export(model(benches.MUSCLE, *effects), tmp_path / "arm")
        monkeypatch.syspath_prepend(str(tmp_path / "arm"))
        for name in ("muscle", "muscle_mujoco"):
            sys.modules.pop(name, None)
        callbacks.append(importlib.import_module("muscle_mujoco"))
        return tmp_path / "arm", callbacks[-1]

    yield write
    for each in callbacks:
        each.uninstall()
    for name in ("muscle", "muscle_mujoco"):
        sys.modules.pop(name, None)


def scene(place, callbacks, name, timestep=1e-3):
    """A scene that was loaded and installed."""
    loaded = callbacks.load(str(place / name))
    loaded.opt.timestep = timestep
    return loaded, mujoco.MjData(loaded)


def run(loaded, data, pressures):
    """Position and speed along a run; a row of pressures (Pa) for each step."""
    rows = []
    for row in pressures:
        data.ctrl[:] = row
        mujoco.mj_step(loaded, data)
        rows.append((data.qpos[0], data.qvel[0]))
    return np.array(rows)


@pytest.mark.parametrize("effects", [DRY, REMEMBERS], ids=["dry", "remembers"])
def test_it_computes_what_numpy_computes_along_a_trajectory(effects, folder):
    place, callbacks = folder(*effects)
    loaded, data = scene(place, callbacks, "lift.xml", STEP)
    muscle, (_, pressure, displacement) = callbacks.muscle, trajectory(LENGTH)
    state, found, expected = muscle.start(pressure[0], displacement[0]), [], []
    for p, x in zip(pressure[1:], displacement[1:], strict=True):
        data.qpos[0], data.qvel[0], data.ctrl[0] = x, 0.0, p  # moved by hand
        if not data.act.any():
            data.act[:] = np.concatenate([np.ravel(part) for part in state])
        mujoco.mj_step(loaded, data)
        x = muscle.LENGTH - data.actuator_length[0]  # as the tendon has it
        state, pull, friction = muscle.step_parts(state, p, x, STEP)
        expected.append((pull, max(friction, 1e-9), state.direction))
        found.append((-data.actuator_force[0], loaded.tendon_frictionloss[0], data.act[5]))
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9 * np.abs(expected).max())


@pytest.mark.parametrize("effects", [DRY, REMEMBERS], ids=["dry", "remembers"])
def test_a_load_is_lifted_as_our_own_motion_lifts_it(effects, folder):
    place, callbacks = folder(*effects)
    loaded, data = scene(place, callbacks, "lift.xml", 2.5e-4)
    loaded.jnt_limited[0] = 0  # our own load hangs freely, too
    time = np.arange(4001) * 2.5e-4
    pressure = 1e5 + np.interp(time, [0, 0.4, 0.6, 0.9], [0, 2e5, 2e5, 0.5e5])
    found = run(loaded, data, pressure[1:, None])[:, 0]
    mass = float(loaded.body_mass[1])
    # the scene begins at rest length, where our own load would hang lower: both let go there
    states = State(jnp.zeros(4001), jnp.asarray(pressure), time=jnp.asarray(time))
    own = moved(model(benches.MUSCLE, *effects), states, mass * constants.g, 0.0, steps=4000, mass=mass)
    expected = np.asarray(own.contraction)[1:] * LENGTH
    assert np.ptp(expected) > 0.03
    np.testing.assert_allclose(found, expected, rtol=0, atol=2e-4)


@pytest.mark.parametrize("friction", [CoulombFriction(f_s=0.02), TextileFriction(f_s=0.05, beta=0.6)])
def test_a_muscle_without_rubber_lifts_its_load_from_the_ground(friction, folder, capsys):
    """Nothing but the ground holds its load before the pressure does: it once fell until the braid was straight."""
    place, callbacks = folder(IdealCylinder(), friction)
    callbacks.main(str(place / "lift.xml"))
    rows = [[float(cell) for cell in line.split()] for line in capsys.readouterr().out.splitlines()[1:]]
    heights, frictions = np.array(rows)[:, 1], np.array(rows)[:, 2]
    assert heights.min() > -1e-4
    assert heights[-1] > 0.02
    assert frictions.max() < 500


def joint_alone(callbacks, loaded, pressures, timestep):
    """The joint of the scene by half steps of its own, with friction that holds exactly: no line of MuJoCo."""
    muscle, middle, radius = callbacks.muscle, loaded.actuator_user[0, 0], loaded.wrap_prm[1]
    full = mujoco.MjData(loaded)
    callbacks.uninstall()
    mujoco.mj_forward(loaded, full)
    inertia, weight = float(full.M[0]) if hasattr(full, "M") else float(full.qM[0]), float(full.qfrc_bias[0])
    callbacks.install(loaded)
    angle, speed, states, rows = 0.0, 0.0, [None, None], []
    for row in pressures:
        pulls, frictions = np.zeros(2), np.zeros(2)
        for k, way in enumerate((1.0, -1.0)):
            x = muscle.LENGTH - middle + way * radius * angle
            states[k] = muscle.start(row[k], x) if states[k] is None else states[k]
            states[k], pulls[k], frictions[k] = muscle.step_parts(states[k], row[k], x, timestep)
        free = speed + timestep * (radius * (pulls[0] - pulls[1]) - weight * np.cos(angle)) / inertia
        held = timestep * radius * frictions.sum() / inertia
        speed = np.sign(free) * max(abs(free) - held, 0.0)
        angle += timestep * speed
        rows.append((angle, speed))
    return np.array(rows)


def test_a_joint_of_two_muscles_is_held_under_load_without_drift_or_chatter(folder):
    place, callbacks = folder(*DRY)
    loaded, data = scene(place, callbacks, "joint.xml")
    risen = np.interp(np.arange(12000) * 1e-3, [0, 0.5], [0, 1])[:, None] * (3e5, 1.5e5)
    angle, speed = run(loaded, data, risen).T
    assert abs(angle[-1]) > 0.1
    assert np.ptp(angle[-10000:]) < DRIFT
    assert np.abs(speed[-10000:]).max() < CHATTER
    assert np.ptp(data.act[:]) > 0


def test_a_joint_that_is_swung_moves_as_by_our_own_steps(folder):
    place, callbacks = folder(*DRY)
    loaded, data = scene(place, callbacks, "joint.xml", 2.5e-4)
    time = np.arange(12000) * 2.5e-4
    swing = 1e5 * np.sin(2 * np.pi * 0.7 * time) * np.minimum(time, 1)
    pressures = np.stack([2.5e5 + swing, 2e5 - swing], axis=1) * np.minimum(4 * time, 1)[:, None]
    found = run(loaded, data, pressures)[:, 0]
    expected = joint_alone(callbacks, loaded, pressures, 2.5e-4)[:, 0]
    assert np.ptp(expected[4000:]) > 0.3
    np.testing.assert_allclose(found, expected, rtol=0, atol=0.01 * np.ptp(expected))


def test_a_copy_of_the_data_goes_on_where_the_first_was(folder):
    import copy

    place, callbacks = folder(*REMEMBERS)
    loaded, data = scene(place, callbacks, "lift.xml")
    run(loaded, data, np.full((300, 1), 2e5))
    other, other_model = copy.copy(data), copy.copy(loaded)
    np.testing.assert_array_equal(
        run(loaded, data, np.full((300, 1), 3e5)), run(other_model, other, np.full((300, 1), 3e5))
    )


def test_two_scenes_live_side_by_side(folder):
    place, callbacks = folder(*DRY)
    alone = run(*scene(place, callbacks, "lift.xml"), np.full((50, 1), 3e5))
    one, data = scene(place, callbacks, "lift.xml")
    other, more = scene(place, callbacks, "joint.xml")
    for _ in range(50):
        last = run(one, data, [[3e5]])
        run(other, more, [[3e5, 1e5]])
    np.testing.assert_array_equal(last, alone[-1:])


def test_a_scene_that_cannot_work_is_refused_with_its_cure(folder):
    place, callbacks = folder(*DRY)
    text = (place / "lift.xml").read_text()
    for old, new, words in (
        ("implicitfast", "RK4", "implicitfast"),
        ('actdim="6"', 'actdim="5"', 'needs actdim="6"'),
        ('frictionloss="1"', "", "frictionloss"),
        ('biastype="user"', "", 'biastype="user"'),
        ('gainprm="0"', "", 'gainprm="0"'),
        ('gainprm="0"', 'gainprm="0" gear="2"', 'gear="1"'),
        (' user="0"', "", 'nuser_actuator="1" and user="0"'),
    ):
        assert old in text
        if old == ' user="0"':
            text = text.replace('<size nuser_actuator="1"/>', "")
        changed = place / "changed.xml"
        changed.write_text(text.replace(old, new))
        with pytest.raises(ValueError, match=words):
            callbacks.load(str(changed))


def test_the_command_writes_a_folder_and_leaves_one_that_is_there_alone(tmp_path):
    out = tmp_path / "arm"
    told = exported(tmp_path, "--to", "mujoco", "--out", str(out))
    assert told.exit_code == 0, told.output
    assert {each.name for each in out.iterdir()} == {"muscle.py", "muscle_mujoco.py", "lift.xml", "joint.xml"}
    again = exported(tmp_path, "--to", "mujoco", "--out", str(out))
    assert again.exit_code == 2
    assert "left alone" in again.output
