"""A model and its data as one compiled function of the parameters, and the sliders that move them."""

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np

from fitting import showing
from fitting.least_squares.record import Fit
from fitting.problem.residuals import Problem, Samples, problem
from fitting.problem.unknowns import Unknowns
from fitting.report.text.names import Names, mark
from fitting.study.task import Task
from fitting.workbench.settings import WORKBENCH


@jax.jit
def _data_rows(given: Problem, vector: jax.Array, switches: jax.Array) -> jax.Array:
    return given.data_rows(vector, switches)


@dataclass(frozen=True)
class Slider:
    """One parameter to move: its places in a unit for people, and the one where the fit is."""

    name: str
    called: str  # with the name for readers
    unit: str
    size: float  # how much of SI one of the unit is
    places: tuple[float, ...]
    start: float

    @property
    def label(self) -> str:
        """What readers call it, its full name, and the unit."""
        return f"{self.called} [{self.unit}]" if self.unit else self.called


@dataclass(frozen=True)
class LaidOut:
    """A model and its data as one compiled function of the parameters: numbers in, numpy out."""

    layout: Unknowns
    given: Problem
    samples: Samples
    vector: np.ndarray
    switches: np.ndarray
    sliders: tuple[Slider, ...]

    def residual(self, values: dict[str, float] | None = None) -> np.ndarray:
        """Model minus measurement with some parameters moved (by full name, SI), in the recordings' units."""
        vector = self.vector.copy()
        for name, value in (values or {}).items():
            vector[self.layout.names.index(name)] = value
        rows = _data_rows(self.given, jnp.asarray(vector), jnp.asarray(self.switches))
        return np.asarray(rows) * self.samples.sigma

    def moved(self, shown: dict[str, float]) -> dict[str, float]:
        """Values of sliders in SI; only those that were moved."""
        return {s.name: shown[s.name] * s.size for s in self.sliders if shown.get(s.name, s.start) != s.start}


def lay_out(task: Task, fit: Fit | None) -> LaidOut:
    """The task's model at its fitted values, or at those where a search would start."""
    if fit is None:
        layout = task.layout
        given, samples = problem(task.experiments, layout)
        vector = np.array([task.known.get(n, s) for n, s in zip(layout.names, layout.start, strict=True)])
        switches = np.ones(len(layout.templates[0].effects))
    else:
        layout, given, samples, vector, switches = fit.layout, fit.problem, fit.samples, fit.vector, fit.switches
    names = [name for name in task.free_names if fit is None or name not in fit.held]
    errors = {name: 0.0 if fit is None else fit.error(name) for name in names}
    spoken = Names(task.library).spoken
    sliders = tuple(_slider(layout, vector, name, spoken(mark(name)), errors[name]) for name in names)
    return LaidOut(layout, given, samples, vector, switches, sliders)


def _slider(layout: Unknowns, vector: np.ndarray, name: str, called: str, error: float) -> Slider:
    at = layout.names.index(name)
    entry, value = layout.entries[at], float(vector[at])
    reach = max(abs(value), WORKBENCH.around * error if np.isfinite(error) else 0.0, 0.01 * (entry.upper - entry.lower))
    lower, upper = max(entry.lower, value - reach), min(entry.upper, value + reach)
    unit, size = showing.shown_in(entry.unit, max(abs(lower), abs(upper)))
    places = np.unique(np.append(np.linspace(lower, upper, WORKBENCH.places), value)) / size
    shown = [float(f"{place:.5g}") for place in places]
    return Slider(name, called, unit, size, tuple(dict.fromkeys(shown)), float(f"{value / size:.5g}"))
