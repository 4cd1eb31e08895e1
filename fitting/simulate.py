"""A data set from a model: what a rig would have recorded."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import tomlkit

from fitting import units
from fitting.errors import InputError
from fitting.program import program_version
from mckibben_jax.model import Model
from mckibben_jax.muscle import Muscle, quantities
from mckibben_jax.state import State

MOST_SAMPLES = 2_000_000


@dataclass(frozen=True)
class Course:
    """What the rig imposes in one run; SI. Either the contraction is imposed, or the load."""

    time: np.ndarray
    pressure: np.ndarray
    contraction: np.ndarray | None = None
    load: float | None = None


def loop_courses(muscle: Muscle, pressures: Sequence[float], turns: Sequence[float], speed: float, rate: float):
    """From turning point to turning point at one speed (m/s), at each pressure in turn."""
    if len(turns) < 2:
        raise InputError("a loop needs at least two turning points", value=turns, cure="for example --turns 0,0.2,0")
    way = np.abs(np.diff(turns)) * float(muscle.length)
    corners = np.concatenate([[0.0], np.cumsum(way / speed)])
    time = _clock(corners[-1], rate)
    contraction = np.interp(time, corners, turns)
    return [Course(time, np.full_like(time, p), contraction) for p in pressures]


def isometric_courses(contractions: Sequence[float], pressures: Sequence[float], duration: float, rate: float):
    """Pressure from value to value, each ramp in `duration` seconds, at each held contraction."""
    if len(pressures) < 2:
        raise InputError("an isometric test needs two pressures", cure="for example --pressure '0 bar,5 bar,0 bar'")
    corners = duration * np.arange(len(pressures))
    time = _clock(corners[-1], rate)
    return [Course(time, np.interp(time, corners, pressures), np.full_like(time, c)) for c in contractions]


def loaded_courses(pressures: Sequence[float], loads: Sequence[float], duration: float, rate: float):
    """One run for each load: let go at t = 0 under a constant pressure."""
    time = _clock(duration, rate)
    return [Course(time, np.full_like(time, p), None, load) for p in pressures for load in loads]


def step_courses(pressures: Sequence[float], loads: Sequence[float], duration: float, rate: float):
    """One run for each load: from the first pressure to the second at t = 0."""
    if len(pressures) != 2:
        raise InputError("a step needs two pressures", cure="for example --pressure '1 bar,4 bar'")
    time = _clock(duration, rate) - 0.1 * duration
    return [Course(time, np.where(time < 0, *pressures), None, load) for load in loads]


def _clock(duration: float, rate: float) -> np.ndarray:
    count = int(np.floor(duration * rate + 1e-9)) + 1
    if not 5 <= count <= MOST_SAMPLES:
        raise InputError(f"a run would have {count} samples", cure="change --rate or --duration")
    return np.arange(count) / rate


def recorded(model: Model, course: Course) -> np.ndarray:
    """What the instrument shows along a course: force in N, or shortening in m where a load is imposed."""
    if course.contraction is None:
        return _moved(model, course)
    slope = lambda values: np.gradient(values, course.time)  # noqa: E731
    rate = np.where(np.abs(slope(course.contraction)) > 1e-12, slope(course.contraction), 0.0)
    zero = jnp.zeros(len(course.time))
    run = State(
        jnp.asarray(course.contraction), jnp.asarray(course.pressure), jnp.asarray(rate),
        jnp.asarray(slope(course.pressure)), zero, zero, jnp.asarray(course.time),
    )  # fmt: skip
    return np.asarray(eqx.filter_jit(lambda whole, states: whole.force(states))(model, run))


def _moved(model: Model, course: Course) -> np.ndarray:
    from mckibben_jax.motion import release, step_response

    if course.time[0] < 0:
        start = step_response(
            model, load=course.load, pressure=jnp.full(2000, course.pressure[0]), times=np.linspace(0, 20, 2000)
        )[-1]
        found = step_response(model, load=course.load, pressure=course.pressure, times=course.time, start=start)
    else:
        found = release(model, load=course.load, pressure=jnp.asarray(course.pressure), times=course.time)
    return np.asarray(found) * float(model.muscle.length)


# ------------------------------------------------------------------------------------------------------------- writing


def write_data_set(
    folder: Path, model: Model, test: str, courses: Sequence[Course], noise: float | None, seed: int
) -> Path:
    """Write muscle.toml and one CSV; files that are there already are left alone, with an error that says so."""
    file = folder / f"{test.replace(' ', '_')}.csv"
    for path in (folder / "muscle.toml", file):
        if path.exists():
            raise InputError("the file is there already and is left alone", path, cure="name another folder")
    scatter = np.random.default_rng(seed)
    parts = []
    for number, course in enumerate(courses):
        shown = recorded(model, course)
        if not np.all(np.isfinite(shown)):
            raise InputError("the model gives no finite number there", cure="ask for a smaller contraction or load")
        shown = shown + scatter.normal(0.0, noise, len(shown)) if noise else shown
        parts += _rows(number, model, course, shown)
    folder.mkdir(parents=True, exist_ok=True)
    force = courses[0].contraction is not None
    head = "run,time [s],pressure [kPa],displacement [mm]," + ("force [N]" if force else "load [N]")
    file.write_text("\n".join([head, *parts]) + "\n", encoding="utf-8")
    (folder / "muscle.toml").write_text(_muscle_file(folder, model, test, file.name, noise), encoding="utf-8")
    return file


def _rows(number: int, model: Model, course: Course, shown: np.ndarray) -> list[str]:
    if course.contraction is None:
        way, last = shown, np.full_like(shown, course.load)
    else:
        way, last = course.contraction * float(model.muscle.length), shown
    columns = zip(course.time, course.pressure / 1e3, way * 1e3, last, strict=True)
    return [f"{number},{t:.6g},{p:.6g},{x:.6g},{f:.7g}" for t, p, x, f in columns]


def _muscle_file(folder: Path, model: Model, test: str, file: str, noise: float | None) -> str:
    document = tomlkit.document()
    document["name"] = folder.resolve().name
    sizes = tomlkit.table()
    for name, (unit, _) in quantities().items():
        value = getattr(model.muscle, name)
        if value is not None:
            sizes[name] = units.write(float(value), unit)
    document["muscle"] = sizes
    recording = tomlkit.table()
    recording.update({"file": file, "test": test})
    if noise:
        recording["noise"] = units.write(noise, "N" if test in ("loop", "isometric") else "m")
    recordings = tomlkit.aot()
    recordings.append(recording)
    document["recording"] = recordings
    source = tomlkit.table()
    source["citation"] = f"Simulated with mckibben_jax {program_version()}: {' + '.join(model.names)}"
    document["source"] = source
    return tomlkit.dumps(document)
