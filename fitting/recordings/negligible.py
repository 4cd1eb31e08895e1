"""From which errors on a rig's pressure and length readings are felt in its force readings."""

from collections.abc import Sequence

import numpy as np

from fitting.recordings import motion_signals as signals
from fitting.recordings.inputs import SETTINGS, Negligible
from fitting.recordings.records import FORCE_TESTS, Run
from mckibben_jax.laws.braid import ideal_force
from mckibben_jax.muscle import Muscle


def negligible(parts: Sequence[Run], test: str, muscle: Muscle) -> Negligible:
    """From which errors on pressure and length are felt, by the slopes of the ideal law (eq 10) at rest length.

    The error of the measured channel is that between neighbouring readings: this is what an input's error, which is
    as quick, is seen against when slow noise is whitened.
    """
    pressure = max(float(np.median(np.abs(part.pressure))) for part in parts)
    by_pressure, at_rest, shortened = (
        float(ideal_force(place, load, muscle.radius, muscle.braid_angle))
        for place, load in ((0.0, 1.0), (0.0, pressure), (SETTINGS.step, pressure))
    )
    by_contraction = abs(at_rest - shortened) / SETTINGS.step
    noise = float(np.median([signals.noise_level(part.time, part.measured) for part in parts]))
    noise = max(noise, SETTINGS.noise * max(float(np.abs(part.measured).max()) for part in parts))
    force = noise * (1.0 if test in FORCE_TESTS else by_contraction / float(muscle.length))
    tiny = 1e-300  # a vented muscle: nothing is felt
    return Negligible(
        SETTINGS.pressure * force / max(abs(by_pressure), tiny), SETTINGS.length * force / max(by_contraction, tiny)
    )
