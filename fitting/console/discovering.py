"""A discovery: its steps, and the model that it ends with."""

from collections.abc import Sequence
from dataclasses import dataclass

from fitting.compare import Comparison, compare
from fitting.console.study import Progress
from fitting.console.task import Task, fitted, merged
from fitting.diagnosis.record import Diagnosis
from fitting.discover import discover
from fitting.figures import Stage
from fitting.reading.own_effects import named
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
    effects = task.effects
    for step in steps[1:]:
        effects = merged(effects, [kind() for kind in named(step.effect.split("+"), task.library)])
    final = task.with_effects(effects)
    stages = tuple(
        Stage(f"+ {step.effect}" if number else step.effect, step.rmse, step.held_out_rmse, step.verdict)
        for number, step in enumerate(steps)
    )
    return Discovery(stages, final, compare(fitted(final), final.experiments), steps[-1].diagnosis)
