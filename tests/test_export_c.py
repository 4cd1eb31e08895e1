"""The muscle in C99: every law, compiled by this machine's compiler, computes what the module of plain numpy does."""

import ctypes
import shutil
import subprocess
import types

import benches
import numpy as np
import pytest
from benches import hosts
from test_export import KINDS, every_kind, exported, functions
from trajectory import trajectory

from fitting.exporting.c_header import c_header
from fitting.exporting.c_source import c_source
from fitting.exporting.python_module import python_module
from mckibben_jax.effect import name_of
from mckibben_jax.model import model

COMPILER = next(filter(None, map(shutil.which, ("cc", "gcc", "clang"))), None)
pytestmark = pytest.mark.skipif(COMPILER is None, reason="this machine has no C compiler (cc, gcc, clang)")
WARNINGS = ("-pedantic", "-Wall", "-Wextra", "-Werror", "-Wno-unused-but-set-variable")
STRICT = ("-std=c99", *WARNINGS, "-O1", "-fPIC", "-shared")
LENGTH = float(benches.MUSCLE.length)
AT = (0.12, 2.2e5, 1.0)  # contraction, pressure (Pa), direction

# What a test calls: everything goes in and out as double, whatever the precision inside.
CALLS = """
void run_NAME(int n, const double *t, const double *p, const double *x, double *force, double *parts, double *asked) {
    NAME_state state = NAME_start(p[0], x[0]), split = state;
    for (int k = 1; k < n; ++k) {
        NAME_real friction, pull;
        NAME_state tried = state;
        const NAME_real dt = (NAME_real)(t[k] - t[k - 1]);
        const NAME_real wanted = (NAME_real)force[k - 1]; /* hold it */
        const NAME_real pressure = k % 50 ? 0 : NAME_pressure_for_step(&state, wanted, x[k], dt);
        asked[k] = k % 50 ? NAN : NAME_step(&tried, pressure, x[k], dt) - wanted;
        force[k] = NAME_step(&state, p[k], x[k], dt);
        pull = NAME_step_parts(&split, p[k], x[k], dt, &friction);
        parts[k] = pull - split.direction * friction;
    }
}
void laws_NAME(double contraction, double pressure, double direction, double *out) {
    const NAME_linear near = NAME_linearise(contraction, pressure, direction, 0);
    out[0] = NAME_force(contraction, pressure, direction, 0);
    out[1] = near.force; out[2] = near.stiffness; out[3] = near.gain; out[4] = near.damping;
    out[5] = NAME_stiffness(contraction, pressure, direction);
    out[6] = NAME_pressure_for((NAME_real)out[0], contraction, direction);
}
"""


@pytest.fixture(scope="module")
def written():
    """Every effect's module of plain numpy and header, by the effect's name."""
    wholes = {name_of(kind): model(benches.MUSCLE, *(o() for o in hosts(kind)), kind()) for kind in KINDS}
    return {name: (python_module(whole, "t"), c_header(whole, "t", name)) for name, whole in wholes.items()}


@pytest.fixture(scope="module", params=["double", "float"])
def compiled(request, written, tmp_path_factory):
    """One library of all headers in one precision, compiled with every warning an error."""
    folder = tmp_path_factory.mktemp(request.param)
    text = "".join(f"#define {name.upper()}_FLOAT\n" for name in written if request.param == "float")
    for name, (_, header) in written.items():
        (folder / f"{name}.h").write_text(header)
        text += f'#include "{name}.h"\n' + CALLS.replace("NAME", name)
    (folder / "all.c").write_text(text)
    return request.param, built(folder / "all.c")


