"""A model at the values that are known of it, and what it predicts where nothing of it is fitted."""

import dataclasses

from fitting.least_squares.evaluate import evaluate
from fitting.least_squares.record import Fit
from fitting.study.task import Task, fit_task


def as_known(task: Task) -> tuple[Fit, tuple[str, ...]]:
    """The task's model at the values that are known; what is not known is fitted first, and named."""
    layout, free = task.layout, task.free_names
    missing = tuple(name for name in free if name not in task.known)
    if missing == free and free:
        return fit_task(task), missing
    values = task.known
    if missing:
        held = tuple(name for name in layout.names if name in task.known)
        values = fit_task(dataclasses.replace(task, varying=task.varying.fixing(*held))).values
    return evaluate(task.experiments, task.effects, values, free, task.varying.own), missing


def unfitted(task: Task) -> Fit:
    """The task's model at the values that are known, and else as measured and declared: nothing is fitted."""
    return evaluate(task.experiments, task.effects, task.known, (), task.varying.own)
