"""From what was typed after `simulate` to courses of the rig."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from fitting import units
from fitting.errors import InputError
from fitting.model_file import read_model
from fitting.muscle_file import read_muscle
from fitting.own_effects import library
from fitting.recordings import kind_of
from fitting.simulate import (
    Course,
    isometric_courses,
    loaded_courses,
    loop_courses,
    step_courses,
    write_data_set,
)
from mckibben_jax.model import Model, model


def simulated(folder: Path, given: dict[str, Any]) -> tuple[Path, int]:
    """Simulate what was asked for and write it; the file, and how many samples it has."""
    test = kind_of(given["test"])
    whole = _model(given)
    courses = _courses(test, whole, given)
    noise = None
    if given["noise"]:
        noise = units.to_si(given["noise"], "N" if test in ("loop", "isometric") else "m", "--noise")
    file = write_data_set(folder, whole, test, courses, noise, given["seed"])
    return file, sum(len(course.time) for course in courses)


def _model(given: dict[str, Any]) -> Model:
    stored = read_model(given["model"], library(given["effect_file"]))
    muscle = read_muscle(given["muscle"])[0] if given["muscle"] else stored.muscle
    if muscle is None:
        raise InputError("the model file has no [muscle]", stored.path, cure="add --muscle muscle.toml")
    return model(muscle, *stored.effects)


def _courses(test: str, whole: Model, given: dict[str, Any]) -> list[Course]:
    pressures = _list(given["pressure"], "Pa", "--pressure")
    moving = test in ("quick release", "step")
    rate = units.to_si(given["rate"] or ("500 Hz" if moving else "50 Hz"), "1/s", "--rate")
    duration = units.to_si(given["duration"] or ("1 s" if moving else "5 s"), "s", "--duration")
    if test == "loop":
        speed = units.to_si(given["speed"], "m/s", "--speed")
        return loop_courses(whole.muscle, pressures, _list(given["turns"], "1", "--turns"), speed, rate)
    if test == "isometric":
        return isometric_courses(_list(given["contraction"], "1", "--contraction"), pressures, duration, rate)
    loads = _list(given["load"], "N", "--load", units.load_to_si)
    if test == "quick release":
        return loaded_courses(pressures, loads, duration, rate)
    if test == "step":
        return step_courses(pressures, loads, duration, rate)
    raise InputError(f"a '{test}' test is not simulated", cure="simulate a loop, isometric, quick release or step")


def _list(text: str, unit: str, what: str, read: Callable[..., float] = units.to_si) -> list[float]:
    """Values separated by commas; a unit at the end stands for all that have none."""
    parts = [part.strip() for part in text.split(",") if part.strip()]
    if not parts:
        raise InputError(f"{what} is empty", cure=f"write for example {units.example(unit)}")
    last = units.split_value(parts[-1], what)[1]
    whole = [part if units.split_value(part, what)[1] else f"{part} {last}".strip() for part in parts]
    return [read(part, unit, what) for part in whole]
