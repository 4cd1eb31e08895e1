"""What a posterior says the instruments would show, and how often they did."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fitting.posterior.evaluation import in_batches, parts_at
from fitting.posterior.explicit import DRAWN, Explicit
from fitting.posterior.noise import PARTS
from fitting.posterior.settings import SUMMARY
from fitting.posterior.target import PosteriorProblem
from fitting.recordings.records import Experiment


@dataclass(frozen=True)
class Band:
    """One run: the readings, and where 90 % of readings should lie; N or m."""

    recording: int
    run: int  # numbered through all recordings
    file: str
    name: str
    unit: str
    position: np.ndarray  # within the run
    measured: np.ndarray
    low: np.ndarray
    middle: np.ndarray
    high: np.ndarray

    @property
    def inside(self) -> float:
        """Share of the readings in the band; 0.9 where model and noise are right."""
        return float(np.mean((self.measured >= self.low) & (self.measured <= self.high)))


def bands(
    setup: PosteriorProblem, z: np.ndarray, random: np.random.Generator, experiments: Sequence[Experiment]
) -> list[Band]:
    """The band of each run, from some of the draws z (draws, coordinates): of readings by instruments as they err."""
    some = z[random.choice(len(z), SUMMARY.band_draws, replace=len(z) < SUMMARY.band_draws)]
    samples = setup.samples
    model = _as_read(setup, some, random) * samples.sigma + samples.measured
    shown = model + random.standard_normal(model.shape) * _sizes(setup, some) * samples.sigma
    low, middle, high = np.quantile(shown, SUMMARY.levels, axis=0)
    found = []
    names = [(rec.file, run.name) for e in experiments for rec in e.recordings for run in rec.runs]
    for run in np.unique(samples.run):
        mine = samples.run == run
        recording = int(samples.recording[mine][0])
        file, name = names[run] if run < len(names) else (f"recording {recording + 1}", str(run))
        unit = "N" if setup.target.problem.blocks[recording].of_force else "m"
        parts = (samples.position, samples.measured, low, middle, high)
        found.append(Band(recording, int(run), file, name, unit, *(part[mine] for part in parts)))
    return found


def _as_read(setup: PosteriorProblem, z: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """Rows (draws, readings) of what the instruments would show but for noise, their errors drawn as they may be."""
    explicit = Explicit.of(setup)
    if explicit is None or not explicit.columns.shape[1]:
        return parts_at(setup.target, z).rows
    normal = random.standard_normal((len(z), explicit.columns.shape[1]))
    errors = in_batches(DRAWN, explicit, np.hstack([z, normal]))
    return parts_at(explicit, np.hstack([z, errors])).rows


def _sizes(setup: PosteriorProblem, z: np.ndarray) -> np.ndarray:
    """Standard deviation of every reading's error in units of its noise, (draws, readings)."""
    noise = setup.target.natural(z)[:, setup.target.free :]
    at = np.asarray(setup.target.noise.which)[PARTS.index("size")]
    return noise[:, at][:, np.asarray(setup.target.noise.recording)]
