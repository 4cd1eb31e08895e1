"""Tests in which the position is measured: where each run begins, and what a model says of it."""

import math
from typing import TYPE_CHECKING

import jax
import numpy as np

from fitting.reading import motion_signals as signals
from fitting.records import FORCE_TESTS, Recording, Run
from mckibben_jax.model import Model
from mckibben_jax.state import State

if TYPE_CHECKING:
    from fitting.residuals import Block

MOST_STEPS = 8000  # of one run: a longer one takes longer steps
FEWEST_AT_REST = 3


def predicted(block: "Block", model: Model) -> jax.Array:
    """The shortening that the instrument would show at every sample of a recording, (runs, time), m."""
    from mckibben_jax.isotonic import swept  # optimistix and diffrax are only needed where something moves
    from mckibben_jax.motion import moved, released

    length = model.muscle.length
    shift = block.stated_length - length if block.position == "length" else 0.0

    def run(states: State, load: jax.Array, start: jax.Array) -> jax.Array:
        begin = (start - shift) / length
        if block.test == "quick release":
            contraction = released(model, states, load, steps=block.steps)
        elif block.test == "step":
            contraction = moved(model, states, load, begin, steps=block.steps).contraction
        else:
            contraction = swept(model, states, load, begin)
        return model.show(length * contraction + shift, states.time, "position")

    assert block.start is not None  # every recording of a position has one
    return jax.vmap(run)(block.states, block.load, block.start)


def starts(recording: Recording) -> np.ndarray:
    """Position (m) at which each run begins, as measured; nothing is asked of force tests and releases."""
    begins = {"step": _at_rest, "isotonic": _first}.get(recording.test, lambda _: 0.0)
    return np.array([begins(run) for run in recording.runs])


def _at_rest(run: Run) -> float:
    """Mean position until the pressure moves."""
    jitter = 1.5 * float(np.median(np.abs(np.diff(run.pressure))))
    away = np.abs(run.pressure - run.pressure[0]) > max(6 * jitter, 0.01 * float(np.ptp(run.pressure)))
    still = int(np.argmax(away)) if away.any() else len(run)
    return float(np.mean(run.measured[:still])) if still >= FEWEST_AT_REST else _first(run)


def _first(run: Run) -> float:
    """The first position, from a straight line through the first readings of the run."""
    count = min(max(len(run) // 100, signals.FEWEST), len(run))
    line = np.polynomial.Polynomial.fit(run.time[:count], run.measured[:count], 1)
    return float(line(run.time[0]))


def steps_of(recording: Recording) -> int:
    """Steps of integration that the longest run needs; 0 where nothing is integrated."""
    from mckibben_jax.motion import STEP

    if recording.test in (*FORCE_TESTS, "isotonic"):
        return 0
    begin = (lambda run: 0.0) if recording.test == "quick release" else (lambda run: float(run.time[0]))
    longest = max(float(run.time[-1]) - begin(run) for run in recording.runs)
    return int(np.clip(math.ceil(longest / STEP - 1e-9), 1, MOST_STEPS))
