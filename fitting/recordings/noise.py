"""How noisy one reading is, before any model is believed."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fitting.recordings.accuracy import Accuracy, ChannelAccuracy
from fitting.recordings.ideal import ideal_pull
from fitting.recordings.records import FORCE_TESTS, NoiseSource, Recording, Run
from mckibben_jax.muscle import Muscle

STATIC_SHARE = 0.005  # of full scale: what one point of a static map is taken to be good for, if nothing is stated
INPUTS = ("contraction", "pressure")
THIRD = np.array([1.0, -3.0, 3.0, -1.0])


def noise_of(recording: Recording) -> float:
    """Standard deviation of one reading, N or m: as stated, else from the scatter of neighbouring readings.

    In a point of a static map the force also errs by what stated errors of pressure and position make of it.
    """
    return float(np.hypot(noise_of_cell(recording), recording.noise_of_inputs))


def noise_of_cell(recording: Recording) -> float:
    """The same of the measured channel alone, whatever the others err by."""
    if recording.noise is not None:
        return float(recording.noise)
    scale = full_scale(recording)
    if recording.test == "static":
        return STATIC_SHARE * scale
    scatter = [value for run in recording.runs for value in _third_differences(run)]
    estimate = 1.4826 * np.median(np.abs(scatter)) / np.sqrt(np.sum(THIRD**2)) if scatter else 0.0
    return float(max(estimate, resolution(recording) / np.sqrt(12), 1e-4 * scale, 1e-12))


def noise_of_inputs(runs: Sequence[Run], accuracy: Accuracy, muscle: Muscle) -> float:
    """Standard deviation, N, of a point's force for the noise and rounding that are stated of pressure and position.

    Points stand alone: no course along time shows the true pressure and length, as that of a loop does. The slopes are
    those of the ideal law (eq 10), in mean square over all points.
    """
    return force_of_errors(runs, _white(accuracy.position) / float(muscle.length), _white(accuracy.pressure), muscle)


def force_of_errors(runs: Sequence[Run], contraction: float, pressure: float, muscle: Muscle) -> float:
    """Standard deviation, N, of the ideal force where contractions and pressures (Pa) err by these, in mean square."""
    steps = contraction, pressure
    place, pressures = (np.concatenate([getattr(run, name)[run.usable] for run in runs]) for name in INPUTS)
    by_place = ideal_pull(place + steps[0], pressures, muscle) - ideal_pull(place - steps[0], pressures, muscle)
    by_pressure = ideal_pull(place, pressures + steps[1], muscle) - ideal_pull(place, pressures - steps[1], muscle)
    return float(np.sqrt(np.mean((by_place / 2) ** 2 + (by_pressure / 2) ** 2)))


def _white(stated: ChannelAccuracy) -> float:
    return float(np.hypot(stated.noise or 0.0, (stated.resolution or 0.0) / np.sqrt(12)))


def source_of_noise(recording: Recording) -> NoiseSource:
    """How `noise_of` knows."""
    if recording.noise is not None:
        stated = recording.noise_source is NoiseSource.STATED
        return NoiseSource.STATED_OF_ALL if stated and recording.noise_of_inputs else recording.noise_source
    return NoiseSource.ASSUMED if recording.test == "static" else NoiseSource.NEIGHBOURS


def one_load_cell(recordings: Sequence[Recording]) -> tuple[Recording, ...]:
    """The same recordings; what is assumed of a static map's points goes by the largest force of the whole data set.

    A map at low pressure, read by the same load cell, is not better for it.
    """
    scale = max((full_scale(r) for r in recordings if r.test in FORCE_TESTS), default=0.0)
    assumed = STATIC_SHARE * scale
    return tuple(
        replace(r, noise=assumed, noise_source=NoiseSource.ASSUMED) if r.test == "static" and r.noise is None else r
        for r in recordings
    )


def resolution(recording: Recording) -> float:
    """The step in which a channel was digitised: the smallest difference between two different readings of a run.

    Weights that hang on a muscle in turn are no steps of a channel.
    """
    steps = np.concatenate([np.diff(np.unique(run.measured)) for run in recording.runs])
    steps = steps[steps > 1e-9 * full_scale(recording)]
    return float(steps.min()) if len(steps) else 0.0


def full_scale(recording: Recording) -> float:
    """The largest absolute reading."""
    return max(float(np.max(np.abs(run.measured))) for run in recording.runs)


def _third_differences(run: Run) -> list[float]:
    """Third differences within branches: a smooth signal leaves nothing of itself in them."""
    if len(run) < len(THIRD):
        return []
    differences = np.convolve(run.measured, THIRD, mode="valid")
    together = (run.half[3:] == run.half[:-3]) & (run.weight[3:] > 0) & (run.weight[:-3] > 0)
    return list(differences[together])
