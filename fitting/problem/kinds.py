"""What kind of recording each row comes from, as its readings show it."""

import numpy as np

from fitting.problem.residuals import Samples

POINTS = 2  # of the kinds of recordings, that without a history


def kinds(samples: Samples) -> np.ndarray:
    """Of each row, what its recording is: 0 loops, 1 a held length, 2 points without a history."""
    found = np.zeros(len(samples), int)
    for recording in np.unique(samples.recording):
        mine = samples.where(samples.recording == recording)
        found[samples.recording == recording] = int(is_held(mine)) + int(is_static(mine))
    return found


def is_held(s: Samples) -> bool:
    """Lengths that do not move."""
    return bool(np.all(np.abs(s.rate) <= 1e-8))


def is_static(s: Samples) -> bool:
    """A map of points: no history, no speed."""
    return is_held(s) and bool(np.all(s.pressure_rate == 0))
