"""A model written down for others: what the module of plain numpy computes, where no jax is to be had, is the model."""

import functools
import json
import subprocess
import sys

import benches
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from benches import VISIBLE, hosts
from click.testing import CliRunner

from fitting.cli.main import main
from fitting.errors import InputError
from fitting.exporting.laws import memory_names
from fitting.exporting.numpy_source import numpy_source
from fitting.exporting.python_module import python_module
from fitting.exporting.table import forces
from fitting.exporting.traced import UnknownOperation
from fitting.recordings.experiment import read_experiment
from mckibben_jax.effect import Pulling, name_of
from mckibben_jax.effects import LIBRARY, CoulombFriction, IdealCylinder, Mullins, TimeDelay
from mckibben_jax.laws.shape import path_rate
from mckibben_jax.memory import Memory
from mckibben_jax.model import model

LOOKS_BACK = (TimeDelay,)
KINDS = [kind for kind in LIBRARY if kind not in LOOKS_BACK]
LENGTH = float(benches.MUSCLE.length)
PLACES = np.array([[0.12, 1.2e5, 1, 0], [0.11, 3.1e5, -1, 0], [0.17, 4.5e5, 1, 0.2], [0.08, 2e5, 0, 0]])

every_kind = pytest.mark.parametrize("kind", KINDS, ids=name_of)

# Runs without jax, scipy and this program: nothing but numpy can be imported.
STRANGER = """
import importlib.util, json, sys
for blocked in ("jax", "jaxlib", "equinox", "scipy", "mckibben_jax", "fitting"):
    sys.modules[blocked] = None
import numpy as np
folder, names = sys.argv[1], sys.argv[2].split(",")
runs, places, found = np.load(f"{folder}/runs.npz"), np.load(f"{folder}/places.npy"), {}
for name in names:
    spec = importlib.util.spec_from_file_location(name, f"{folder}/{name}.py")
    muscle = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(muscle)
    for row, (t, x, p) in enumerate(zip(runs["time"], runs["displacement"], runs["pressure"])):
        state, forces = muscle.start(p[0], x[0]), []
        for k in range(1, len(t)):
            state, force = muscle.step(state, p[k], x[k], t[k] - t[k - 1])
            forces.append(force)
        found[f"{name} run {row}"] = forces
    c, p, d, r = places.T
    found[f"{name} force"] = muscle.force(c, p, d, r)
    found[f"{name} linear"] = np.stack(muscle.linearise(c, p, d, r), axis=1)
    found[f"{name} pressure"] = muscle.pressure_for(muscle.force(c, p, d), c, d)
    state = muscle.start(2e5, 0.0)
    held = []
    for x in [*np.linspace(0, 0.03, 31), *[0.03] * 5]:
        state, force = muscle.step(state, 2e5, x, 0.1)
        held.append(force)
    found[f"{name} held"] = held
np.savez(f"{folder}/found.npz", **found)
"""


@functools.cache
def whole(kind):
    return model(benches.MUSCLE, *(other() for other in hosts(kind)), kind())


@pytest.fixture(scope="module")
def runs():
    """The runs of the benches with the rates that steps between their samples have."""
    contraction = np.asarray(VISIBLE.contraction) * LENGTH / LENGTH
    given = VISIBLE.replace(contraction=jnp.asarray(contraction))
    steps = np.diff(np.asarray(given.time))
    rate = lambda a: jnp.asarray(np.pad(np.diff(np.asarray(a)) / steps, [(0, 0), (1, 0)]))  # noqa: E731
    return given.replace(rate=rate(given.contraction), pressure_rate=rate(given.pressure))


@pytest.fixture(scope="module")
def found(runs, tmp_path_factory):
    """What a stranger with nothing but numpy computes with the modules of all effects."""
    folder = tmp_path_factory.mktemp("modules")
    for kind in KINDS:
        (folder / f"{name_of(kind)}.py").write_text(python_module(whole(kind), "a test"))
    np.save(folder / "places.npy", PLACES)
    columns = {"time": runs.time, "displacement": runs.contraction * LENGTH, "pressure": runs.pressure}
    np.savez(folder / "runs.npz", **{name: np.asarray(a) for name, a in columns.items()})
    names = ",".join(name_of(kind) for kind in KINDS)
    done = subprocess.run([sys.executable, "-c", STRANGER, str(folder), names], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-3000:]
    return np.load(folder / "found.npz")


