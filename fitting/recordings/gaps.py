"""Pauses of a logger: between two runs of one file, or a hole in which the muscle did not stand still."""

from collections.abc import Sequence

import numpy as np

from fitting import showing
from fitting.recordings.records import Run
from fitting.recordings.settings import GAPS, TABLES


def pressure_levels(time: np.ndarray, pressure: np.ndarray) -> list[np.ndarray]:
    """The positions of each run of loops in a file that says nothing of runs (samples,).

    A new one begins where the logger paused and the pressure was set to another level meanwhile.
    """
    everything = np.arange(len(time))
    if len(time) < GAPS.fewest:
        return [everything]
    other = GAPS.other * np.nanmax(np.abs(pressure))
    pauses = np.flatnonzero(_far_beyond(time)) + 1
    edges = [0, *pauses, len(time)]
    triples = zip(edges[:-2], edges[1:-1], edges[2:], strict=True)
    cuts = [at for before, at, after in triples if _change(pressure[before:at], pressure[at:after]) > other]
    return np.split(everything, cuts)


def _change(before: np.ndarray, after: np.ndarray) -> float:
    """By how much a pressure differs on the two sides of a pause, Pa; nothing where one of them is too short to say.

    Nor where the pressure is swept: it is another one after any pause.
    """
    sides = before[-GAPS.beside :], after[: GAPS.beside]
    known = [side[np.isfinite(side)] for side in sides]
    if min(map(len, known)) < TABLES.fewest_samples:
        return 0.0
    change = abs(float(np.median(known[1]) - np.median(known[0])))
    swept = max(float(np.ptp(np.quantile(side, [0.1, 0.9]))) for side in known)
    return change if change > GAPS.steady * swept else 0.0


def levels_note(parts: Sequence[Run]) -> str:
    """That a file was cut into runs, and where."""
    rows = ", ".join(str(part.row[0]) for part in parts[1:])
    return f"{len(parts)} runs: the logger paused, and the pressure was another one then (new runs from rows {rows})"


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
