"""The muscle as a block of Simulink and as a sketch for Arduino, compiled against stubs of our own.

No MATLAB and no board were at hand: what is tested is that the code compiles with every warning an error, and that it
computes what the module of plain numpy does when it is called in the order that the documentation of S-functions and
of Arduino gives.
"""

import ctypes
import shutil
import subprocess
from pathlib import Path

import benches
import numpy as np
import pytest
from test_export import exported
from test_export_c import COMPILER, WARNINGS, numbers, numpy_muscle
from trajectory import STEP, trajectory

from fitting.exporting.export import export
from fitting.exporting.python_module import python_module
from mckibben_jax.effects import BladderNeoHookean, Creep, IdealCylinder, TextileFriction
from mckibben_jax.model import model

STUBS = Path(__file__).parent / "stubs"
WHOLE = model(benches.MUSCLE, IdealCylinder(), BladderNeoHookean(), TextileFriction(), Creep())
LENGTH = float(benches.MUSCLE.length)
compiler = pytest.mark.skipif(COMPILER is None, reason="this machine has no C compiler (cc, gcc, clang)")
cpp = pytest.mark.skipif(shutil.which("g++") is None, reason="this machine has no C++ compiler (g++)")

# As Simulink calls a block: sizes, sample times, initial conditions, then at each sample the outputs (here twice, as it
# may) and the update.
SIMULINK = """
#include <string.h>
#include "arm_block.c"
static SimStruct block;
int begin(double sample_time) {
    memset(&block, 0, sizeof block);
    block.parameter.value = sample_time;
    mdlInitializeSizes(&block);
    if (block.error) return -1;
    mdlInitializeSampleTimes(&block);
    mdlInitializeConditions(&block);
    return block.works <= 256 && block.inputs == 2 && block.outputs == OUTPUTS && block.sample_time == sample_time
        && block.widths == 2 + OUTPUTS && block.feeds_through[0] && block.feeds_through[1] && !block.is_tunable;
}
void run(int n, const double *p, const double *x, double *out) {
    for (int k = 0; k < n; ++k) {
        block.input[0] = p + k;
        block.input[1] = x + k;
        mdlOutputs(&block, 0);
        mdlOutputs(&block, 0);
        memcpy(out + OUTPUTS * k, block.output, OUTPUTS * sizeof(double));
        mdlUpdate(&block, 0);
    }
    mdlTerminate(&block);
}
"""
ARDUINO = """
#include <Arduino.h>
#include "arm.ino"
extern "C" void begin(float pressure, float position) {
    stub_counts[0] = pressure; stub_counts[1] = position;
    setup();
}
extern "C" double turn(float pressure, float position, unsigned long now) {
    stub_counts[0] = pressure; stub_counts[1] = position; stub_micros = now;
    loop();
    return stub_printed;
}
extern "C" int prints() { return stub_prints; }
"""


