"""All that is done with the readings of a rig, those of a file as those of a rehearsal."""

from collections.abc import Sequence
from dataclasses import replace

from fitting.recordings.accuracy import Accuracy
from fitting.recordings.channel_errors import found_errors
from fitting.recordings.input_errors import input_errors
from fitting.recordings.records import NoiseSource, Recording, Run
from fitting.recordings.runs import run_of
from fitting.recordings.spikes import without_spikes
from mckibben_jax.muscle import Muscle


def runs_of(
    readings: Sequence[Run], test: str, muscle: Muscle, stated: Accuracy
) -> tuple[list[Run], tuple[Run, ...], list[str]]:
    """Readings without those that stand alone, the runs that they make, and notes on those that stood alone."""
    parts, alone = without_spikes(readings, test)
    return parts, tuple(run_of(part, test, input_errors(part, test, muscle, stated)) for part in parts), alone


def recorded_again(recording: Recording, readings: Sequence[Run], muscle: Muscle) -> Recording:
    """The same recording with other readings of the same rig; of a motion that was read as force with other forces."""
    if recording.noise_source is NoiseSource.MOTION:
        return replace(recording, runs=tuple(readings))
    parts, runs, _ = runs_of(readings, recording.test, muscle, recording.accuracy)
    return replace(recording, runs=runs, found=found_errors(parts, recording.test, float(muscle.length)))
