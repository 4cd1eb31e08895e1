"""Pressure and length as they were read, and the signal that was estimated from the readings."""

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from fitting import showing
from fitting.recordings.records import Experiment, Recording
from fitting.report.pictures.figures import BLUE, GREY, blank, settings
from fitting.report.settings import READINGS

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


class Pair(NamedTuple):
    """One channel of one run: times (s), readings and estimates (n,) in the SI unit."""

    name: str
    unit: str
    time: np.ndarray
    reading: np.ndarray
    estimate: np.ndarray


def estimated_channels(experiments: Sequence[Experiment]) -> list[Pair]:
    """Of every recording, the first run of each channel whose readings err so much that the signal was estimated."""
    return [
        pair
        for experiment in experiments
        for recording in experiment.recordings
        for pair in _pairs(recording, float(experiment.muscle.length))
    ][: READINGS.rows]


def _pairs(recording: Recording, length: float) -> Iterator[Pair]:
    for channel, unit, scale in (("pressure", "Pa", 1.0), ("contraction", "m", length)):
        run = next((r for r in recording.runs if getattr(r, f"{channel}_reading") is not None), None)
        if run is not None:
            thin = slice(None, None, -(-len(run) // READINGS.readings))
            reading, estimate = (scale * getattr(run, name)[thin] for name in (f"{channel}_reading", channel))
            name = "pressure" if channel == "pressure" else "shortening"
            yield Pair(f"{recording.file}, run {run.name}: {name}", unit, run.time[thin], reading, estimate)


def readings_picture(pairs: Sequence[Pair]) -> "Figure":
    """Each channel with its estimate, and beside it the reading less the estimate."""
    figure = blank(7.0, 1.9 * len(pairs))
    with settings():
        for row, pair in enumerate(pairs):
            both, rest = (figure.add_subplot(len(pairs), 2, 2 * row + column) for column in (1, 2))
            unit, size = showing.shown_in(pair.unit, float(np.abs(pair.reading).max()))
            _dots(both, pair.time, pair.reading / size)
            both.plot(pair.time, pair.estimate / size, color=BLUE, linewidth=1.2)
            both.set_title(pair.name, loc="left")
            both.set_ylabel(f"[{unit}]")
            _dots(rest, pair.time, (pair.reading - pair.estimate) / size)
            rest.axhline(0, color=BLUE, linewidth=1.2)
            rest.set_title("reading less estimate", loc="left")
            for axes in (both, rest):
                axes.locator_params(nbins=4)
                axes.set_xlabel("time [s]" if row == len(pairs) - 1 else "")
        figure.tight_layout(pad=0.4)
    return figure


def _dots(axes: "Axes", time: np.ndarray, values: np.ndarray) -> None:
    axes.plot(time, values, ".", color=GREY, markersize=2)
