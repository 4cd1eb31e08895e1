"""What a rig imposes in one run of each kind of test: contraction or load, and pressure, over time."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fitting.errors import InputError
from fitting.study.settings import STUDY
from mckibben_jax.muscle import Muscle


@dataclass(frozen=True)
class Course:
    """What the rig imposes in one run; SI. Either the contraction is imposed, or the load."""

    time: np.ndarray
    pressure: np.ndarray
    contraction: np.ndarray | None = None
    load: float | None = None
    direction: np.ndarray | None = None  # of points without history: 1 contracting, -1 elongating


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


def static_courses(contractions: Sequence[float], pressures: Sequence[float]):
    """Every contraction at every pressure, reached contracting and reached elongating."""
    grid = [(c, p, sign) for sign in (1, -1) for p in pressures for c in contractions]
    contraction, pressure, direction = np.array(grid, float).T
    return [Course(np.arange(float(len(grid))), pressure, contraction, direction=direction)]


def release_courses(pressures: Sequence[float], loads: Sequence[float], duration: float, rate: float):
    """One run for each load: let go at t = 0 under a constant pressure."""
    time = _clock(duration, rate)
    return [Course(time, np.full_like(time, p), None, load) for p in pressures for load in loads]


def step_courses(pressures: Sequence[float], loads: Sequence[float], duration: float, rate: float):
    """One run for each load: from the first pressure to the second at t = 0."""
    if len(pressures) != 2:
        raise InputError("a step needs two pressures", cure="for example --pressure '1 bar,4 bar'")
    time = _clock(duration, rate) - 0.1 * duration
    return [Course(time, np.where(time < 0, *pressures), None, load) for load in loads]


def isotonic_courses(pressures: Sequence[float], loads: Sequence[float], duration: float, rate: float):
    """Pressure from value to value, each ramp in `duration` seconds, under each load."""
    ramps = isometric_courses([0.0], pressures, duration, rate)
    return [Course(ramp.time, ramp.pressure, None, load) for load in loads for ramp in ramps]


def _clock(duration: float, rate: float) -> np.ndarray:
    count = int(np.floor(duration * rate + 1e-9)) + 1
    if not 5 <= count <= STUDY.samples:
        raise InputError(f"a run would have {count} samples", cure="change --rate or --duration")
    return np.arange(count) / rate
