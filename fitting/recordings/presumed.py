"""What is presumed of instruments whose accuracy muscle.toml does not state; it is printed with every verdict."""

from dataclasses import dataclass, replace
from math import hypot

import numpy as np

from fitting.recordings.absolute import UNKNOWN_AMBIENT
from fitting.recordings.accuracy import Accuracy, ChannelAccuracy
from fitting.recordings.noise import noise_of_cell
from fitting.recordings.records import FORCE_TESTS, NoiseSource, Recording


@dataclass(frozen=True)
class PresumedSettings:
    """Accuracies of common laboratory instruments, one standard deviation; chosen from data sheets of their class."""

    force_gain_per_run: float = 1e-3  # a load cell of class 0.1
    force_hysteresis: float = 5e-4  # of full scale; a load cell of class 0.05
    force_drift: float = 5e-3 / 3600  # of full scale in a second: an amplifier that warms up, 0.5 % in an hour
    force_zero_noises: float = 1.0  # readings' noises by which the zero differs between runs: it is set by one reading
    pressure_gain: float = 2.5e-3  # a gauge of class 0.25
    pressure_zero: float = 1e-3  # of full scale; the same
    held_length: float = 1e-3  # m; a length set by hand with a ruler
    friction_per_run: float = 0.02  # of itself: humidity, wear, and how the strands have settled; chosen
    skew_steps: float = 12**-0.5  # sampling steps between channels that are read one after another: uniform in one step


PRESUMED = PresumedSettings()


def presumed(recording: Recording, settings: PresumedSettings = PRESUMED) -> Accuracy:
    """What is presumed of the instruments of a recording; full scale is its largest reading.

    A motion that is read as force has no load cell, nor has a load that hangs: nothing is presumed of their force. (The
    zero of a run and the gain of a gauge would together make whatever a model misses a constant force by.)
    """
    of_cell = recording.noise_source is not NoiseSource.MOTION and not recording.hangs
    of_force = recording.test in FORCE_TESTS and of_cell
    pressures = [float(np.max(np.abs(run.pressure))) for run in recording.runs]
    scale, noise = max(pressures), noise_of_cell(recording)
    reach = max(float(np.max(np.abs(run.measured))) for run in recording.runs) if of_force else 0.0
    air = UNKNOWN_AMBIENT if recording.ambient_is_presumed else 0.0
    held = settings.held_length if recording.test == "isometric" else 0.0
    return Accuracy(
        pressure=ChannelAccuracy(
            zero=hypot(settings.pressure_zero * scale, air), gain=settings.pressure_gain, zero_per_run=0.0,
            gain_per_run=0.0, hysteresis=0.0, drift=0.0,
        ),
        position=ChannelAccuracy(
            zero=0.0, gain=0.0, zero_per_run=held, gain_per_run=0.0, hysteresis=0.0, drift=0.0
        ),
        force=ChannelAccuracy(
            noise=noise if of_force else None, zero=0.0, gain=0.0,
            zero_per_run=settings.force_zero_noises * noise if of_force else 0.0,
            gain_per_run=settings.force_gain_per_run * of_force,
            hysteresis=settings.force_hysteresis * of_force, drift=settings.force_drift * reach * of_force,
        ),
        skew=settings.skew_steps * _sampling_step(recording) * (recording.noise_source is not NoiseSource.MOTION),
        friction_per_run=settings.friction_per_run,
    )  # fmt: skip


def allowed(recording: Recording, settings: PresumedSettings = PRESUMED) -> Accuracy:
    """How far the instruments of a recording may err: as stated, else as presumed.

    What nobody said of the air is beside what a data sheet says of a gauge's zero.
    """
    found = recording.accuracy.presuming(presumed(recording, settings))
    stated = recording.accuracy.pressure.zero
    if stated is None or not recording.ambient_is_presumed:
        return found
    return replace(found, pressure=replace(found.pressure, zero=hypot(stated, UNKNOWN_AMBIENT)))


def _sampling_step(recording: Recording) -> float:
    """Median time between readings, s; zero for points without a history."""
    steps = [np.diff(run.time) for run in recording.runs if len(run) > 1]
    return float(np.median(np.concatenate(steps))) if steps and recording.test != "static" else 0.0
