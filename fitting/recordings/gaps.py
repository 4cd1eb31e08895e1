"""Holes in a recording: the logger wrote nothing while the muscle did not stand still."""

from collections.abc import Sequence

import numpy as np

from fitting import showing
from fitting.recordings.records import Run
from fitting.recordings.settings import GAPS


def gap_notes(parts: Sequence[Run], test: str) -> list[str]:
    """A note on each hole in a run's time, with the rows beside it; points of a map have no time."""
    return [] if test == "static" else [_note(part, at) for part in parts for at in _gaps(part)]


def _gaps(part: Run) -> np.ndarray:
    """After which readings of a run there is a hole: far longer than other pauses, and the readings jump."""
    if len(part) < GAPS.fewest:
        return np.zeros(0, int)
    return np.flatnonzero(_far_beyond(part.time) & (_far_beyond(part.pressure) | _far_beyond(part.measured)))


def _far_beyond(signal: np.ndarray) -> np.ndarray:
    """Which steps of a signal are many times as large as nearly all others, a mask."""
    steps = np.abs(np.diff(signal))
    return steps > GAPS.times * np.quantile(steps, GAPS.nearly_all)


def _note(part: Run, at: int) -> str:
    silent = showing.show(float(part.time[at + 1] - part.time[at]), "s", digits=2)
    return (
        f"run {part.name}: no reading for {silent}, in which the muscle did not stand still (rows {part.row[at]}, "
        f"{part.row[at + 1]}): effects that remember what was before, such as creep, miss that time; record the run "
        "again, or give the two parts different names in a column 'run'"
    )
