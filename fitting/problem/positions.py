"""Tests in which the position is measured: where each run begins, and what a model says of it."""

import math
from typing import TYPE_CHECKING

import jax
import numpy as np

from fitting.problem.block import Block
from fitting.recordings import motion_signals as signals
from fitting.recordings.records import FORCE_TESTS, MOVING_TESTS, Recording, Run
from mckibben_jax.model import Model
from mckibben_jax.state import State

if TYPE_CHECKING:
    from mckibben_jax.motion.motion import Moved, Nodes

MOST_STEPS = 8000  # of one run: a longer one takes longer steps
FEWEST_AT_REST = 3


def predict_positions(block: Block, model: Model) -> jax.Array:
    """The shortening that the instrument would show at every sample of a recording, (runs, time), m."""
    from mckibben_jax.motion.isotonic import swept  # optimistix and diffrax are only needed where something moves

    length, shift = model.muscle.length, block.counts_from(model.muscle.length)

    def run(states: State, load: jax.Array, start: jax.Array) -> jax.Array:
        if block.test in MOVING_TESTS:
            contraction = _ridden(block, model, states, load, start, None).contraction
        else:
            contraction = swept(model, states, load, (start - shift) / length)
        return model.show(length * contraction + shift, states.time, "position")

    assert block.start is not None  # every recording of a position has one
    return jax.vmap(run)(block.states, block.load, block.start)


def shot(block: Block, model: Model, nodes: "Nodes") -> tuple[jax.Array, tuple[jax.Array, jax.Array]]:
    """The same for runs that begin anew at `nodes` (leading axis: runs), and by how much each stretch misses its node.

    Nodes are contractions of the muscle with its stated length, so are the gaps, (runs, nodes).
    """
    length, shift = model.muscle.length, block.counts_from(model.muscle.length)
    ratio = block.stated_length / length

    def run(states: State, load: jax.Array, start: jax.Array, own: "Nodes") -> tuple[jax.Array, tuple]:
        there = own._replace(contraction=own.contraction * ratio - shift / length, rate=own.rate * ratio)
        motion = _ridden(block, model, states, load, start, there)
        shown = model.show(length * motion.contraction + shift, states.time, "position")
        return shown, tuple(gap / ratio for gap in motion.gaps or ())

    assert block.start is not None
    return jax.vmap(run)(block.states, block.load, block.start, nodes)


def _ridden(
    block: Block, model: Model, states: State, load: jax.Array, start: jax.Array, nodes: "Nodes | None"
) -> "Moved":
    """The motion of one run: let go at t = 0 from rest, or free from the first sample."""
    from mckibben_jax.motion.motion import moved

    released = block.test == "quick release"
    begin = 0.0 if released else (start - block.counts_from(model.muscle.length)) / model.muscle.length
    since = 0.0 if released else None
    return moved(model, states, load, begin, steps=block.taken, since=since, nodes=nodes, room=block.steps)


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


def begin_of(test: str, first: float) -> float:
    """When a motion begins (s) whose first sample is at `first`: a muscle that is let go is held until 0."""
    return 0.0 if test == "quick release" else first


def steps_of(recording: Recording) -> int:
    """Steps of integration that the longest run needs; 0 where nothing is integrated."""
    if recording.test in (*FORCE_TESTS, "isotonic"):
        return 0
    from mckibben_jax.motion.motion import STEP  # diffrax is only needed where something moves

    longest = max(float(run.time[-1]) - begin_of(recording.test, float(run.time[0])) for run in recording.runs)
    return int(np.clip(math.ceil(longest / STEP - 1e-9), 1, MOST_STEPS))
