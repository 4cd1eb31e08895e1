"""Isotonic tests read as recordings of force: while it slides, a muscle pulls the load that hangs on it.

The pressure is swept so slowly that the load is hardly accelerated. After the pressure has turned the braid stands
still until friction has changed sides: such samples do not count, for there friction is any force up to its size.
"""

from dataclasses import replace

import numpy as np
from scipy.constants import g

from fitting import showing
from fitting.recordings import motion_signals as signals
from fitting.recordings.inputs import UNKNOWN, smoothed
from fitting.recordings.noise import force_of_errors
from fitting.recordings.records import Experiment, Recording, Run
from fitting.recordings.settings import HUNG
from fitting.recordings.smoother import Estimate

READ = "read as force: the load that hangs, while the muscle moves (a standstill is not seen in it)"


def hung_as_force(recording: Recording, experiment: Experiment) -> tuple[Recording | None, tuple[str, ...]]:
    """An isotonic recording as loops of force, and what to say of it; None where no run has enough readings."""
    runs, refused, behind = list[Run](), list[str](), list[Estimate]()
    for run in recording.runs:
        made, place = _run(run, experiment)
        if np.count_nonzero(made.weight) < HUNG.fewest:
            refused.append(run.name)
        else:
            runs.append(made)
            behind.append(place)
    said = []
    if refused:
        named = f"{'run' if len(refused) == 1 else 'runs'} {', '.join(refused)}"
        said.append(f"not read as force, {named}: the muscle slides evenly in fewer than {HUNG.fewest} readings")
    if not runs:
        return None, tuple(said)
    read = replace(recording, test="loop", runs=tuple(runs), noise=None, noise_of_inputs=0.0, hangs=True)
    return replace(read, noise_of_inputs=_of_inputs(runs, behind, experiment)), (READ, *said)


def _run(run: Run, experiment: Experiment) -> tuple[Run, Estimate]:
    """The run as a loop of force, and its contraction as it is behind the readings."""
    assert run.load is not None  # an isotonic test without a load is refused where it is read
    length = float(experiment.muscle.length)
    branches = signals.branches_from_labels(run.branch)
    begins = np.flatnonzero(np.diff(run.rate != 0)) + 1  # to slide, or stops: both are abrupt
    edges = np.unique(np.concatenate([branches.edges, begins]))
    place = smoothed(run.time, run.measured / length, edges[1:-1], UNKNOWN.contraction)
    accelerated = _accelerated(run, length, float(experiment.muscle.moving_mass))
    slides = (run.rate != 0) & ~accelerated
    made = replace(
        run,
        contraction=signals.monotone(place.level, branches),
        contraction_variance=place.variance,
        measured=run.load,
        branch=np.where(slides, run.branch, 0),
        load=None,
        set_pressure=None,
    )
    made = made.leave_out(
        accelerated, f"load accelerated by more than {showing.show(HUNG.inertia, '1', digits=1)} of it"
    )
    near = _near_a_stop(run.rate != 0, place)
    made = made.leave_out(near, "next to where the muscle begins to slide, or stops")
    return made.leave_out(run.rate == 0, "direction of motion unknown (speed below twice its error)"), place


def _near_a_stop(slides: np.ndarray, place: Estimate) -> np.ndarray:
    """Samples whose contraction cannot be told from that at which a stretch of sliding began or ended, a mask.

    There the muscle may still stand, or stand already: a smoothed position leaves its place a little early.
    """
    edges = np.flatnonzero(np.diff(np.concatenate([[False], slides, [False]])))
    near = np.zeros(len(slides), bool)
    for first, last in edges.reshape(-1, 2):
        way = place.level[first:last]
        near[first:last] = np.minimum(np.abs(way - way[0]), np.abs(way - way[-1])) < HUNG.clear * place.error
    return near


def _accelerated(run: Run, length: float, moving_mass: float) -> np.ndarray:
    """Samples around which the force on the moving mass is no small part of the load, a mask."""
    assert run.load is not None
    reach = max(int(HUNG.window * len(run)), 2)
    padded = np.pad(run.rate, reach, mode="edge")
    place = np.pad(run.time, reach, mode="edge")
    change = length * np.abs(padded[2 * reach :] - padded[: -2 * reach])
    mean = change / np.maximum(place[2 * reach :] - place[: -2 * reach], 1e-12)
    return (np.abs(run.load) / g + moving_mass) * mean > HUNG.inertia * np.abs(run.load)


def _of_inputs(runs: list[Run], places: list[Estimate], experiment: Experiment) -> float:
    """Standard deviation (N) of a force for the noise that is left in pressures and contractions."""
    of_place = np.concatenate([place.variance for place in places])
    of_pressure = np.concatenate([np.zeros(1), *(r.pressure_variance for r in runs if r.pressure_variance is not None)])
    errors = float(np.sqrt(np.mean(of_place))), float(np.sqrt(np.mean(of_pressure)))
    return force_of_errors(runs, *errors, experiment.muscle)
