"""One session at a rig: runs of random pressure, speed and stroke, recorded by instruments that err."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from fitting.recordings.experiment import read_experiment
from fitting.recordings.records import Experiment

from ..calibration.truths import LEFT_OUT, sized
from ..hidden.instruments import LABORATORY
from ..hidden.rig import Noise, Recording, force_test, polyline
from ..hidden.simulator import Muscle, Truth, dataset, with_baseline, write

FRESH = 20  # runs that no fit sees
SAMPLES = 120  # of a run
NOISE = Noise(sd=0.6, phi=0.7)
SPREAD = {"radius": 1e-4, "braid_angle": float(np.radians(0.5))}  # by which its owner measures the muscle
RIGHT, WRONG = "the model is right", "the model lacks an effect"
MIXED, LATER = "drawn from the session", "recorded after those that were fitted"


@dataclass(frozen=True)
class Session:
    """The runs that are fitted and those that are not, each read from a folder as a user's would be."""

    fitted: Experiment
    fresh: Experiment
    hidden: str | None


def session(number: int, runs: int, group: str, order: str, seed: int, folder: Path) -> Session:
    """Session `number` of a study: so many `runs` to be fitted, and FRESH more."""
    random = np.random.default_rng([seed, number, runs, group == WRONG, order == LATER])
    hidden = LEFT_OUT[number % len(LEFT_OUT)] if group == WRONG else None
    extra = {hidden: sized(hidden, float(np.exp(random.uniform(np.log(0.3), np.log(1.5)))))} if hidden else {}
    truth = Truth(Muscle(shear_modulus=3e5), with_baseline(bladder_neo_hookean={"G": 3e5}, **extra))
    recording = recorded(random, truth, runs + FRESH, int(random.integers(2**31)))
    chosen = np.arange(runs) if order == LATER else random.permutation(runs + FRESH)[:runs]
    is_fitted = np.isin(recording.columns["run"], chosen)
    parts = (part(recording, mask) for mask in (is_fitted, ~is_fitted))
    fitted, fresh = (read(truth, each, number, folder / name) for each, name in zip(parts, "ab", strict=True))
    return Session(fitted, fresh, hidden)


def recorded(random: np.random.Generator, truth: Truth, runs: int, seed: int) -> Recording:
    """A session of so many runs, each of a major and a minor loop."""

    def imposed() -> Iterator[tuple]:
        for _ in range(runs):
            level, speed = random.uniform(1e5, 5e5), np.exp(random.uniform(np.log(0.005), np.log(0.02)))
            top, low = random.uniform(0.15, 0.26), random.uniform(0.0, 0.08)
            turns = (0.0, top, low, 0.8 * top, 0.0)
            time, contraction = polyline(turns, speed / truth.muscle.length, SAMPLES, 0.02)
            yield time, contraction, np.full_like(time, level)

    return force_test(truth, imposed(), NOISE, LABORATORY, seed, "loops.csv", "loop")


def part(recording: Recording, mask: np.ndarray) -> Recording:
    """Some rows of a recording."""
    columns = {name: values[mask] for name, values in recording.columns.items()}
    return replace(recording, columns=columns, clean=recording.clean[mask])


def read(truth: Truth, recording: Recording, number: int, folder: Path) -> Experiment:
    """What the program reads of it; the muscle is stated alike in every part."""
    write(dataset(truth, [recording], "Session", NOISE, number, **SPREAD), folder)
    return read_experiment(folder)