def compiled(command, source):
    library = source.with_suffix(".so")
    done = subprocess.run(
        [*command, f"-I{STUBS}", str(source), "-o", str(library), "-lm"], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr[:3000]
    return ctypes.CDLL(str(library))


# ------------------------------------------------------------------------------------------------------------ Simulink


@pytest.fixture(scope="module")
def block(tmp_path_factory):
    folder = tmp_path_factory.mktemp("simulink")
    export(WHOLE, folder / "arm", form="simulink")
    assert {path.name for path in (folder / "arm").iterdir()} == {"muscle.h", "arm_block.c"}
    (folder / "arm" / "simulink.c").write_text(SIMULINK)
    unused = "-Wno-unused-function"  # Simulink calls them
    return compiled([COMPILER, "-std=c99", *WARNINGS, unused, "-O1", "-fPIC", "-shared"], folder / "arm" / "simulink.c")


@compiler
def test_the_block_computes_what_numpy_computes(block):
    muscle = numpy_muscle(python_module(WHOLE, "t"))
    _, pressure, displacement = (np.ascontiguousarray(a) for a in trajectory(LENGTH))
    found = np.zeros((len(pressure), 4))
    for _ in range(2):  # a second simulation begins anew
        assert block.begin(ctypes.c_double(STEP)) == 1
        block.run(ctypes.c_int(len(pressure)), numbers(pressure), numbers(displacement), numbers(found))
    state = muscle.start(pressure[0], displacement[0])
    expected = [(muscle.force(displacement[0] / LENGTH, pressure[0]), 0.0)]
    for p, x in zip(pressure[1:], displacement[1:], strict=True):
        before, (state, force) = state, muscle.step(state, p, x, STEP)
        expected.append((force, muscle.step_parts(before, p, x, STEP)[2]))
    close = 1e-9 * np.abs(found[:, 0]).max()
    np.testing.assert_allclose(found[:, [0, 2]], expected, rtol=0, atol=close)
    end = muscle.stiffness(state.contraction, state.pressure, state.direction)
    assert found[-1, 3] == pytest.approx(end, rel=1e-9)


@compiler
def test_a_sample_time_that_is_none_is_refused(block):
    for sample_time in (0.0, -1.0, np.nan):
        assert block.begin(ctypes.c_double(sample_time)) == -1


# ------------------------------------------------------------------------------------------------------------- Arduino


@cpp
def test_the_sketch_prints_what_numpy_computes(tmp_path):
    export(WHOLE, tmp_path / "arm", form="arduino")
    assert {path.name for path in (tmp_path / "arm").iterdir()} == {"muscle.h", "arm.ino"}
    (tmp_path / "arm" / "board.cpp").write_text(ARDUINO)
    strict = ("-Wall", "-Wextra", "-Werror", "-Wno-unused-but-set-variable")
    library = compiled(["g++", "-std=c++11", *strict, "-O1", "-fPIC", "-shared"], tmp_path / "arm" / "board.cpp")
    library.turn.restype = ctypes.c_double
    muscle, f32 = numpy_muscle(python_module(WHOLE, "t")), np.float32
    _, pressure, displacement = trajectory(LENGTH)
    counts = np.round(pressure / 1220.7 + 102.4), np.round(displacement / 1e-4)
    pressure = (f32(counts[0]) - f32(102.4)) * f32(1220.7)  # what the sketch makes of the counts
    displacement = followed(f32(counts[1]) * f32(1e-4), 3e-4)
    call = lambda name, k, *more: getattr(library, name)(*(ctypes.c_float(c[k]) for c in counts), *more)  # noqa: E731
    call("begin", 0)
    state, expected, found = muscle.start(pressure[0], displacement[0]), [], []
    for k in range(1, len(pressure)):
        before = library.prints()
        call("turn", k - 1, ctypes.c_ulong(10_000 * k - 9_000))  # too early for a step
        printed = call("turn", k, ctypes.c_ulong(10_000 * k))
        state, force = muscle.step(state, pressure[k], displacement[k], 1e-2)
        if library.prints() > before:
            expected.append(force)
            found.append(printed)
    assert len(found) == (len(pressure) - 1) // 20
    assert np.ptp(expected) > 100
    np.testing.assert_allclose(found, expected, rtol=0, atol=2e-5 * np.abs(expected).max())


def followed(readings, still):
    """What follows the readings at this distance at most."""
    held = [readings[0]]
    for reading in readings[1:]:
        held.append(np.clip(held[-1], reading - np.float32(still), reading + np.float32(still)))
    return np.array(held)


@cpp
def test_a_reading_that_jitters_by_one_count_leaves_the_force_alone(tmp_path):
    """Friction turns round with every motion, however small: the sketch takes jitter for none."""
    export(WHOLE, tmp_path / "arm", form="arduino")
    (tmp_path / "arm" / "board.cpp").write_text(ARDUINO)
    library = compiled(["g++", "-std=c++11", "-O1", "-fPIC", "-shared"], tmp_path / "arm" / "board.cpp")
    library.turn.restype = ctypes.c_double
    library.begin(ctypes.c_float(350.0), ctypes.c_float(100.0))
    rise = np.append(np.arange(100.0, 300.0), 300.0 + np.tile([0.0, 1.0], 300))
    found = [library.turn(ctypes.c_float(350.0), ctypes.c_float(at), ctypes.c_ulong(10_000 * (k + 1)))
             for k, at in enumerate(rise)]  # fmt: skip
    assert np.abs(np.diff(found[300:])).max() < 2  # N: it creeps; friction would jump by a hundred


# --------------------------------------------------------------------------------------------------------- the command


@pytest.mark.parametrize(
    ("form", "files"), [("simulink", ["arm_block.c", "muscle.h"]), ("arduino", ["arm.ino", "muscle.h"])]
)
def test_the_command_writes_a_folder(form, files, tmp_path):
    told = exported(tmp_path, "--to", form, "--out", str(tmp_path / "arm"))
    assert told.exit_code == 0, told.output
    assert sorted(path.name for path in (tmp_path / "arm").iterdir()) == files
    again = exported(tmp_path, "--to", form, "--out", str(tmp_path / "arm"))
    assert again.exit_code == 2
    assert "left alone" in again.output
    odd = exported(tmp_path, "--to", form, "--out", str(tmp_path / "my-arm"))
    assert odd.exit_code == 2
