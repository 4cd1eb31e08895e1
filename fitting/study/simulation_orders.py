"""From what was typed after `simulate` to courses of the rig."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from fitting import units
from fitting.errors import InputError
from fitting.recordings.experiment import kind_of
from fitting.recordings.records import FORCE_TESTS
from fitting.study.simulate import (
    Course,
    Told,
    isometric_courses,
    isotonic_courses,
    loop_courses,
    release_courses,
    static_courses,
    step_courses,
    write_data_set,
)
from fitting.study.stored_model import stored_model
from mckibben_jax.model import Model

STATIONS = "0,0.05,0.1,0.15,0.2,0.25"


def simulated(folder: Path, given: dict[str, Any]) -> Told:
    """Simulate what was asked for and write it."""
    test = kind_of(given["test"])
    whole, _ = stored_model(given)
    courses = _courses(test, whole, given)
    noise = None
    if given["noise"]:
        noise = units.to_si(given["noise"], "N" if test in FORCE_TESTS else "m", "--noise")
        check("--noise", [noise], given["noise"], 0.0)
    return write_data_set(folder, whole, test, courses, noise, given["seed"])


def _courses(test: str, whole: Model, given: dict[str, Any]) -> list[Course]:
    pressures = _list(given["pressure"], "Pa", "--pressure")
    check("--pressure", pressures, given["pressure"], -units.ATMOSPHERE)
    moving = test in ("quick release", "step")
    rate = units.to_si(given["rate"] or ("500 Hz" if moving else "50 Hz"), "1/s", "--rate")
    duration = units.to_si(given["duration"] or ("1 s" if moving else "5 s"), "s", "--duration")
    check("--rate", [rate], given["rate"], 0.0, itself=False)
    check("--duration", [duration], given["duration"], 0.0, itself=False)
    if test == "loop":
        speed = units.to_si(given["speed"], "m/s", "--speed")
        check("--speed", [speed], given["speed"], 0.0, itself=False)
        return loop_courses(whole.muscle, pressures, _list(given["turns"], "1", "--turns"), speed, rate)
    if test == "isometric":
        return isometric_courses(_list(given["contraction"] or "0", "1", "--contraction"), pressures, duration, rate)
    if test == "static":
        return static_courses(_list(given["contraction"] or STATIONS, "1", "--contraction"), pressures)
    loads = _list(given["load"], "N", "--load", units.load_to_si)
    check("--load", loads, given["load"], 0.0, itself=False)
    loaded = {"quick release": release_courses, "step": step_courses, "isotonic": isotonic_courses}
    return loaded[test](pressures, loads, duration, rate)


def check(what: str, values: Sequence[float], typed: Any, least: float, itself: bool = True) -> None:
    """Refuse what no rig can do: values (SI) below the least, or at it unless the least `itself` may be."""
    if min(values) < least or (min(values) == least and not itself):
        bound = "a vacuum" if least else "0"
        problem = f"{what} goes below {bound}" if itself else f"{what} is not above {bound}"
        raise InputError(problem, value=typed, cure="give what a rig can do")


def _list(text: str, unit: str, what: str, read: Callable[..., float] = units.to_si) -> list[float]:
    """Values separated by commas; a unit at the end stands for all that have none."""
    parts = [part.strip() for part in text.split(",") if part.strip()]
    if not parts:
        raise InputError(f"{what} is empty", cure=f"write for example {units.example(unit)}")
    last = units.split_value(parts[-1], what)[1]
    whole = [part if units.split_value(part, what)[1] else f"{part} {last}".strip() for part in parts]
    return [read(part, unit, what) for part in whole]
