"""The user's recordings once more, of a muscle whose truth is known: its own protocol, instruments and noise."""

from collections.abc import Sequence
from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np

from fitting.compiled.traced import kept
from fitting.diagnosis.search import Search
from fitting.least_squares.search import HERE
from fitting.problem.residuals import Problem, problem
from fitting.problem.sizes import Standard
from fitting.recordings.again import recorded_again
from fitting.recordings.presumed import allowed
from fitting.recordings.records import Experiment, Recording
from fitting.selftest.instruments import Rig


@kept(like=HERE)
def _rows(given: Problem, vector: jax.Array, switches: jax.Array) -> jax.Array:
    return given.rows(vector, switches, switches > 0)


def rehearsed(
    search: Search, experiments: Sequence[Experiment], effects: frozenset[str], vector: np.ndarray, seed: int
) -> list[Experiment]:
    """These data sets (of force, with every reading) as the rig would record them if the muscle were as told.

    `effects` are those of the truth, `vector` the values of all unknowns of the search's universe. Whatever errs is
    drawn anew from `seed`. What the rig imposed is what the real recording's estimates say.
    """
    random, forces = np.random.default_rng(seed), iter(_forces(search, experiments, effects, vector))
    noise, made, common = search.examiner.noise(search.base), [], {}
    for experiment in experiments:
        recordings, muscle = [], experiment.muscle
        for recording in experiment.recordings:
            shown = [next(forces) for _ in recording.runs]
            shared = common.setdefault(allowed(recording), {})
            rig = Rig(recording, noise, _stride(search, experiments), random, shared)
            recordings.append(recorded_again(recording, rig.readings(shown, float(muscle.length)), muscle))
        made.append(replace(experiment, recordings=tuple(recordings)))
    return made


def _forces(
    search: Search, experiments: Sequence[Experiment], effects: frozenset[str], vector: np.ndarray
) -> list[np.ndarray]:
    """What the load cell would show without errors at every sample of every run, N."""
    world = search.world
    everywhere = [replace(e, recordings=tuple(map(_every_sample, e.recordings))) for e in experiments]
    given, samples = problem(everywhere, world.layout)
    usual = Standard.of(given)
    switches = jnp.asarray(world.switches(effects))
    rows = np.asarray(_rows(usual.problem, jnp.asarray(vector), switches))[usual.rows][: len(samples)]
    shown = rows * samples.sigma + samples.measured
    return [shown[samples.run == run] for run in np.unique(samples.run)]


def _every_sample(recording: Recording) -> Recording:
    return replace(recording, runs=tuple(replace(run, weight=np.ones(len(run))) for run in recording.runs))


def _stride(search: Search, experiments: Sequence[Experiment]) -> float:
    """How many samples of the recordings lie between two of those that the search works with."""
    every = sum(float(run.weight.sum()) for e in experiments for r in e.recordings for run in r.runs)
    return max(every / len(search.world.samples), 1.0)
