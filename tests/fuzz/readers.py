"""The readers, each with good inputs and with what its result must be."""

import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import jax
import numpy as np

from fitting.designs.file import read_design
from fitting.designs.sweep_file import read_sweep
from fitting.errors import InputError
from fitting.library.library import library
from fitting.library.line import effect_from_line
from fitting.model_files.model_file import read_model
from fitting.posterior.store import Store
from fitting.recordings.experiment import read_experiment, read_muscle, read_recording
from tests.design_texts import BRAID, BREAKING, FORCE, KNOWN, MINIMUM, RUBBER, WALL, stroke

jax.config.update("jax_enable_x64", True)

FOLDER = Path(tempfile.mkdtemp(prefix="mckibben_fuzz_"))
LIBRARY = library()
MUSCLE = """name = "Braid"
[muscle]
length = "300 mm"
radius = "7.0 +/- 0.1 mm"
braid_angle = "20 +/- 0.5 deg"
"""
MORE_MUSCLE = """wall_thickness = "1.8 +/- 0.2 mm"
wall_outside = "0.9 mm"
hardness = "45 IRHD"
strand_poisson = 0.3
[[recording]]
file = "data.csv"
test = "loop"
noise = "0.5 N"
columns = { force = "F [N]" }
units = { pressure = "bar" }
valid = { force = ["-10 N", "5 kN"] }
pressure = "absolute"
force_sign = 1
position_sign = 1
position_at_rest = "0 %"
[recording.accuracy]
pressure = { noise = "150 Pa", resolution = "0.1 kPa", zero = "0.5 kPa", gain = "0.25 %", zero_per_run = "0 Pa" }
force = { noise = "0.5 N", zero_per_run = "0.6 N", gain_per_run = "0.2 %", hysteresis = "0.05 %", drift = "5 N/h" }
length = { noise = "0.01 mm", gain = "0.1 %" }
time = { skew = "5 ms" }
[source]
licence = "CC0"
"""
MODEL = """format = 1
program = "0.1.0"
name = "Braid"
[muscle]
length = { value = "300 mm", state = "fixed" }
radius = { value = "7.02 mm", error = "0.02 mm", state = "fitted" }
braid_angle = { value = "20 deg", state = "held" }
[[effect]]
name = "ideal_cylinder"
[[effect]]
name = "tip"
k = { value = "1.12", error = "0.01", state = "fitted" }
[[effect]]
name = "coulomb_friction"
f_s = "0.012"
[[effect]]
name = "screw"
define = "screw = A*sin(2*pi*x/p), A = 1 N (-20..20), p = 12 mm (5..30)"
A = "2 N"
[fitted_to]
data = { "rayon20" = "sha256:00ff" }
"""
DESIGN = "seed = 3\n" + KNOWN + WALL + BREAKING + RUBBER + BRAID + FORCE + MINIMUM + stroke("20 %")
SWEEP = (
    DESIGN
    + """[sample]
n = 1000
outputs = ["force", "stroke", { quantity = "work", at = { pressure = "4 bar" }, name = "w4" }]
keep = { best = 10, by = "force" }
histogram = { of = "force", bins = 10, from = "0 N", to = "500 N" }
"""
)
GRID = (
    DESIGN
    + """[grid]
braid_angle = { from = "15 deg", to = "40 deg", n = 10 }
radius = { from = "5 mm", to = "9 mm", n = 10 }
outputs = ["force"]
keep = "all"
"""
)
LINES = (
    "screw = A*sin(2*pi*x/p), A = 1 N (-20..20), p = 12 mm (5..30)",
    "drag = -B*v, B = 5 N s/m (0..99)",
    "spring = K*max(x - x0, 0)**1.5, K = 3 N/m^1.5 (0..1e3), x0 = 5 mm",
    "odd = c*P*S*tanh(v/w)/(1 + abs(eps))^2, c = 0.01 (0..1), w = 3 mm/s (1..9)",
)


def _table(head: str, rows: np.ndarray, separator: str = ",", decimal: str = ".") -> bytes:
    lines = [separator.join(f"{cell:.6g}".replace(".", decimal) for cell in row) for row in rows]
    return ("\n".join([head.replace(",", separator), *lines]) + "\n").encode()


def _loops() -> np.ndarray:
    phase = np.arange(40)
    eps = 0.1 * (1 - np.cos(2 * np.pi * phase / 20))
    return np.stack([0.1 * phase, 2 + 0 * phase, 100 * eps, 200 - 800 * eps], axis=1)


