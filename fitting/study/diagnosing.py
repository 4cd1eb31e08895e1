"""A diagnosis with the comparison that goes with it."""

from collections.abc import Sequence
from dataclasses import replace

from fitting.comparison.compare import Comparison, compare
from fitting.diagnosis.diagnose import diagnose, of_force
from fitting.diagnosis.record import Diagnosis
from fitting.errors import InputError
from fitting.least_squares.evaluate import evaluate
from fitting.library.library import effects_named
from fitting.planning.next_measurement import NextMeasurement, next_measurement
from fitting.progress import Progress, part_of
from fitting.recordings.records import force_was_measured
from fitting.study.task import Task
from mckibben_jax.effect import Effect
from mckibben_jax.effects import LIBRARY, SUPPLIES


def candidates_of(task: Task, names: Sequence[str], rivals: bool = False) -> tuple[Effect, ...] | None:
    """What may be missing: as named; else all of the library and the user's own, printed rivals only on request.

    None where that is what `diagnose` looks at anyway.
    """
    if names:
        if set(names) <= set(task.names):
            cure = f"name what it has not, or 'mckibben drop ... {names[0]}' first"
            raise InputError(f"the model has {' and '.join(names)} already", value="--candidates", cure=cure)
        return tuple(kind() for kind in effects_named(names, task.library))
    if not rivals and len(task.library) == len(LIBRARY) + len(SUPPLIES):
        return None
    return all_candidates(task, rivals)


def all_candidates(task: Task, rivals: bool = False) -> tuple[Effect, ...]:
    """All of the library, and the user's own; printed rivals only on request."""
    return tuple(kind() for kind in task.library.values() if rivals or not (kind.rival or kind.on_request))


def in_newtons(task: Task) -> Task:
    """The task as a diagnosis sees it where no force was measured: its motions read as force."""
    if force_was_measured(task.experiments):
        return task
    return replace(task, experiments=tuple(of_force(task.experiments)[0]))


def following(task: Task, found: Diagnosis, progress: Progress) -> NextMeasurement | None:
    """The recording that would tell apart what a verdict "one of" leaves; None with any other verdict."""
    if found.verdict != "one of":
        return None
    extra = [kind() for kind in task.library.values()]
    watched = part_of(progress, 0.95, 1.0)
    return next_measurement(
        found, task.experiments, known=extra, varying=task.varying, seed=task.seed, progress=watched
    )


def diagnose_task(task: Task, candidates: Sequence[Effect] | None, progress: Progress) -> tuple[Diagnosis, Comparison]:
    """Diagnose the task's model, and compare its fitted self with the data (motions as force, if none was measured)."""
    found = diagnose(
        task.experiments, task.effects, candidates=candidates, start=task.known, progress=progress, **task.asked
    )
    task = in_newtons(task)  # errors of a diagnosis are in N
    whole = evaluate(task.experiments, task.effects, found.baseline.values, task.free_names, task.varying.own)
    return found, compare(whole, task.experiments)
