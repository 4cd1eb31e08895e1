"""A discovery: its steps, and the model that it ends with."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fitting.compare import Comparison, compare
from fitting.console.study import Progress
from fitting.console.task import Task, fitted, merged
from fitting.diagnosis.record import Diagnosis
from fitting.discover import Step, discover
from fitting.figures import Stage
from fitting.reading.own_effects import named
from fitting.solving.evaluate import evaluate
from mckibben_jax.effect import Effect


@dataclass(frozen=True)
class Discovery:
    """The steps, the task with the final model, its comparison with the data, and what is said of it."""

    stages: tuple[Stage, ...]
    task: Task
    comparison: Comparison
    diagnosis: Diagnosis


def discovered(task: Task, candidates: Sequence[Effect], told: Progress) -> Discovery:
    """Diagnose and add until nothing more can be said."""
    steps = discover(
        task.experiments,
        task.effects,
        candidates=candidates,
        fix=task.fix,
        free=task.free,
        own=task.own,
        seed=task.seed,
        progress=told,
    )
    effects, stages = task.effects, []
    for number, step in enumerate(steps):
        if number:
            effects = merged(effects, [kind() for kind in named(step.effect.split("+"), task.library)])
        words = f"+ {step.effect}" if number else step.effect
        residual = _residual(task.with_effects(effects), step)
        stages.append(Stage(words, step.rmse, step.held_out_rmse, step.verdict, residual))
    final = task.with_effects(effects)
    return Discovery(tuple(stages), final, compare(fitted(final), final.experiments), steps[-1].diagnosis)


def _residual(task: Task, step: Step) -> np.ndarray:
    """What the model of a step misses on every sample; the diagnosis itself may have looked at fewer."""
    return evaluate(task.experiments, task.effects, step.diagnosis.baseline.values, (), task.own).residual
