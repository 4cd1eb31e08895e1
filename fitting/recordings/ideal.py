"""The ideal pull at readings, by one compiled program whatever their number."""

import jax
import numpy as np

from mckibben_jax.laws.braid import ideal_force
from mckibben_jax.muscle import Muscle

BLOCK = 4096  # readings worked on at once: jax compiles a program for every number of them, which takes 0.1 s
_pull = jax.jit(ideal_force)


def ideal_pull(contraction: np.ndarray | float, pressure: np.ndarray | float, muscle: Muscle) -> np.ndarray:
    """Pull (N) of the ideal cylinder (eq 10) at these contractions and pressures (Pa), which are broadcast together."""
    place, load = np.broadcast_arrays(np.asarray(contraction, float), np.asarray(pressure, float))
    pulls = [_of_block(place.ravel()[at : at + BLOCK], load.ravel()[at : at + BLOCK], muscle)
             for at in range(0, place.size, BLOCK)]  # fmt: skip
    return np.concatenate([*pulls, np.zeros(0)]).reshape(place.shape)


def _of_block(place: np.ndarray, load: np.ndarray, muscle: Muscle) -> np.ndarray:
    whole = [np.pad(values, (0, BLOCK - len(values))) for values in (place, load)]
    return np.asarray(_pull(*whole, muscle.radius, muscle.braid_angle))[: len(place)]
