"""A data set from a model: what a rig would have recorded."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import tomlkit

from fitting import showing
from fitting.errors import InputError
from fitting.problem.points import clock, from_behind, twice
from fitting.recordings.experiment import kind_of
from fitting.recordings.records import FORCE_TESTS
from fitting.recordings.settings import CYCLES, TABLES
from fitting.study.courses import (
    Course,
    isometric_courses,
    isotonic_courses,
    loop_courses,
    release_courses,
    static_courses,
    step_courses,
)
from fitting.study.settings import STUDY
from fitting.version import program_version
from fitting.writing import write_text
from mckibben_jax.model import Model
from mckibben_jax.muscle import quantities
from mckibben_jax.state import State


@dataclass(frozen=True)
class SimulatedData:
    """What was written: the file, how many samples it has, and what its reader should know."""

    file: Path
    samples: int
    warnings: tuple[str, ...]
    test: str
    courses: tuple[Course, ...]  # what was imposed, run by run


def simulate(
    model: Model,
    folder: str | Path,
    test: str = "loop",
    *,
    pressures: Sequence[float] = (3e5,),
    turns: Sequence[float] = (0.0, 0.2, 0.0),
    speed: float = 0.01,
    contractions: Sequence[float] | None = None,
    loads: Sequence[float] = (100.0,),
    duration: float | None = None,
    rate: float | None = None,
    noise: float | None = None,
    seed: int = 0,
) -> SimulatedData:
    """Write the data set that a rig would record if the muscle were as the model says: muscle.toml and one CSV.

    `test` is one of the six kinds. All in SI: `pressures` (each in turn; from value to value in isometric and isotonic
    tests; before and after in a step), `turns` and `speed` of loops, held `contractions` (isometric, static), `loads`
    (isotonic, release, step), `duration` of a ramp, release or step, `rate` of samples, `noise` of one reading (N, or m
    where a load is imposed). InputError where a file is there already, or no rig can do it.
    """
    test = kind_of(test)
    moving = test in ("quick release", "step")
    rate, duration = rate or (500.0 if moving else 50.0), duration or (1.0 if moving else 5.0)
    if test == "loop":
        courses = loop_courses(model.muscle, pressures, turns, speed, rate)
    elif test == "isometric":
        courses = isometric_courses((0.0,) if contractions is None else contractions, pressures, duration, rate)
    elif test == "static":
        courses = static_courses(STUDY.stations if contractions is None else contractions, pressures)
    else:
        loaded = {"quick release": release_courses, "step": step_courses, "isotonic": isotonic_courses}
        courses = loaded[test](pressures, loads, duration, rate)
    return write_data_set(Path(folder), model, test, courses, noise, seed)


def record_course(model: Model, course: Course, test: str) -> np.ndarray:
    """What the instrument shows along a course: force in N, or shortening in m where a load is imposed."""
    if course.contraction is None:
        return np.asarray(_MOVED[test](model, course)) * float(model.muscle.length)
    force = np.asarray(_force(model, _imposed(course)))
    return force if course.direction is None else force[1::2]  # behind every point stands the way to it


@eqx.filter_jit
def _force(model: Model, states: State) -> jax.Array:
    """Compiled once for all values of a model's parameters."""
    return model.force(states)


def _imposed(course: Course) -> State:
    contraction, pressure = course.contraction, course.pressure
    assert contraction is not None
    if course.direction is not None:
        time, pressure, rate = clock(len(course.time)), twice(pressure), CYCLES.at_rest * twice(course.direction)
        contraction, rise = from_behind(contraction, course.direction), np.zeros_like(pressure)
    else:
        time, (rate, rise) = course.time, (np.gradient(values, course.time) for values in (contraction, pressure))
        rate = np.where(np.abs(rate) > 1e-12, rate, 0.0)  # a held length is held
    zero = jnp.zeros(len(time))
    given = (jnp.asarray(values) for values in (contraction, pressure, rate, rise, zero, zero, time))
    return State(*given)


def _released(model: Model, course: Course) -> jax.Array:
    from mckibben_jax.motion.motion import release

    return release(model, load=course.load, pressure=jnp.asarray(course.pressure), times=course.time)


def _stepped(model: Model, course: Course) -> jax.Array:
    from mckibben_jax.motion.motion import step_response

    start = _hung(model, course)
    return step_response(model, load=course.load, pressure=course.pressure, times=course.time, start=start)


def _swept(model: Model, course: Course) -> jax.Array:
    from mckibben_jax.motion.isotonic import swept

    states = State(*(jnp.asarray(values) for values in (0 * course.time, course.pressure)), time=course.time)
    zero = jnp.zeros(len(course.time))
    states = states.replace(rate=zero, pressure_rate=jnp.gradient(states.pressure, states.time), stretch=zero,
                            stretch_rate=zero)  # fmt: skip
    return eqx.filter_jit(swept)(model, states, course.load, _hung(model, course))


def _hung(model: Model, course: Course) -> jax.Array:
    """Where the load hangs before anything moves: where the pull without friction carries it."""
    from mckibben_jax.motion.isotonic import standing

    return eqx.filter_jit(standing)(model, course.pressure[0], course.load)


_MOVED: dict[str, Callable[[Model, Course], jax.Array]] = {
    "quick release": _released, "step": _stepped, "isotonic": _swept,
}  # fmt: skip


