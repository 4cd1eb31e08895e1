"""Measured muscles: what `discover` makes of each data set of a folder, in one table.

    python tests/real_muscles.py FOLDER...          each FOLDER is a data set, or holds data sets

Per set: the first effect, the final error beside what free polynomials reach, fitted geometry beside measured, the
modulus of the rubber, the verdict, and the time. It writes nothing.
"""

import resource
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path

import numpy as np
from numpy.polynomial.polynomial import polyvander2d

from fitting import showing
from fitting.compiled.prepare import prepare
from fitting.least_squares.held_out import folds, rms
from fitting.least_squares.record import Fit
from fitting.report.text.amounts import amount, percent
from fitting.report.text.diagnosis import verdict_text
from fitting.report.text.names import identifiers
from fitting.study.diagnosing import all_candidates
from fitting.study.discovering import Discovery, discover_task
from fitting.study.request import Request
from fitting.study.task import Task, task_of

DEGREES = range(6)  # of a polynomial in one quantity
RUBBER = "bladder"  # family of effects


@dataclass(frozen=True)
class Polynomial:
    """What a polynomial in contraction and pressure leaves: its degrees, errors in N in sample and on held-out runs."""

    degrees: tuple[int, int]
    rmse: float
    held_out_rmse: float


@dataclass(frozen=True)
class Outcome:
    """One set: what was discovered, its starting task, the polynomials' errors, and the time in seconds."""

    task: Task
    found: Discovery
    free: Polynomial
    per_length: float  # N, in sample
    wall: float
    cpu: float


def data_sets(folders: Sequence[str]) -> Iterator[Path]:
    """Every folder that has a muscle.toml with a recording, at or directly below the given ones.

    SystemExit where one of these has none: a muscle left out in silence would pass for one that was looked at.
    """
    for folder in map(Path, folders):
        places = [folder] if (folder / "muscle.toml").exists() else sorted(folder.iterdir())
        found = [p for p in places if (p / "muscle.toml").exists() and any(p.glob("*.csv"))]
        if not found:
            raise SystemExit(f"{folder}: no muscle.toml with a recording is here or one folder below")
        yield from found


def discovered(folder: Path) -> Outcome:
    """What `mckibben discover FOLDER --baseline` finds."""
    task = task_of(Request(data=(str(folder),), baseline=True))
    wall, cpu = time.perf_counter(), _cpu()
    found = discover_task(task, all_candidates(task), lambda *_: None)
    wall, cpu = time.perf_counter() - wall, _cpu() - cpu
    return Outcome(task, found, best_polynomial(found.comparison.fit), by_length(found.comparison.fit), wall, cpu)


def _cpu() -> float:
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime


# ------------------------------------------------------------------------------------------- what a formula would reach


def best_polynomial(fit: Fit) -> Polynomial:
    """The polynomial in contraction and pressure with the least error on held-out runs, among those of few degrees."""
    samples = fit.samples
    group, force = folds(samples), samples.measured
    x = samples.contraction / max(np.ptp(samples.contraction), 1e-12)
    p = samples.pressure / max(np.ptp(samples.pressure), 1e-12)
    best = Polynomial((0, 0), np.inf, np.inf)
    for degrees in product(DEGREES, DEGREES):
        columns = polyvander2d(x, p, degrees)
        held_out = np.empty_like(force)
        for g in np.unique(group):
            out = group == g
            held_out[out] = columns[out] @ np.linalg.lstsq(columns[~out], force[~out], rcond=1e-10)[0] - force[out]
        left = columns @ np.linalg.lstsq(columns, force, rcond=1e-10)[0] - force
        if rms(held_out) < best.held_out_rmse:
            best = Polynomial(degrees, rms(left), rms(held_out))
    return best


def by_length(fit: Fit) -> float:
    """Error in sample (N) of a polynomial in pressure for every held length by itself, with up to six numbers each."""
    samples, left = fit.samples, []
    at = np.unique(np.round(samples.contraction, 3), return_inverse=True)[1]
    for k in np.unique(at):
        p, force = samples.pressure[at == k], samples.measured[at == k]
        degree = min(len(DEGREES) - 1, len(np.unique(p)) // 3)
        left.append(np.polynomial.Polynomial.fit(p, force, degree)(p) - force)
    return rms(np.concatenate(left))


# ----------------------------------------------------------------------------------------------------------- in words


def outcome_text(outcome: Outcome) -> str:
    """One set in a few lines."""
    stages, compared = outcome.found.stages, outcome.found.comparison
    free, scale = outcome.free, compared.full_scale
    held_out = stages[-1].held_out_rmse or float("nan")
    added = len(outcome.found.task.names) - len(outcome.task.names)
    n = lambda value: f"{amount(value, 'N')} ({percent(value / scale)})"  # noqa: E731
    lines = [
        outcome.task.experiments[0].name,
        f"  first effect  {'+'.join(stages[1].added) if len(stages) > 1 else 'none'}",
        f"  effects       {added} added: {' + '.join(outcome.found.task.names)}",
        f"  error         {n(stages[0].rmse)} -> {n(compared.rmse)}, held out {n(held_out)} of full scale",
        f"  polynomial    {free.degrees} in (contraction, pressure): {n(free.rmse)}, held out {n(free.held_out_rmse)};"
        f" one per length {n(outcome.per_length)}",
        f"  geometry      {geometry_text(compared.fit, outcome.task.experiments[0].priors)}",
        f"  rubber        {rubber_text(outcome.found)}",
        f"  held          {', '.join(name for stage in stages for name in stage.held) or 'nothing'}",
        f"  verdict       {verdict_text(outcome.found.diagnosis)}",
        f"  time          {outcome.wall:.0f} s wall, {outcome.cpu:.0f} s CPU",
    ]
    return "\n".join(lines)


def geometry_text(fit: Fit, priors: dict[str, tuple[float, float]]) -> str:
    """Each measured size: as fitted, as stated, and how many errors of the statement lie between."""
    return "; ".join(
        f"{name.removeprefix('muscle.')} {showing.show(fit.values[name], fit.layout.entry(name).unit)} ("
        f"{showing.show(mean, fit.layout.entry(name).unit, sd)} measured, {(fit.values[name] - mean) / sd:+.1f} errors)"
        for name, (mean, sd) in priors.items()
    )


def rubber_text(found: Discovery) -> str:
    """The numbers of the rubber in the final model."""
    fit = found.comparison.fit
    names = {name for name in found.task.names if getattr(found.task.library[name], "family", None) == RUBBER}
    shown = [
        f"{name} = {showing.show(fit.values[name], fit.layout.entry(name).unit, fit.error(name))}"
        for name in fit.values
        if name.split(".")[0] in names
    ]
    return "; ".join(shown) or "none"


if __name__ == "__main__":
    prepare()
    for place in data_sets(sys.argv[1:]):
        print(identifiers(outcome_text(discovered(place))), flush=True)
