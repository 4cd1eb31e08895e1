"""Every form of an exported muscle on one trajectory, beside the module of plain numpy; its shortest story."""

import ctypes
import functools

import benches
import numpy as np
import pytest
from test_export_c import CALLS, COMPILER, built, numbers, numpy_muscle
from trajectory import trajectory

from fitting.exporting.export import export
from mckibben_jax.effects import BladderNeoHookean, Creep, IdealCylinder, TextileFriction
from mckibben_jax.model import model

LENGTH = float(benches.MUSCLE.length)
WHOLE = model(benches.MUSCLE, IdealCylinder(), BladderNeoHookean(), TextileFriction(), Creep())
compiler = pytest.mark.skipif(COMPILER is None, reason="this machine has no C compiler (cc, gcc, clang)")


def by_numpy(folder, time, pressure, displacement):
    export(WHOLE, folder / "arm.py")
    muscle = numpy_muscle((folder / "arm.py").read_text())
    state, forces = muscle.start(pressure[0], displacement[0]), []
    for k in range(1, len(time)):
        state, force = muscle.step(state, pressure[k], displacement[k], time[k] - time[k - 1])
        forces.append(force)
    return np.array(forces)


def by_model(folder, time, pressure, displacement):
    """The model itself, along the whole run at once; the direction of friction is lost where it stands."""
    run = benches.run(
        time, displacement / LENGTH, pressure, rate=np.diff(displacement, prepend=0) / LENGTH / np.diff(time)[0]
    )
    return np.asarray(WHOLE.force(run))[1:]


def by_c(precision, folder, time, pressure, displacement):
    export(WHOLE, folder / "arm.h")
    define = "#define ARM_FLOAT\n" if precision == "float" else ""
    (folder / "arm.c").write_text(f'{define}#include "arm.h"\n{CALLS.replace("NAME", "arm")}')
    found = np.zeros((3, len(time)))
    arrays = [numbers(np.ascontiguousarray(a)) for a in (time, pressure, displacement, *found)]
    built(folder / "arm.c").run_arm(ctypes.c_int(len(time)), *arrays[:3], *(numbers(row) for row in found))
    return found[0][1:]


def by_mujoco(folder, time, pressure, displacement):
    mujoco = pytest.importorskip("mujoco", reason="MuJoCo is not installed: pip install 'mckibben-jax[mujoco]'")
    export(WHOLE, folder / "mj")
    import sys

    sys.path.insert(0, str(folder / "mj"))
    for name in ("muscle", "muscle_mujoco"):
        sys.modules.pop(name, None)
    try:
        import muscle_mujoco

        scene = muscle_mujoco.load(str(folder / "mj" / "lift.xml"))
        scene.opt.timestep = time[1] - time[0]
        data, forces = mujoco.MjData(scene), []
        state = muscle_mujoco.muscle.start(pressure[0], displacement[0])
        data.act[:] = np.concatenate([np.ravel(part) for part in state])
        for p, x in zip(pressure[1:], displacement[1:], strict=True):
            data.qpos[0], data.qvel[0], data.ctrl[0] = x, 0.0, p
            mujoco.mj_step(scene, data)
            forces.append(-data.actuator_force[0] - data.act[5] * scene.tendon_frictionloss[0])
        return np.array(forces)
    finally:
        sys.path.remove(str(folder / "mj"))
        if "muscle_mujoco" in sys.modules:
            sys.modules["muscle_mujoco"].uninstall()
        for name in ("muscle", "muscle_mujoco"):
            sys.modules.pop(name, None)


def by_fmu(folder, time, pressure, displacement):
    fmpy = pytest.importorskip("fmpy", reason="fmpy is not installed: pip install 'mckibben-jax[fmu]'")
    from fmpy.fmi2 import FMU2Slave

    export(WHOLE, folder / "arm.fmu")
    description = fmpy.read_model_description(str(folder / "arm.fmu"))
    unzipped = fmpy.extract(str(folder / "arm.fmu"), str(folder / "unzipped"))
    slave = FMU2Slave(guid=description.guid, unzipDirectory=unzipped, modelIdentifier="arm", instanceName="one")
    slave.instantiate()
    slave.setupExperiment(startTime=0.0)
    slave.enterInitializationMode()
    slave.setReal([0, 1], [pressure[0], displacement[0]])
    slave.exitInitializationMode()
    forces = []
    for k in range(1, len(time)):
        slave.setReal([0, 1], [pressure[k], displacement[k]])
        slave.doStep(currentCommunicationPoint=time[k - 1], communicationStepSize=time[k] - time[k - 1])
        forces.append(slave.getReal([3])[0])
    slave.terminate()
    slave.freeInstance()
    return np.array(forces)


FORMS = [
    pytest.param(by_model, 1e-9, id="model"),
    pytest.param(functools.partial(by_c, "double"), 1e-9, id="c-double", marks=compiler),
    pytest.param(functools.partial(by_c, "float"), 1e-5, id="c-float", marks=compiler),
    pytest.param(by_mujoco, 1e-9, id="mujoco"),
    pytest.param(by_fmu, 1e-9, id="fmu", marks=compiler),
]


@pytest.mark.parametrize(("form", "close"), FORMS)
def test_every_form_is_the_same_muscle(form, close, tmp_path):
    time, pressure, displacement = (a.astype(np.float32).astype(float) for a in trajectory(LENGTH))
    time = np.arange(len(time)) * 2.0**-9  # s, even in either precision
    expected, found = by_numpy(tmp_path, time, pressure, displacement), form(tmp_path, time, pressure, displacement)
    moves = np.diff(displacement) != 0
    at = moves if form is by_model else np.ones_like(moves)
    off = np.abs(found - expected)[at].max() / np.abs(expected).max()
    print(f"off by {off:.1e} of the largest force")
    assert at.mean() > 0.7
    assert off < close
