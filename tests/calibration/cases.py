"""One data set: what the fit and the posterior say of it, and where the truth lies in that."""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from fitting.least_squares.fit import fit
from fitting.least_squares.record import Fit
from fitting.posterior.quick import quick_look
from fitting.posterior.record import Posterior
from fitting.posterior.sample import sample

from ..exact_instruments import trusting
from .truths import PRIORS, Drawn, draw, model

GROUPS = ("nothing left out", "an effect left out")
LIMIT = 300.0  # s for one posterior: a chain that is not long enough by then is a record too


@dataclass(frozen=True)
class Case:
    """One data set of a study."""

    group: str
    number: int
    seed: int
    quick: bool = False

    @property
    def id(self) -> str:
        """A name that says everything."""
        return f"{self.group}/{self.number}/{'quick look' if self.quick else 'emcee'}"


def plan(count: int, seed: int, quick: bool) -> list[Case]:
    """The cases: `count` with nothing left out and as many with an effect left out, in turns.

    Those with an effect left out get the quick look: what warns of them is the same code for both samplers.
    """
    return [Case(group, number, seed, quick or group == GROUPS[1]) for number in range(count) for group in GROUPS]


def judged(case: Case) -> dict[str, Any]:
    """The record of a case."""
    begun = time.perf_counter()
    with TemporaryDirectory() as folder:
        drawn = draw(case.number, case.seed, Path(folder), case.group == GROUPS[1])
        found = trusting(fit([drawn.experiment], model(), starts=2))  # noise alone errs in these recordings
        posterior = sampled(case, found, drawn)
    seconds = time.perf_counter() - begun
    return {
        "id": case.id, "group": case.group, "number": case.number, "seed": case.seed, "noise": drawn.noise,
        "method": posterior.method, "settled": posterior.settled, "calibrated": posterior.calibrated,
        "warnings": list(posterior.warnings), "left_out": drawn.left_out, "scale": drawn.scale,
        "misfit": misfit(found, drawn), "readings": posterior.readings, "seconds": round(seconds, 2),
        "parameters": {name: place_of_truth(posterior, name, truth) for name, truth in drawn.truth.items()},
        "fit": {name: in_errors(found, name, truth) for name, truth in drawn.truth.items()},
    }  # fmt: skip


def sampled(case: Case, found: Fit, drawn: Drawn) -> Posterior:
    """What the program says."""
    if case.quick:
        return quick_look(found, [drawn.experiment], seed=case.number, priors=PRIORS)
    return sample(found, [drawn.experiment], seed=case.number, priors=PRIORS, limit_s=LIMIT)


def misfit(found: Fit, drawn: Drawn) -> float:
    """Root mean square of what the fit misses of the muscle itself, in standard deviations of a reading."""
    rows = found.samples.row - 2  # the first reading stands in row 2 of the file
    return float(np.sqrt(np.mean(((found.residual + drawn.errors[rows]) / found.samples.sigma) ** 2)))


def place_of_truth(posterior: Posterior, name: str, truth: float) -> dict[str, float]:
    """Where the truth lies among the draws, as a share, and the interval."""
    draws = posterior.draws.values[..., posterior.draws.names.index(name)]
    q = posterior.parameters[name]
    return {"truth": truth, "rank": float(np.mean(draws < truth)), "q05": q.q05, "q95": q.q95, "sd": q.sd}


def in_errors(found: Fit, name: str, truth: float) -> dict[str, float]:
    """How far the fit is from the truth, in its own standard errors."""
    away = found.values[name] - truth
    return {"robust": away / found.error(name), "iid": away / found.error(name, robust=False)}