LOOP_HEAD = "time [s],pressure [bar],contraction [%],force [N]"
LOOPS = _table(LOOP_HEAD, _loops())
CLOCK = np.arange(-3, 20)
STEP = np.stack([CLOCK * 0.01, np.full(23, 3.0), np.clip(CLOCK, 0, 99) * 3.0, np.full(23, 20)], axis=1)
SWEPT = np.r_[5:405:20, 405:5:-20]
HELD = np.stack([np.arange(40) * 0.1, SWEPT, np.full(40, 290), SWEPT / 2], axis=1)
LIFTED = np.c_[HELD[:, :2], HELD[:, 1] / 9, np.full(40, 9)]
STATIC = np.array([[100, 0.0, 200], [200, 0.1, 250], [200, 0.0, 420], [300, 0.1, 390], [300, 0.2, 150]])
TABLES = {
    "loop": (LOOPS, _table(LOOP_HEAD, _loops(), ";", ","), b"run," + LOOPS.replace(b"\n", b"\n1,").removesuffix(b"1,")),
    "isometric": (_table("time [s],pressure [kPa],length [mm],force [N]", HELD),),
    "static": (_table("pressure [kPa],contraction [1],force [N]", STATIC),),
    "quick release": (_table("time [s],pressure [bar],displacement [mm],load [kg]", STEP),),
    "step": (_table("time [s],set_pressure [bar],displacement [mm],load [kg]", STEP),),
    "isotonic": (_table("time [s],pressure [kPa],displacement [mm],load [kg]", LIFTED),),
}


@dataclass(frozen=True)
class Reader:
    """A reader of bytes; `good` inputs are read without a refusal, and damaged ones are made from them."""

    name: str
    good: tuple[bytes, ...]
    read: Callable[[bytes], Any]
    tree: bool = False  # whether inputs are TOML


def refusal(reader: Reader, content: bytes) -> InputError | None:
    """Read; the refusal, if it is one, is checked to be one line that names a cure."""
    try:
        reader.read(content)
    except InputError as error:
        refused = error
    else:
        return None
    said = str(refused)
    assert refused.cure, f"no cure: {said}"
    assert refused.problem, f"no problem: {said}"
    assert said.isprintable(), f"steers the screen: {said!r}"
    assert len(said) < 2500, f"{len(said)} characters"
    return refused


def _at(name: str, content: bytes) -> Path:
    path = FOLDER / name
    path.write_bytes(content)
    return path


def _reads_table(content: bytes) -> Any:
    """The first line says which kind of test: so one reader covers all of them."""
    kind, _, table = content.partition(b"\n")
    test = kind.decode("latin-1")
    if test not in TABLES:
        raise InputError("no test", cure="a mutation of the first line")
    recording = read_recording(_at("one.csv", table), test, _muscle(), {})
    for run in recording.runs:
        for values in (run.time, run.pressure, run.contraction, run.measured, run.rate):
            assert np.isfinite(values[run.weight > 0]).all(), "a reading that counts is not finite"
    return recording


def _muscle() -> Any:
    if not hasattr(_muscle, "found"):
        _muscle.found = read_muscle(_at("fixed_muscle.toml", MUSCLE.encode()))[0]
    return _muscle.found


def _reads_data_set(content: bytes) -> Any:
    _at("data.csv", LOOPS.replace(b"pressure [bar]", b"pressure").replace(b"force [N]", b"F [N]"))
    _at("muscle.toml", content)
    return read_experiment(FOLDER)


def _reads_chains(content: bytes) -> Any:
    store = Store(_at("chains.sqlite", content), "run")
    return store.frame(), store.blocks()


def _chains() -> bytes:
    path = FOLDER / "good.sqlite"
    store = Store(path, "run")
    store.begin({"centre": np.arange(3.0), "names": np.array(["a", "b", "c"])})
    for number in range(2):
        store.append(number, {"chain": np.random.default_rng(number).normal(size=(2, 3, 4))})
    return path.read_bytes()


def _readers() -> dict[str, Reader]:
    known = dict(LIBRARY)
    tables = tuple(test.encode() + b"\n" + table for test, found in TABLES.items() for table in found)
    texts = [
        Reader("csv", tables, _reads_table),
        Reader("muscle", ((MUSCLE + MORE_MUSCLE).encode(),), _reads_data_set, tree=True),
        Reader("model", (MODEL.encode(),), lambda text: read_model(_at("model.toml", text), known), tree=True),
        Reader("define", tuple(map(str.encode, LINES)), lambda line: effect_from_line(line.decode("utf-8", "replace"))),
        Reader("design", (DESIGN.encode(),), lambda text: read_design(_at("design.toml", text), known), tree=True),
        Reader(
            "sweep", (SWEEP.encode(), GRID.encode()), lambda text: read_sweep(_at("sweep.toml", text), known), tree=True
        ),
        Reader("chains", (_chains(),), _reads_chains),
    ]
    return {reader.name: reader for reader in texts}


READERS = _readers()
