"""Which runs are drawn, along what, and how many of their samples: shared by every picture of measured and model."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from fitting import showing
from fitting.comparison.bins import bins, medians
from fitting.problem.residuals import Samples
from fitting.recordings.noise import noise_of
from fitting.recordings.records import FORCE_TESTS, Experiment, Recording, Run
from fitting.report.settings import FIGURE
from fitting.report.text.amounts import amount


@dataclass(frozen=True)
class Panel:
    """One run as it is drawn: the axes in units for people, the samples that are shown, and its error."""

    name: str
    held: str  # what the run holds while something else moves
    run: Run
    mine: np.ndarray  # which of all weighted samples are of this run
    position: np.ndarray  # where those stand in the run
    test: str
    unit: str
    along: np.ndarray
    xlabel: str
    rmse: float
    noise: float = 0.0  # standard deviation of one reading, in the recording's unit
    file: str = ""  # where run names alone do not tell the runs apart

    @property
    def ylabel(self) -> str:
        """What is measured, with its unit."""
        return f"{'force' if self.unit == 'N' else 'shortening'} [{showing.shown_in(self.unit)[0]}]"

    @property
    def title(self) -> str:
        """Which run, what it holds, and how far the model is off."""
        return f"{self.label}: {amount(self.rmse, self.unit, 2)}"

    @property
    def label(self) -> str:
        """Which run, and what it holds."""
        return f"{self.file}{', ' * bool(self.file)}run {self.name}, {self.held}"

    @property
    def level(self) -> float:
        """How much the run holds of what it holds: contraction, load (N) or pressure (Pa)."""
        if _is_swept(self.run, self.test):
            return float(np.max(self.run.pressure))
        if _is_led_by_pressure(self.run, self.test):
            return float(np.median(self.run.contraction))
        return float(np.median(self.run.pressure if self.run.load is None else self.run.load))

    @property
    def is_few(self) -> bool:
        """Single points rather than a curve."""
        return self.test == "static" or len(self.run) < 30

    @property
    def size(self) -> float:
        """How much of SI one of the unit on the axis is."""
        return showing.shown_in(self.unit)[1]

    @property
    def measured(self) -> np.ndarray:
        """Every reading in the unit of the axis."""
        return self.run.measured / self.size

    def model(self, residual: np.ndarray) -> np.ndarray:
        """The model in the unit of the axis, NaN where the run carries no weight; `residual` is of all samples."""
        values = np.full(len(self.run), np.nan)
        values[self.position] = (self.run.measured[self.position] + residual[self.mine]) / self.size
        return values

    def error(self, residual: np.ndarray) -> float:
        """Root mean square of this run's part of a residual, in the recording's unit."""
        return float(np.sqrt(np.mean(residual[self.mine] ** 2)))

    @cached_property
    def branches(self) -> list[np.ndarray]:
        """Samples of each branch that is drawn, in order."""
        if self.is_few:
            return [np.arange(len(self.run))]
        parts = np.split(np.arange(len(self.run)), np.flatnonzero(np.diff(self.run.half)) + 1)
        most = FIGURE.points // FIGURE.fewest_on_a_branch
        if len(parts) <= most:
            return parts
        first = np.linspace(0, (len(parts) - 2) // 2, most // 2).astype(int) * 2  # whole loops, evenly through the run
        return [parts[k] for k in np.unique([first, first + 1])]

    @property
    def is_thinned(self) -> bool:
        """Whether samples are left out of the picture."""
        return sum(map(len, self.branches)) > FIGURE.points or sum(map(len, self.branches)) < len(self.run)

    def shown(self, values: np.ndarray) -> list[np.ndarray]:
        """Of each branch its ends and the samples that shape these values most (largest triangles)."""
        each = max(FIGURE.points // len(self.branches), FIGURE.fewest_on_a_branch)
        return [part[largest_triangles(values[part], each)] for part in self.branches]


def largest_triangles(values: np.ndarray, most: int) -> np.ndarray:
    """Places of the ends and of the finite values that shape this line most, in order; so many at most."""
    finite = np.flatnonzero(np.isfinite(values))
    if len(finite) <= most:
        return finite
    from tsdownsample import LTTBDownsampler

    return finite[LTTBDownsampler().downsample(np.ascontiguousarray(values[finite]), n_out=most).astype(int)]


def panels(experiments: Sequence[Experiment], samples: Samples, residual: np.ndarray) -> list[Panel]:
    """Every run that carries weight; those with the largest errors where there are too many to look at."""
    found = every_panel(experiments, samples, residual)
    worst = sorted(found, key=lambda panel: -panel.rmse)[: FIGURE.panels]
    return [panel for panel in found if any(panel is one for one in worst)]


def every_panel(experiments: Sequence[Experiment], samples: Samples, residual: np.ndarray) -> list[Panel]:
    """Every run that carries weight."""
    found: list[Panel] = []
    number = 0
    for experiment in experiments:
        for recording in experiment.recordings:
            noise = noise_of(recording)
            for run in recording.runs:
                found += _panel(samples, residual, recording, run, number, noise)
                number += 1
    return _with_files(found, experiments, samples)


def _with_files(found: list[Panel], experiments: Sequence[Experiment], samples: Samples) -> list[Panel]:
    """The panels with their file in the label where two runs go by one name."""
    if max(Counter(panel.label for panel in found).values(), default=1) == 1:
        return found
    files = [(e.name, r.file) for e in experiments for r in e.recordings]
    several = len(experiments) > 1
    named = (", ".join(files[samples.recording[panel.mine[0]]][0 if several else 1 :]) for panel in found)
    return [replace(panel, file=file) for panel, file in zip(found, named, strict=True)]


def _panel(
    samples: Samples, residual: np.ndarray, recording: Recording, run: Run, number: int, noise: float
) -> list[Panel]:
    mine = np.flatnonzero(samples.run == number)
    position, found = samples.position[mine], []
    for places in _curves(run, recording.test):
        here = np.isin(position, places)
        if here.any():
            at = np.searchsorted(places, position[here])
            found.append(_of_curve(residual, recording, run.at(places), mine[here], at, noise))
    return found


def _of_curve(
    residual: np.ndarray, recording: Recording, run: Run, mine: np.ndarray, position: np.ndarray, noise: float
) -> Panel:
    along, xlabel = _along(run, recording.test)
    rmse = float(np.sqrt(np.mean(residual[mine] ** 2)))
    held = _held(run, recording.test)
    return Panel(run.name, held, run, mine, position, recording.test, recording.unit, along, xlabel, rmse, noise)


def _curves(run: Run, test: str) -> list[np.ndarray]:
    """The samples that one line may join: of a static map those at one pressure, or at one length, if it has such."""
    if test == "static":
        for held in (run.pressure, run.contraction):
            groups = bins(held)
            if groups.are_levels and len(run) >= FIGURE.fewest_on_a_curve * len(groups):
                return [np.flatnonzero(groups.of == k) for k in range(len(groups))]
    return [np.arange(len(run))]


def _along(run: Run, test: str) -> tuple[np.ndarray, str]:
    if test == "isotonic" or _is_led_by_pressure(run, test) or _is_swept(run, test):
        name, size = showing.shown_in("Pa")
        return run.pressure / size, f"pressure [{name}]"
    return (run.contraction, "contraction") if test in FORCE_TESTS else (run.time, "time [s]")


def _is_led_by_pressure(run: Run, test: str) -> bool:
    """Whether a run holds its length while the pressure moves."""
    return test == "isometric" or (test == "static" and _by_pressure(run))


def _is_swept(run: Run, test: str) -> bool:
    """Whether the pressure of a loop is swept, and moves the muscle: against a spring its force says little else."""
    if test != "loop":
        return False
    ranges = [np.ptp(run.pressure[run.half == half]) for half in np.unique(run.half)]
    return bool(np.median(ranges) > FIGURE.swept_pressure * np.max(np.abs(run.pressure)))


def _by_pressure(run: Run) -> bool:
    """A static run is drawn along whatever it varies more."""
    return np.ptp(run.pressure) / max(np.max(run.pressure), 1.0) > np.ptp(run.contraction) / 0.3


def _held(run: Run, test: str) -> str:
    if _is_led_by_pressure(run, test):
        return f"ε = {np.median(run.contraction):.3g}"
    if _is_swept(run, test):
        return f"pressure up to {amount(float(np.max(run.pressure)), 'Pa')}"
    if run.load is not None:
        return amount(float(np.median(run.load)), "N")
    pressure = run.pressure if test == "static" else medians(run.pressure, run.loop)  # one loop at each of several
    lowest, highest = float(np.min(pressure)), float(np.max(pressure))
    if highest - lowest > FIGURE.same_pressure * highest:
        return f"{amount(lowest, 'Pa')} to {amount(highest, 'Pa')}"
    return amount(float(np.median(run.pressure)), "Pa")
