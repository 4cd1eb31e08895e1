"""One session: the band that the fitted runs give, and the share of each fresh run's readings that lies within it."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from fitting.least_squares.evaluate import evaluate
from fitting.least_squares.fit import fit
from fitting.least_squares.force_band import force_bands
from fitting.least_squares.record import Fit
from fitting.recordings.records import Experiment
from mckibben_jax.effects import BladderNeoHookean, CoulombFriction, IdealCylinder

from .sessions import LATER, MIXED, RIGHT, WRONG, session

RUNS = (10, 20)
MODEL = (IdealCylinder(), BladderNeoHookean(), CoulombFriction())


@dataclass(frozen=True)
class Case:
    """One session of a study."""

    group: str
    order: str
    runs: int
    number: int
    seed: int

    @property
    def id(self) -> str:
        """A name that says everything."""
        return f"{self.group}/{self.order}/{self.runs} runs/{self.number}"


def plan(count: int, seed: int) -> list[Case]:
    """The cases: `count` of each group, order and number of runs."""
    kinds = list(product((RIGHT, WRONG), (MIXED, LATER), RUNS))
    return [Case(group, order, runs, number, seed) for number in range(count) for group, order, runs in kinds]


def judged(case: Case) -> dict[str, Any]:
    """The record of a case: widths (N), and the share of the fresh runs' readings that each holds."""
    with TemporaryDirectory() as folder:
        drawn = session(case.number, case.runs, case.group, case.order, case.seed, Path(folder))
    found = fit([drawn.fitted], MODEL, starts=2)
    (band,) = force_bands(found)
    fresh = evaluate([drawn.fresh], MODEL, found.values, ())
    away, measured = fresh.residual, fresh.samples.measured
    left_out = np.array([residual(found, drawn.fresh, vector) for vector in band.vectors])
    low, high = band.edges(left_out + measured)
    of_fitted = float(np.quantile(np.abs(found.residual), band.level))
    held = {"expected": np.abs(away) <= band.half_width, "cautious": np.abs(away) <= band.cautious,
            "edges": (low <= measured) & (measured <= high), "of fitted": np.abs(away) <= of_fitted}  # fmt: skip
    return {
        "id": case.id, "group": case.group, "order": case.order, "runs": case.runs, "hidden": drawn.hidden,
        "rmse": found.rmse, "width": band.half_width, "cautious": band.cautious,
        "held": {name: by_run(each, fresh.samples.run) for name, each in held.items()},
    }  # fmt: skip


def residual(found: Fit, fresh: Experiment, vector: np.ndarray) -> np.ndarray:
    """Model minus measurement (N) of the fresh runs at these unknowns."""
    values = dict(zip(found.layout.names, map(float, vector), strict=True))
    return evaluate([fresh], MODEL, values, ()).residual


def by_run(inside: np.ndarray, runs: np.ndarray) -> float:
    """The share inside of a reading taken at random from a run taken at random."""
    return float(np.mean([np.mean(inside[runs == run]) for run in np.unique(runs)]))
