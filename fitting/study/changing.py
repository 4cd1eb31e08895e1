"""Adding effects to a model, or dropping them: a joint refit before and after."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from fitting import full_names
from fitting.comparison.compare import Comparison, compare
from fitting.diagnosis.step_rules import RULES
from fitting.errors import InputError, unknown_name
from fitting.least_squares.evaluate import held_out_rmse
from fitting.least_squares.record import Fit
from fitting.library.library import effects_named
from fitting.study.confined import confined, denied_sizes
from fitting.study.stages import Stage
from fitting.study.task import Task, check_needs, fit_task
from mckibben_jax.effect import Effect, name_of
from mckibben_jax.model import with_effects


@dataclass(frozen=True)
class Change:
    """A model before and after."""

    before: Fit  # with stated sizes confined as in the model after, if they are
    after: Fit
    comparison: Comparison  # of the model after
    stages: tuple[Stage, ...]
    task: Task  # with the model after

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
    return replace(changed, varying=task.varying.among(names))


def change(task: Task, changed: Task, by: Difference, progress: Callable[[str, float], None]) -> Change:
    """Fit before and after.

    Where the model after denies a stated size, both are fitted again with the stated sizes confined, as a discovery
    does: many readings that a wrong law misses alike outweigh a caliper that is right.
    """
    progress("fitting the model as it is", 0.05)
    before = fit_task(task)
    progress("fitting the changed model", 0.35)
    after = fit_task(_beginning_at(changed, before))
    stages = [_stage(task, before, "model before")]
    held = denied_sizes(after, changed.varying.free)
    if held:
        progress("the same with the sizes of the muscle as measured", 0.65)
        task, changed = (replace(each, experiments=confined(each.experiments)) for each in (task, changed))
        before = fit_task(task)
        after = fit_task(_beginning_at(changed, before))
        stages.append(replace(_stage(task, before), held=held))
    progress("comparing", 0.9)
    last = _stage(changed, after)
    assert last.comparison is not None
    stages.append(replace(last, added=by.added, dropped=by.dropped))
    return Change(before, after, last.comparison, tuple(stages), changed)


def _beginning_at(changed: Task, before: Fit) -> Task:
    """The changed model, to be fitted from the values of the one before."""
    return replace(
        changed, known={name: value for name, value in before.values.items() if name in changed.layout.names}
    )


def _stage(task: Task, fit: Fit, label: str = "") -> Stage:
    return Stage(label, fit.rmse, held_out_rmse(fit), comparison=compare(fit, task.experiments))
