"""The muscle as an FMU: fmpy finds no fault in it, and it computes what the module of plain numpy does."""

import shutil

import benches
import numpy as np
import pytest
from test_export import exported
from test_export_c import COMPILER, numpy_muscle
from trajectory import STEP, trajectory

from fitting.exporting.export import export
from fitting.exporting.force_error import ForceError
from fitting.exporting.laws import Told
from fitting.exporting.python_module import python_module
from mckibben_jax.effects import BladderNeoHookean, Creep, IdealCylinder, TextileFriction
from mckibben_jax.model import model

fmpy = pytest.importorskip("fmpy", reason="fmpy is not installed: pip install 'mckibben-jax[fmu]'")
pytestmark = pytest.mark.skipif(COMPILER is None, reason="this machine has no C compiler (cc, gcc, clang)")
WHOLE = model(benches.MUSCLE, IdealCylinder(), BladderNeoHookean(), TextileFriction(), Creep())
PRESSURE, DISPLACEMENT, WANTED, FORCE, PULL, FRICTION, DIRECTION, STIFFNESS, NEXT = range(9)


@pytest.fixture(scope="module")
def unit(tmp_path_factory):
    """An FMU, and the module of plain numpy of the same muscle."""
    file = tmp_path_factory.mktemp("fmu") / "arm.fmu"
    export(WHOLE, file)
    return file, numpy_muscle(python_module(WHOLE, "t"))


@pytest.fixture
def slave(unit):
    """An instance that stood at 2 bar and at rest length."""
    from fmpy.fmi2 import FMU2Slave

    description, folder = fmpy.read_model_description(unit[0]), fmpy.extract(unit[0])
    made = FMU2Slave(
        guid=description.guid,
        unzipDirectory=folder,
        modelIdentifier=description.coSimulation.modelIdentifier,
        instanceName="one",
    )
    made.instantiate()
    made.setupExperiment(startTime=0.0)
    made.enterInitializationMode()
    made.setReal([PRESSURE, DISPLACEMENT], [2e5, 0.0])
    made.exitInitializationMode()
    yield made
    made.terminate()
    made.freeInstance()
    shutil.rmtree(folder)


def test_fmpy_finds_no_fault(unit):
    from fmpy.validation import validate_fmu

    assert not validate_fmu(str(unit[0]))


def test_it_computes_what_numpy_computes_along_a_trajectory(unit, slave):
    muscle, (time, pressure, displacement) = unit[1], trajectory(float(benches.MUSCLE.length))
    state, found, expected = muscle.start(2e5, 0.0), [], []
    for k in range(1, len(time)):
        slave.setReal([PRESSURE, DISPLACEMENT], [pressure[k], displacement[k]])
        slave.doStep(currentCommunicationPoint=time[k - 1], communicationStepSize=STEP)
        found.append(slave.getReal([FORCE, DIRECTION]))
        state, force = muscle.step(state, pressure[k], displacement[k], STEP)
        expected.append((force, state.direction))
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9 * np.abs(expected).max())


def test_its_helpers_are_those_of_numpy(unit, slave):
    muscle = unit[1]
    state = muscle.start(2e5, 0.0)
    for x in (0.002, 0.004):
        slave.setReal([PRESSURE, DISPLACEMENT, WANTED], [2e5, x, 150.0])
        slave.doStep(currentCommunicationPoint=0.0, communicationStepSize=STEP)
        state, pull, friction = muscle.step_parts(state, 2e5, x, STEP)
    found = slave.getReal([PULL, FRICTION, STIFFNESS, NEXT])
    stiffness = muscle.stiffness(state.contraction, state.pressure, state.direction)
    expected = [pull, friction, stiffness, muscle.pressure_for_step(state, 150.0, x, STEP)]
    np.testing.assert_allclose(found, expected, rtol=1e-9)


def test_a_state_that_was_kept_can_be_set_back(slave):
    def pull(until):
        for x in np.linspace(0.001, until, 20):
            slave.setReal([PRESSURE, DISPLACEMENT], [2e5, x])
            slave.doStep(currentCommunicationPoint=0.0, communicationStepSize=STEP)
        return slave.getReal([FORCE])

    kept = slave.getFMUState()
    first = pull(0.02)
    assert pull(0.02) != first  # it remembers
    slave.setFMUState(kept)
    assert pull(0.02) == first
    slave.freeFMUState(kept)


def test_a_master_runs_it_from_start_to_end(unit):
    time = np.linspace(0, 1, 11)
    signals = np.array(
        [(t, 2e5, 0.02 * t) for t in time], dtype=[("time", float), ("pressure", float), ("displacement", float)]
    )
    ran = fmpy.simulate_fmu(str(unit[0]), stop_time=1.0, output_interval=0.01, input=signals, output=["force"])
    assert len(ran) == 101
    assert np.all(np.diff(ran["force"][5:]) < 0)


def test_the_command_writes_one_and_says_what_is_missing(tmp_path, monkeypatch):
    out = tmp_path / "arm.fmu"
    told = exported(tmp_path, "--to", "fmu", "--out", str(out))
    assert told.exit_code == 0, told.output
    assert fmpy.read_model_description(str(out)).modelName == "arm"
    monkeypatch.setenv("CC", "no-such-compiler")
    told = exported(tmp_path, "--to", "fmu", "--out", str(tmp_path / "other.fmu"))
    assert told.exit_code == 2
    assert "no-such-compiler" in told.output
    assert not (tmp_path / "other.fmu").exists()


def test_it_states_the_force_error(tmp_path):
    file = tmp_path / "arm.fmu"
    export(WHOLE, file, told=Told(ForceError(1.5, 'Largest force error to expect, 1.5 N, "as <told>".')))
    described = fmpy.read_model_description(str(file))
    assert 'expect, 1.5 N, "as <told>".' in described.description
    found = fmpy.simulate_fmu(str(file), stop_time=0.01, output=["force_error"], start_values={"pressure": 2e5})
    assert set(found["force_error"]) == {1.5}