def beyond_stroke(model: Model, courses: Sequence[Course], positions: Sequence[np.ndarray]) -> tuple[str, ...]:
    """A warning where the muscle would have to push, or the load is too heavy for it."""
    contraction = np.concatenate(positions)
    pressure = np.concatenate([course.pressure for course in courses])
    pull = np.asarray(eqx.filter_jit(jax.vmap(lambda c, p: _resting_pull(model, c, p)))(contraction, pressure))
    straight = 1 - 1 / np.cos(float(model.muscle.braid_angle))
    told = []
    pushes = (pull < 0) & (pressure > 0)
    if pushes.any():
        at = int(np.flatnonzero(pushes)[np.argmin(contraction[pushes])])
        told.append(
            f"beyond the end of the stroke in {np.count_nonzero(pushes):,} of {len(pushes):,} samples, from "
            f"contraction {contraction[at]:.3g} at {showing.show(pressure[at], 'Pa')}: there the muscle would push, "
            "which no rig that pulls a cord records"
        )
    if courses[0].load is not None and (contraction < straight + 1e-6).any():
        told.append("a load is too heavy: it pulls the strands straight, and the muscle hangs on them")
    return tuple(told)


def _resting_pull(model: Model, contraction: jax.Array, pressure: jax.Array) -> jax.Array:
    state = State(contraction, pressure)
    memories = model.start_memories(state)
    return model.pull(model.felt_now(state, memories), memories)[0]


# ------------------------------------------------------------------------------------------------------------- writing


def write_data_set(
    folder: Path, model: Model, test: str, courses: Sequence[Course], noise: float | None, seed: int
) -> SimulatedData:
    """Write muscle.toml and one CSV; files that are there already are left alone, with an error that says so."""
    file = folder / f"{test.replace(' ', '_')}.csv"
    for path in (folder / "muscle.toml", file, band_file(file), models_file(file)):
        if path.exists():
            raise InputError("the file is there already and is left alone", path, cure="name another folder")
    clean = [record_course(model, course, test) for course in courses]
    if not all(np.isfinite(shown).all() for shown in clean):
        raise InputError("the model gives no finite number there", cure="ask for a smaller contraction or load")
    positions = [_position(model, *both) for both in zip(courses, clean, strict=True)]
    for course, position in zip(courses, positions, strict=True):
        if not (TABLES.contractions[0] <= position.min() and position.max() <= TABLES.contractions[1]):
            what = "" if course.load is None else f" under {showing.show(course.load, 'N')}"
            problem = f"the muscle would go to contraction {position[np.argmax(np.abs(position))]:.3g}{what}"
            cure = "ask for turning points from -0.2 to 0.6" if course.load is None else "another --load or --pressure"
            raise InputError(f"{problem}, where no braided muscle goes", cure=cure)
    warnings = beyond_stroke(model, courses, positions)
    scatter = np.random.default_rng(seed)
    parts = []
    for number, (course, shown) in enumerate(zip(courses, clean, strict=True)):
        read = shown + scatter.normal(0.0, noise, len(shown)) if noise else shown
        parts += _rows(number, model, course, read)
    folder.mkdir(parents=True, exist_ok=True)
    write_text(file, "\n".join([_head(model, test, courses[0]), *parts]) + "\n")
    write_text(folder / "muscle.toml", _muscle_file(folder, model, test, file.name, noise))
    return SimulatedData(file, len(parts), warnings, test, tuple(courses))


def band_file(file: Path) -> Path:
    """Where the band of a simulated recording stands."""
    return file.with_name(f"{file.stem}_band.csv")


def models_file(file: Path) -> Path:
    """Where what several models say of a simulated recording stands."""
    return file.with_name(f"{file.stem}_models.csv")


def _position(model: Model, course: Course, shown: np.ndarray) -> np.ndarray:
    """Contraction along a course, imposed or found."""
    return shown / float(model.muscle.length) if course.contraction is None else course.contraction


def _head(model: Model, test: str, course: Course) -> str:
    supplied = any(e.family == "supply" or getattr(e, "channel", "") == "pressure" for e in model.effects)
    pressure = "set_pressure [kPa]" if test == "step" and supplied else "pressure [kPa]"
    last = "load [N]" if course.contraction is None else "force [N]"
    names = ["run", "time [s]", pressure, "displacement [mm]", last]
    return ",".join(names if course.direction is None else [*names, "branch"])


def _rows(number: int, model: Model, course: Course, shown: np.ndarray) -> list[str]:
    if course.contraction is None:
        way, last = shown, np.full_like(shown, course.load)
    else:
        way, last = course.contraction * float(model.muscle.length), shown
    columns = zip(course.time, course.pressure / 1e3, way * 1e3, last, strict=True)
    rows = [f"{number},{t:.6g},{p:.9g},{x:.9g},{f:.9g}" for t, p, x, f in columns]
    if course.direction is None:
        return rows
    names = np.where(course.direction > 0, "contraction", "elongation")
    return [f"{row},{name}" for row, name in zip(rows, names, strict=True)]


def _muscle_file(folder: Path, model: Model, test: str, file: str, noise: float | None) -> str:
    document = tomlkit.document()
    document["name"] = folder.resolve().name
    sizes = tomlkit.table()
    for name, (unit, _) in quantities().items():
        value = getattr(model.muscle, name)
        if value is not None:
            sizes[name] = showing.write(float(value), unit)
    document["muscle"] = sizes
    recording = tomlkit.table()
    recording.update({"file": file, "test": test})
    if noise:
        recording["noise"] = showing.write(noise, "N" if test in FORCE_TESTS else "m")
    recordings = tomlkit.aot()
    recordings.append(recording)
    document["recording"] = recordings
    source = tomlkit.table()
    source["citation"] = f"Simulated with mckibben_jax {program_version()}: {' + '.join(model.names)}"
    document["source"] = source
    return tomlkit.dumps(document)