@every_kind
def test_stepping_along_a_run_gives_what_the_model_gives(kind, runs, found):
    given = whole(kind)
    expected = np.asarray(jax.jit(jax.vmap(given.force))(runs))[:, 1:]
    felt = jax.jit(jax.vmap(given.felt))(runs)
    moves = np.asarray(jax.vmap(jax.vmap(lambda s: path_rate(given.muscle, s)))(felt))[:, 1:] != 0
    stepped = np.array([found[f"{name_of(kind)} run {row}"] for row in range(len(expected))])
    rubs = any("friction" in effect.gives for effect in given.effects)
    at = moves if rubs else np.ones_like(moves)  # where it stands, friction keeps its direction
    assert at.mean() > 0.7
    np.testing.assert_allclose(stepped[at], expected[at], rtol=1e-9, atol=1e-9 * np.abs(expected).max())


@every_kind
def test_friction_holds_a_muscle_that_stands_as_it_was_moved(kind, found):
    held = found[f"{name_of(kind)} held"]
    resting = np.ptp(held[-4:])
    assert np.isfinite(held).all()
    if "friction" in kind.gives:
        assert resting == 0
        without = forces(whole(kind).drop(name_of(kind)), np.array([0.1]), np.array([2e5]), np.array([0.0]))
        assert held[-1] < without[0] - 0.1


@every_kind
def test_the_force_of_slow_motion_is_that_at_the_end_of_a_long_slow_run(kind, found):
    for row in (0, 1):
        end, pressure, direction, _ = PLACES[row]
        if direction < 0 and kind is Mullins:
            continue  # on the way back the run has stretched its rubber further
        time, contraction = benches.along((max(end - 0.28 * direction, -0.04), end), 1e-7, samples=400)
        expected = float(whole(kind).force(benches.run(time, contraction, np.full(400, pressure)))[-1])
        assert found[f"{name_of(kind)} force"][row] == pytest.approx(expected, rel=1e-6, abs=2e-4)


@every_kind
def test_slopes_are_those_of_the_force(kind, found):
    given, linear, slow = whole(kind), found[f"{name_of(kind)} linear"], PLACES[:, 3] == 0
    for column, step, sign in ((0, 1e-6, -1 / LENGTH), (1, 1.0, 1.0)):
        shift = np.eye(3)[column] * step
        ahead, behind = (forces(given, *(PLACES[:, :3] + way * shift).T) for way in (1, -1))
        slope = sign * (ahead - behind) / (2 * step)
        np.testing.assert_allclose(linear[slow, 1 + column], slope[slow], rtol=2e-5, atol=1e-6)


@every_kind
def test_the_pressure_for_a_force_gives_that_force(kind, found):
    np.testing.assert_allclose(found[f"{name_of(kind)} pressure"], PLACES[:, 1], rtol=1e-6)


@pytest.mark.parametrize("kind", LOOKS_BACK, ids=name_of)
def test_an_instrument_that_looks_back_is_refused_and_the_cure_is_said(kind):
    with pytest.raises(InputError, match=f"--without {name_of(kind)}"):
        python_module(whole(kind), "a test")


def test_every_memory_has_its_place_in_the_state():
    kinds = [kind for kind in LIBRARY if issubclass(kind, Memory)]
    others = {other for kind in kinds for other in hosts(kind)}
    given = model(benches.MUSCLE, *(other() for other in others), *(kind() for kind in kinds))
    assert [name.removesuffix("_memory") for name in memory_names(given)] == [
        name_of(e) for e in given.effects if isinstance(e, Memory)
    ]


# What jax traced, written down ---------------------------------------------------------------------------------------


def summed(x, y):
    return jax.lax.fori_loop(0, 5, lambda k, total: total + jnp.sin(k * x) / (1 + y**2), x)


