"""A static map as a muscle goes through it: to every point from behind, along its branch, and then at rest."""

from dataclasses import replace

import numpy as np

from fitting.recordings.records import Run

APART = 1e9  # s between points: whatever fades has faded, and no delay reaches the point before
WAY = 0.1  # contraction along which a point is reached: what slips elastically has slid by then
LONGER = 0.03  # by which no more it is stretched for that, or the strands of a steep braid would be straight


def reached(run: Run) -> tuple[Run, ...]:
    """The run itself; of a map one with a point before every point, which carries no weight.

    What remembers has slid, crept and settled at a point, in whatever order the points were written down. Points whose
    branch nobody knows stand for themselves: a muscle at rest there, without friction.
    """
    if len(run) < 2 or len(np.unique(run.half)) < len(run):
        return (run,)
    if not np.any(run.branch):
        return tuple(run.at([at]) for at in range(len(run)))
    both = run.at(twice(np.arange(len(run))))
    both.weight[::2] = 0.0
    return (replace(both, contraction=from_behind(run.contraction, run.branch), time=clock(len(run))),)


def from_behind(points: np.ndarray, branch: np.ndarray) -> np.ndarray:
    """Contractions (2 n,): before each of the points the place from which a muscle comes along its branch."""
    both = twice(points)
    both[::2] = np.maximum(points - WAY * np.sign(branch), points.min() - LONGER)
    return both


def clock(count: int) -> np.ndarray:
    """Times (2 n,) of so many points and those before them, s."""
    return APART * np.arange(2.0 * count)


def twice(values: np.ndarray) -> np.ndarray:
    """Every value for the point before, and for the point."""
    return np.repeat(values, 2)
