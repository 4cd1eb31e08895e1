"""The errors of a rig's pressure and length readings: from which on they are felt in the force, and what is stated."""

import numpy as np

from fitting.recordings import motion_signals as signals
from fitting.recordings.accuracy import Accuracy, ChannelAccuracy
from fitting.recordings.ideal import ideal_pull
from fitting.recordings.inputs import SETTINGS, InputErrors, WhiteError
from fitting.recordings.records import FORCE_TESTS, Run
from mckibben_jax.muscle import Muscle


def input_errors(run: Run, test: str, muscle: Muscle, stated: Accuracy) -> InputErrors:
    """What is known of the errors of pressure and contraction of one run before any reading is smoothed.

    Each run stands for itself: which file it lies in, beside which others, changes nothing.
    """
    pressure, contraction = _negligible(run, test, muscle)
    length = float(muscle.length)
    in_contraction = [None if size is None else size / length for size in _white(stated.position)]
    return InputErrors(WhiteError(pressure, *_white(stated.pressure)), WhiteError(contraction, *in_contraction))


def _white(stated: ChannelAccuracy) -> tuple[float | None, float | None]:
    return stated.noise, stated.resolution


def _negligible(run: Run, test: str, muscle: Muscle) -> tuple[float, float]:
    """From which errors on pressure (Pa) and contraction on are felt, by the slopes of the ideal law (eq 10) at rest.

    The error of the measured channel is that between neighbouring readings: this is what an input's error, which is
    as quick, is seen against when slow noise is whitened.
    """
    pressure = float(np.median(np.abs(run.pressure)))
    places, loads = np.array([0.0, 0.0, SETTINGS.step]), np.array([1.0, pressure, pressure])
    by_pressure, at_rest, shortened = map(float, ideal_pull(places, loads, muscle))
    by_contraction = abs(at_rest - shortened) / SETTINGS.step
    noise = max(signals.noise_level(run.time, run.measured), SETTINGS.noise * float(np.abs(run.measured).max()))
    force = noise * (1.0 if test in FORCE_TESTS else by_contraction / float(muscle.length))
    tiny = 1e-300  # a vented muscle: nothing is felt
    return SETTINGS.pressure * force / max(abs(by_pressure), tiny), SETTINGS.length * force / max(by_contraction, tiny)