def built(source):
    """The library that the compiler makes of a file."""
    library = source.with_suffix(".so")
    done = subprocess.run([COMPILER, *STRICT, source, "-o", library, "-lm"], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[:3000]
    return ctypes.CDLL(str(library))


def numbers(array):
    return array.ctypes.data_as(ctypes.POINTER(ctypes.c_double))


def numpy_muscle(text):
    """The module of plain numpy that stands in a text."""
    module = types.ModuleType("muscle")
    exec(text, module.__dict__)  # the source is ours
    return module


@every_kind
def test_c_steps_along_a_trajectory_as_numpy_does(kind, written, compiled):
    precision, library = compiled
    time, pressure, displacement = (np.ascontiguousarray(a) for a in trajectory(LENGTH))
    if precision == "float":  # what a float can hold, so that both get the same
        time, pressure, displacement = (a.astype(np.float32).astype(float) for a in (time, pressure, displacement))
    muscle, found = numpy_muscle(written[name_of(kind)][0]), np.zeros((3, len(time)))
    state, expected = muscle.start(pressure[0], displacement[0]), np.zeros(len(time))
    for k in range(1, len(time)):
        state, expected[k] = muscle.step(state, pressure[k], displacement[k], time[k] - time[k - 1])
    given = [numbers(a) for a in (time, pressure, displacement, *found)]
    getattr(library, f"run_{name_of(kind)}")(len(time), *given)
    close = {"double": 1e-9, "float": 1e-5}[precision] * np.abs(expected).max()
    force, parts, asked = found
    np.testing.assert_allclose(force, expected, rtol=0, atol=close)
    np.testing.assert_allclose(parts, expected, rtol=0, atol=close)
    reached = asked[np.isfinite(asked)]
    assert len(reached) > 5
    np.testing.assert_allclose(reached, 0, rtol=0, atol=10 * close)


@every_kind
def test_slow_laws_in_c_are_those_in_numpy(kind, written, compiled):
    precision, library = compiled
    muscle, found = numpy_muscle(written[name_of(kind)][0]), np.zeros(7)
    getattr(library, f"laws_{name_of(kind)}")(*map(ctypes.c_double, AT), numbers(found))
    linear = muscle.linearise(*AT)
    expected = [muscle.force(*AT), *linear, muscle.stiffness(*AT), AT[1]]
    np.testing.assert_allclose(found, expected, rtol={"double": 1e-9, "float": 2e-4}[precision], atol=1e-7)


@pytest.mark.parametrize("function", functions)
def test_what_is_written_in_c_computes_what_jax_computes(function, tmp_path):
    import jax.numpy as jnp

    from fitting.exporting.c_operations import HELPERS

    source = c_source("f", lambda x, y: [function(x, y)], {"x": jnp.zeros(()), "y": jnp.ones(())})
    macros = "#include <math.h>\n#define MK_REAL double\n#define MK_C(x) ((double)(x))\n#define MK_F(x) x\n"
    macros += "#define MK_SMALL(x) x\n#define MK_LARGE(x) x\n"
    (tmp_path / "f.c").write_text(f"{macros}{HELPERS}{source}\nvoid g(double x, double y, double *o) {{ f(x, y, o); }}")
    done = subprocess.run(
        [COMPILER, *STRICT, "-Wno-unused-function", tmp_path / "f.c", "-o", tmp_path / "f.so", "-lm"],
        capture_output=True, text=True,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[:2000]
    library, out = ctypes.CDLL(str(tmp_path / "f.so")), np.zeros(1)
    for x, y in ((0.3, 0.7), (0.9, 0.2), (-0.4, 1.3)):
        library.g(ctypes.c_double(x), ctypes.c_double(y), numbers(out))
        assert out[0] == pytest.approx(float(function(x, y)), rel=1e-12)


def test_the_command_writes_a_header_that_compiles_under_its_own_name(tmp_path):
    out = tmp_path / "my_arm.h"
    told = exported(tmp_path, "--to", "c", "--out", str(out))
    assert told.exit_code == 0, told.output
    (tmp_path / "use.c").write_text(
        '#include "my_arm.h"\ndouble pull(void) { my_arm_state s = my_arm_start(3e5, 0.0);'
        " return my_arm_step(&s, 3e5, 0.01, 1e-3); }\n"
    )
    library = built(tmp_path / "use.c")
    library.pull.restype = ctypes.c_double
    assert exported(tmp_path, "--to", "python", "--out", str(tmp_path / "my_arm.py")).exit_code == 0
    muscle = numpy_muscle((tmp_path / "my_arm.py").read_text())
    assert library.pull() == pytest.approx(muscle.step(muscle.start(3e5, 0.0), 3e5, 0.01, 1e-3)[1], rel=1e-12)


@pytest.mark.skipif(shutil.which("g++") is None, reason="this machine has no C++ compiler (g++)")
def test_a_compiler_of_cpp_takes_the_header_too(written, tmp_path):
    source = tmp_path / "all.cpp"
    source.write_text("".join(text for _, text in written.values()))
    command = ["g++", "-Wall", "-Wextra", "-Werror", WARNINGS[-1], "-fsyntax-only", source]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[:2000]


@pytest.mark.parametrize(
    ("name", "words"), [("my-arm.h", "C cannot use"), ("float.h", "C cannot use"), ("m.c", "'.c'")]
)
def test_a_name_that_c_cannot_use_is_refused(tmp_path, name, words):
    told = exported(tmp_path, "--to", "c", "--out", str(tmp_path / name))
    assert told.exit_code == 2
    assert words in told.output
