"""A discovery: its steps, and the model that it ends with."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from fitting.comparison.compare import Comparison, compare
from fitting.diagnosis.course import Step
from fitting.diagnosis.discover import discover
from fitting.diagnosis.record import Diagnosis
from fitting.diagnosis.step_rules import RULES
from fitting.diagnosis.tiers import WORTH_IT
from fitting.least_squares.evaluate import evaluate
from fitting.least_squares.record import Fit
from fitting.library.library import effects_named
from fitting.progress import Progress
from fitting.recordings.records import MOVING_TESTS, force_was_measured
from fitting.study.confined import confined, denied_sizes
from fitting.study.practice import ENOUGH
from fitting.study.stages import Stage
from fitting.study.task import Task, fit_task
from mckibben_jax.effect import Effect, name_of
from mckibben_jax.model import with_effects


@dataclass(frozen=True)
class Discovery:
    """The steps, the task with the final model, its comparison with the data, and what is said of it."""

    stages: tuple[Stage, ...]
    task: Task
    comparison: Comparison
    diagnosis: Diagnosis


def discover_task(
    task: Task,
    candidates: Sequence[Effect],
    progress: Progress,
    shown: Callable[[Stage], None] = lambda _: None,
    enough: float = ENOUGH,
) -> Discovery:
    """Diagnose and add until nothing more can be said; each step is `shown` as soon as it is made.

    `enough` is the share of full scale that the muscle's user can live with.
    """
    tasks, stages = [task], list[Stage]()

    def made(step: Step) -> None:
        if stages:
            new = [kind() for kind in effects_named(step.added, task.library)]
            kept = [effect for effect in tasks[-1].effects if name_of(effect) not in step.dropped]
            before = tasks[-1]
            there = confined(before.experiments) if step.held else before.experiments
            held = step.held or before.held
            if step.freed:
                there, held = task.experiments, task.held
            tasks.append(replace(task.with_effects(with_effects(kept, new)), experiments=there, held=held))
        label, added = ("", step.added) if stages else (step.effect, ())
        compared = _compared(tasks[-1], step)
        # over all samples, as everywhere else; only motions have an error in N that nothing but a diagnosis knows
        rmse = compared.rmse if compared.unit == "N" else step.rmse
        stages.append(
            Stage(label, rmse, step.held_out_rmse, step.verdict, compared, step.attempts, step.held, added,
                  step.dropped, step.diagnosis.is_strained, step.diagnosis, step.diagnosis.p_value, step.freed,
                  step.exchanged)
        )  # fmt: skip
        shown(stages[-1])

    last = discover(
        task.experiments, task.effects, candidates=candidates, start=task.known, on_step=made, progress=progress,
        rules=replace(RULES, enough=enough), **task.asked,
    )[-1]  # fmt: skip
    # from the values of the last step alone: what was judged is what is saved
    final = replace(tasks[-1], known=last.diagnosis.baseline.values, starts=1)
    compared = compare(fit_task(final), final.experiments)
    stages[-1] = replace(stages[-1], comparison=compared)  # which knows what no step asks: the likelier values
    return Discovery(tuple(stages), tasks[-1], compared, last.diagnosis)


@dataclass(frozen=True)
class OnMotions:
    """The model before and after a discovery, fitted to the positions themselves by the equation of motion."""

    before: Fit
    after: Fit
    held: tuple[str, ...] = ()  # stated sizes that both fits were not free to deny, where the second would have

    @property
    def confirmed(self) -> bool:
        """Whether the motions too are described better; with nothing added there is nothing to confirm."""
        return self.after is self.before or self.after.rmse < WORTH_IT * self.before.rmse


def on_motions(task: Task, found: Discovery, progress: Progress) -> OnMotions | None:
    """Where no force was measured a discovery reads motions as force, which sees no break-away and no standstill: the
    equation of motion has the last word. None where force was measured, for then it was in the fit already,
    and where nothing moves by its own inertia: a load that hangs on a muscle is its force.

    Positions are read so finely that a clock or a scale that errs outweighs every caliper: where they deny a stated
    size, both models are fitted again with the stated sizes confined.
    """
    tests = {recording.test for experiment in task.experiments for recording in experiment.recordings}
    if force_was_measured(task.experiments) or not tests & {*MOVING_TESTS}:
        return None
    progress("fitting the motions themselves, before", 0.9)
    before = fit_task(task)
    if found.task.names == task.names:
        denied = denied_sizes(before, task.varying.free)
        before = fit_task(_confined(task)) if denied else before
        return OnMotions(before, before, denied)
    progress("fitting the motions themselves, after", 0.95)
    held = any(experiment.is_confined for experiment in found.task.experiments)  # those are read as force
    # the discovery has searched from many places: the motions are followed from its values alone
    known = {**before.values, **found.comparison.fit.values}
    larger = replace(task.with_effects(found.task.effects), known=known, starts=1)
    after = fit_task(_confined(larger) if held else larger)
    denied = () if held else denied_sizes(after, task.varying.free)
    if denied:
        progress("fitting the motions themselves with the sizes of the muscle as measured", 0.97)
        before, after = fit_task(_confined(task)), fit_task(_confined(larger))
    return OnMotions(before, after, denied)


def _confined(task: Task) -> Task:
    return replace(task, experiments=confined(task.experiments))


def _compared(task: Task, step: Step) -> Comparison:
    """The model of a step beside every sample; the diagnosis itself may have looked at fewer."""
    values = step.diagnosis.baseline.values
    return compare(
        evaluate(task.experiments, task.effects, values, task.free_names, task.varying.own), task.experiments
    )
