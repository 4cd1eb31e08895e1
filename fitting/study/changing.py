"""Adding effects to a model, or dropping them: a joint refit before and after."""

import dataclasses
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from fitting import full_names
from fitting.comparison.compare import Comparison, compare
from fitting.diagnosis.step_rules import RULES
from fitting.errors import InputError, unknown_name
from fitting.least_squares.evaluate import held_out_rmse
from fitting.least_squares.record import Fit
from fitting.library.library import effects_named
from fitting.study.stages import Stage
from fitting.study.task import Task, check_needs, fit_task
from mckibben_jax.effect import Effect, name_of
from mckibben_jax.model import with_effects


@dataclass(frozen=True)
class Change:
    """A model before and after."""

    before: Fit
    after: Fit
    comparison: Comparison  # of the model after
    stages: tuple[Stage, ...]

    @property
    def worse(self) -> bool:
        """Whether a model that contains the one before describes the data worse: its search was caught on its way."""
        contains = set(self.before.layout.templates[0].names) < set(self.after.layout.templates[0].names)
        return contains and self.after.cost > (1 + RULES.rounding) * self.before.cost

    @property
    def held_out_rmse(self) -> float:
        """Error on held-out runs, after."""
        return self.stages[-1].held_out_rmse or 0.0


@dataclass(frozen=True)
class Difference:
    """Names of effects by which one model differs from another; where some were added, the dropped gave way to them."""

    added: tuple[str, ...] = ()
    dropped: tuple[str, ...] = ()


def with_added(task: Task, names: Sequence[str]) -> tuple[Task, Difference]:
    """The task with effects added, each in place of its rival."""
    names = tuple(dict.fromkeys(names))
    present = {name_of(effect): effect for effect in task.effects}
    for name in names:
        if name in present:
            raise InputError(f"{name} is in the model already", cure="'mckibben fit' fits it again")
    new = tuple(kind() for kind in effects_named(names, task.library))
    changed = _changed(task, with_effects(task.effects, new))
    return changed, Difference(names, tuple(name for name in present if name not in changed.names))


def with_dropped(task: Task, names: Sequence[str]) -> tuple[Task, Difference]:
    """The task without these effects."""
    for name in names:
        if name not in task.names:
            raise unknown_name("effect of the model", name, task.names)
    left = tuple(effect for effect in task.effects if name_of(effect) not in names)
    if not any(effect.stage == "stored" for effect in left):
        raise InputError("nothing would be left that pulls", value=", ".join(names), cure="keep one stored effect")
    return _changed(task, left), Difference(dropped=tuple(names))


def _changed(task: Task, effects: Sequence[Effect]) -> Task:
    changed = task.with_effects(effects)
    check_needs(changed)
    names = {name for full in changed.layout.names for name in (full, full_names.common(full))}
    return dataclasses.replace(changed, varying=task.varying.among(names))


def change(task: Task, changed: Task, by: Difference, progress: Callable[[str, float], None]) -> Change:
    """Fit before and after."""
    progress("fitting the model as it is", 0.05)
    before = fit_task(task)
    progress("fitting the changed model", 0.45)
    known = {name: value for name, value in before.values.items() if name in changed.layout.names}
    after = fit_task(dataclasses.replace(changed, known=known))
    progress("comparing", 0.9)
    first, last = compare(before, task.experiments), compare(after, changed.experiments)
    stages = (
        Stage("model before", before.rmse, held_out_rmse(before), comparison=first),
        Stage("", after.rmse, held_out_rmse(after), comparison=last, added=by.added, dropped=by.dropped),
    )
    return Change(before, after, last, stages)