def accumulated(x, y):
    last, rows = jax.lax.scan(lambda c, a: (c * x + a, c - a), y, jnp.arange(4.0) * x, reverse=True)
    return last + rows @ rows[::-1]


def chosen(x, y):
    return jax.lax.switch(jnp.where(x > 0, 1, 0) + (y > 0.5), [jnp.cos, jnp.exp, lambda a: a**3 - y], x * y)


def interpolated(x, y):
    return jnp.interp(x, jnp.array([0.0, 0.4, 1.0]), jnp.array([y, 2.0, y**-2]))


def halved(x, y):
    low_high = jax.lax.while_loop(
        lambda e: e[1] - e[0] > 1e-12,
        lambda e: jax.tree.map(lambda a, b: jnp.where(jnp.tanh(e.mean()) < y * 0.5, a, b),
                               jnp.stack([e.mean(), e[1]]), jnp.stack([e[0], e.mean()])),
        jnp.stack([-2.0 + 0 * x, 2.0 + x]),
    )  # fmt: skip
    return low_high[0]


def elementary(x, y):
    return jnp.hypot(x, y) + jnp.logaddexp(x, y) * jnp.arctan2(y, x) - jnp.clip(x, 0.1, 0.5) + jnp.sinc(x) + x % y


functions = [summed, accumulated, chosen, halved, elementary, jax.grad(elementary, 1)]


@pytest.mark.parametrize("function", functions)
def test_what_is_written_computes_what_jax_computes(function):
    source = numpy_source("f", lambda x, y: [function(x, y)], {"x": jnp.zeros(()), "y": jnp.ones(())})
    place = {"np": np}
    exec(source, place)  # the source is ours
    for x, y in ((0.3, 0.7), (0.9, 0.2), (-0.4, 1.3)):
        with np.errstate(all="ignore"):
            (written,) = place["f"](np.float64(x), np.float64(y))
        assert written == pytest.approx(float(function(x, y)), rel=1e-12)


def test_an_operation_that_numpy_does_not_have_is_refused_by_its_name():
    class Odd(Pulling):
        """A force through a special function."""

        def force(self, muscle, state):
            return jax.lax.lgamma(1 + state.contraction)

    with pytest.raises(UnknownOperation, match="lgamma"):
        numpy_source("f", lambda x: [jax.lax.lgamma(x)], {"x": jnp.zeros(())})
    with pytest.raises(InputError, match=r"'lgamma'.*--to table"):
        python_module(model(benches.MUSCLE, IdealCylinder(), Odd()), "")


# The command ---------------------------------------------------------------------------------------------------------

MODEL = """format = 1
[muscle]
length = "300 mm"
radius = "7 mm"
braid_angle = "20 deg"
[[effect]]
name = "ideal_cylinder"
[[effect]]
name = "coulomb_friction"
f_s = "0.02"
"""


def exported(folder, *arguments, more=""):
    (folder / "model.toml").write_text(MODEL + more)
    return CliRunner().invoke(main, ["export", str(folder / "model.toml"), *arguments])


def test_a_table_is_a_recording_of_points_that_the_program_reads_back(tmp_path):
    out = tmp_path / "static.csv"
    told = exported(tmp_path, "--to", "table", "--out", str(out), "--json", str(tmp_path / "t.json"))
    assert told.exit_code == 0, told.output
    sizes = MODEL.split("[[effect]]")[0].replace("format = 1", 'name = "t"')
    (tmp_path / "muscle.toml").write_text(f'{sizes}[[recording]]\nfile = "static.csv"\ntest = "static"\n')
    (run,) = read_experiment(tmp_path).recordings[0].runs
    assert len(run) == json.loads((tmp_path / "t.json").read_text())["rows"] == 51 * 11 * 2
    whole_model = model(benches.MUSCLE, IdealCylinder(), CoulombFriction(f_s=0.02))
    expected = forces(whole_model, run.contraction, run.pressure, run.branch.astype(float))
    np.testing.assert_allclose(run.measured, expected, rtol=1e-8, atol=1e-6)
    assert set(run.branch) == {-1, 1}


