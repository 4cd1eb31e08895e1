"""Where the force of a muscle was measured: outside, what a model says of its force is a guess."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fitting import showing
from fitting.exporting.settings import EXPORT
from fitting.recordings.records import FORCE_TESTS, Experiment


@dataclass(frozen=True)
class Reach:
    """Pressures (Pa) and contractions of the force readings that count: least and greatest.

    `far` is the contraction from which on only pressures above `far_pressure` were measured: at less the muscle hangs
    slack, or pushes. `far_pressure` is the least pressure where readings fill that corner, too.
    """

    pressure: tuple[float, float]
    contraction: tuple[float, float]
    far: float
    far_pressure: float

    def holds(self, pressure: np.ndarray, contraction: np.ndarray) -> np.ndarray:
        """Which places, of any shape, lie within."""
        within = _between(self.pressure, pressure) & _between(self.contraction, contraction)
        room = EXPORT.edge * (self.pressure[1] - self.pressure[0])
        return within & ((contraction < self.far) | (pressure >= self.far_pressure - room))

    def __str__(self) -> str:
        """In words, as the end of a sentence."""
        low, high = self.contraction
        ends = f"{showing.show(self.pressure[0], 'Pa')} to {showing.show(self.pressure[1], 'Pa')}"
        said = f"{ends}, contraction {low:.3g} to {high:.3g}"
        if self.far_pressure <= self.pressure[0]:
            return said
        return f"{said}, but at contraction {self.far:.3g} or more only above {showing.show(self.far_pressure, 'Pa')}"


def reach_of(experiments: Sequence[Experiment]) -> Reach:
    """Where the force readings of these data sets lie; there must be one."""
    recordings = [recording for experiment in experiments for recording in experiment.recordings]
    runs = [run for recording in recordings if recording.test in FORCE_TESTS for run in recording.runs]
    pressure, contraction = (
        np.concatenate([np.asarray(getattr(run, name))[np.asarray(run.weight) > 0] for run in runs])
        for name in ("pressure", "contraction")
    )
    return reach(pressure, contraction)


def reach(pressure: np.ndarray, contraction: np.ndarray) -> Reach:
    """Where these readings lie: pressures (readings,) in Pa, contractions (readings,)."""
    far = contraction >= contraction.max() - EXPORT.corner * np.ptp(contraction)
    least = float(pressure[far].min())
    if least <= pressure.min() + EXPORT.corner * np.ptp(pressure):
        least = float(pressure.min())
    return Reach(_ends(pressure), _ends(contraction), float(contraction[far].min()), least)


def _between(ends: tuple[float, float], values: np.ndarray) -> np.ndarray:
    """Which values lie between the ends, or so little beyond that no reading would tell: zeros are read with noise."""
    room = EXPORT.edge * (ends[1] - ends[0])
    return (ends[0] - room <= values) & (values <= ends[1] + room)


def _ends(values: np.ndarray) -> tuple[float, float]:
    return float(values.min()), float(values.max())
