"""Fewer samples of a recording than were made, where more change no verdict."""

from dataclasses import replace

import numpy as np

from fitting.recordings.records import Experiment, Run

FEWEST_READINGS = 12  # that a run keeps; chosen: twice as many as errors that single runs may have
FEWEST_RUNS = 10  # that are kept in any case; chosen


def thinned(experiment: Experiment, about: int) -> Experiment:
    """The experiment with about this many weighted samples, of fewer runs where these are very many.

    A run of a few readings could be explained by errors of its own alone.
    """
    return thinned_runs(_fewer_runs(experiment, about // FEWEST_READINGS), about)


def thinned_runs(experiment: Experiment, about: int) -> Experiment:
    """All runs with about this many weighted samples together: every k-th, and every turning point and end."""
    weighted = sum(float(run.weight.sum()) for rec in experiment.recordings for run in rec.runs)
    stride = _one_figure(weighted / about)
    if stride < 2:
        return experiment
    recordings = tuple(
        rec if rec.test == "static" else replace(rec, runs=tuple(_every(run, stride) for run in rec.runs))
        for rec in experiment.recordings
    )
    return replace(experiment, recordings=recordings)


def _one_figure(share: float) -> int:
    """Rounded up to one figure: what is sampled ten times as densely then keeps the same places."""
    tens = 10 ** max(int(np.floor(np.log10(max(share, 1.0)))), 0)
    return int(tens * np.ceil(share / tens - 1e-9))


def _every(run: Run, stride: int) -> Run:
    if run.averaging is not None:  # the states that enter a mean stand one beside the other
        return replace(run, weight=run.weight * (np.cumsum(run.usable) % stride == 1))
    kept = np.zeros(len(run), bool)
    kept[::stride] = True
    turns = np.flatnonzero(np.diff(run.half)) + 1
    corner = np.concatenate([[0], turns - 1, turns, [len(run) - 1]])
    kept[corner] = True
    return run.at(kept)


def _fewer_runs(experiment: Experiment, most: int) -> Experiment:
    """About so many of the runs that can be thinned at most, and of every kind of test its share of them."""
    runs = {rec.test: list[Run]() for rec in experiment.recordings if rec.test != "static"}
    for rec in experiment.recordings:
        if rec.test in runs:
            runs[rec.test] += rec.runs
    share = most / max(sum(map(len, runs.values())), 1)
    kept = {id(run) for mine in runs.values() for run in _some(mine, max(round(share * len(mine)), FEWEST_RUNS))}
    recordings = (
        rec if rec.test == "static" else replace(rec, runs=tuple(run for run in rec.runs if id(run) in kept))
        for rec in experiment.recordings
    )
    return replace(experiment, recordings=tuple(rec for rec in recordings if rec.runs))


def _some(runs: list[Run], most: int) -> list[Run]:
    """At most so many of these runs: one by chance of each stretch of them, in order of their states.

    So the same runs are kept in whatever files and order they come, and none of a protocol's regular steps is skipped.
    """
    if len(runs) <= most:
        return runs
    states = [(r.measured.mean(), np.abs(r.rate).mean(), r.contraction.mean(), r.pressure.mean()) for r in runs]
    order = np.lexsort(np.array(states).T)
    edges = np.linspace(0, len(runs), most + 1).round().astype(int)
    return [runs[number] for number in order[np.random.default_rng(0).integers(edges[:-1], edges[1:])]]