@pytest.mark.parametrize("form", ["table", "c"])
def test_what_instruments_add_to_the_muscle_is_said(tmp_path, form):
    """A controller pulls by the muscle's force, not by what a load cell with a wrong zero reads."""
    of_load_cell = '[[effect]]\nname = "force_offset"\nF_off = "3 N"\n'
    said = "what the instruments read, not what the muscle does alone: --without force_offset"
    for more, left_out in (("", ()), (of_load_cell, ()), (of_load_cell, ("--without", "force_offset"))):
        out = tmp_path / f"{form}{len(more)}{len(left_out)}"
        told = exported(tmp_path, "--to", form, "--out", f"{out}.{'h' if form == 'c' else 'csv'}", *left_out, more=more)
        assert told.exit_code == 0, told.output
        assert (said in " ".join(told.output.split())) is bool(more and not left_out)


def test_a_value_that_no_data_told_is_said(tmp_path):
    """A muscle for a simulation had two and a half times its friction, which was where the fit had begun."""
    creeps = (
        '[[effect]]\nname = "creep"\nK1 = {{value = "2 kN/m", state = "{}"}}\ntau = {{value = "3 s", state = "held"}}\n'
    )
    for state, left_out, said in (
        ("fitted", (), "this value, which is the starting value of the fit: creep.tau = 3 s."),
        ("held", (), "these values, which are starting values of the fit: creep.K1 = 2 N/mm, creep.tau = 3 s."),
        ("held", ("--without", "creep"), ""),
    ):
        out = tmp_path / f"{state}{len(left_out)}.h"
        told = exported(tmp_path, "--to", "c", "--out", str(out), *left_out, more=creeps.format(state))
        assert told.exit_code == 0, told.output
        words = " ".join(told.output.split())
        assert ("do not determine" in words) is bool(said)
        assert said in words


def test_a_table_may_be_parquet(tmp_path):
    pytest.importorskip("pyarrow")
    import pandas as pd

    out = tmp_path / "t.parquet"
    assert exported(tmp_path, "--to", "table", "--out", str(out), "--points", "3,2").exit_code == 0
    assert list(pd.read_parquet(out).columns) == ["pressure [kPa]", "contraction [1]", "branch", "force [N]"]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--to", "table", "--out", "model.toml"], "writes no '.toml' file"),
        (["--to", "python", "--out", "my-muscle.py"], "Python cannot import"),
        (["--to", "table", "--out", "t.csv", "--points", "5"], "two whole numbers"),
        (["--to", "table", "--out", "t.csv", "--pressure", "3 bar"], "a lower and an upper end"),
        (["--to", "python", "--out", "m.py", "--without", "coulomb"], "coulomb_friction"),
    ],
)
def test_what_cannot_be_exported_is_said_in_one_message(tmp_path, arguments, words, monkeypatch):
    monkeypatch.chdir(tmp_path)
    told = exported(tmp_path, *arguments)
    assert told.exit_code == 2
    assert words in told.output
    assert "Traceback" not in told.output


def test_a_file_that_is_there_is_left_alone(tmp_path):
    out = tmp_path / "muscle.py"
    out.write_text("mine")
    assert exported(tmp_path, "--to", "python", "--out", str(out)).exit_code == 2
    assert out.read_text() == "mine"


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--to", "table", "--contraction", "0,2"], "where no braided muscle goes"),
        (["--to", "table", "--pressure", "-3 bar,1 bar"], "below a vacuum"),
        (["--to", "python", "--out", "class.py"], "cannot import"),
        (["--to", "python", "--out", "json.py"], "cannot import"),
        (["--to", "python", "--out", "numpy.py"], "hides numpy"),
    ],
)
def test_what_nobody_could_use_is_not_written(tmp_path, monkeypatch, options, message):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "model.toml").write_text(
        '[muscle]\nlength = "300 mm"\nradius = "7 mm"\nbraid_angle = "20 deg"\n[[effect]]\nname = "ideal_cylinder"\n'
    )
    done = CliRunner().invoke(main, ["export", "model.toml", *options])
    assert done.exit_code == 2
    assert message in done.stderr
    assert [entry.name for entry in tmp_path.iterdir()] == ["model.toml"]
