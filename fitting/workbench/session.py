"""What the workbench does, without its looks: a session is a row of steps, and every action gives a new session."""

import dataclasses
import functools
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, TypeVar, cast

import numpy as np

from fitting import showing
from fitting.comparison.compare import Comparison, compare
from fitting.diagnosis.record import Diagnosis
from fitting.errors import InputError
from fitting.least_squares.evaluate import held_out_rmse
from fitting.least_squares.record import Fit
from fitting.library.library import with_line
from fitting.library.line import defined_name
from fitting.progress import Progress
from fitting.report.pictures.loops import Frame, frame, key, loops_html, thinning_text
from fitting.report.pictures.panels import panels
from fitting.report.text.comparison import judgement
from fitting.report.text.diagnosis import verdict_text
from fitting.study.changing import Difference, with_added, with_dropped
from fitting.study.diagnosing import candidates_of, diagnose_task
from fitting.study.known import as_known
from fitting.study.request import Request
from fitting.study.stages import Stage
from fitting.study.task import Task, fit_task, task_of
from fitting.workbench.sliders import LaidOut, lay_out

if TYPE_CHECKING:
    from fitting.posterior.sample import Posterior

Action = TypeVar("Action", bound=Callable[..., Any])  # of a session or a step, its first argument


def in_own_units(action: Action) -> Action:
    """What is said of a session or a step is said in the units that its data are measured in.

    Every action runs in a thread of its own, which knows nothing of what another thread speaks.
    """

    @functools.wraps(action)
    def spoken(of: Any, *given: Any, **named: Any) -> Any:
        with showing.spoken(of.units):
            return action(of, *given, **named)

    return cast("Action", spoken)


AS_BEFORE = Difference()


@dataclass(frozen=True)
class Answer:
    """What is answered to one question: words as on the terminal, and pictures (captions and SVG)."""

    title: str
    text: str
    pictures: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True)
class Step:
    """One model on the way. Before its first fit there is no comparison, only a model at its starting values."""

    label: str  # of a model that was not made of the one before it
    typed: tuple[str, ...]  # what the command line would be told: the command, then names
    task: Task
    comparison: Comparison | None = None
    held_out_rmse: float | None = None
    diagnosis: Diagnosis | None = None
    by: Difference = AS_BEFORE
    sought: tuple[str, ...] = ()  # what the diagnosis looked for; empty: everything
    posterior: "Posterior | None" = None
    said: tuple[Answer, ...] = ()  # to what else was asked
    before: float | None = None  # RMS error of the model that this one was made of, SI

    @property
    def fit(self) -> Fit | None:
        """The fitted model."""
        return None if self.comparison is None else self.comparison.fit

    @property
    def stage(self) -> Stage:
        """The step as a bar of the picture that shows the error falling."""
        assert self.comparison is not None  # only steps that were fitted are drawn
        verdict = "" if self.diagnosis is None else self.diagnosis.verdict
        return Stage(
            self.label,
            self.comparison.rmse,
            self.held_out_rmse,
            verdict,
            self.comparison,
            added=self.by.added,
            dropped=self.by.dropped,
            diagnosis=self.diagnosis,
            p_value=None if self.diagnosis is None else self.diagnosis.p_value,
        )

    @property
    def units(self) -> dict[str, str]:
        """The units that its data are measured in, where those are not the usual ones."""
        return showing.own_units(given for e in self.task.experiments for given in e.units)

    @cached_property
    def laid_out(self) -> LaidOut:
        """The step's model as one compiled function."""
        with showing.spoken(self.units):
            return lay_out(self.task, self.fit)


@dataclass(frozen=True)
class Session:
    """What one user has done so far; immutable, so that two browser tabs cannot mix and undoing is to go back."""

    request: Request
    steps: tuple[Step, ...]

    @property
    def last(self) -> Step:
        """Where the user is."""
        return self.steps[-1]

    @property
    def stages(self) -> tuple[Stage, ...]:
        """The steps that were fitted."""
        return tuple(step.stage for step in self.steps if step.comparison is not None)

    @property
    def units(self) -> dict[str, str]:
        """The units that its data are measured in."""
        return self.last.units


def open_session(request: Request) -> Session:
    """Read the data and lay out the model; nothing is fitted yet, so that there is something to see at once."""
    task = task_of(request)
    return Session(request, (Step("the first model", ("fit",), task),))


@in_own_units
def fit_first(session: Session, progress: Progress) -> Session:
    """The first step fitted, where its values are not known from a model file."""
    progress("fitting the model", 0.1)
    step = session.last
    fit, _ = as_known(step.task)
    return with_last(session, _compared(step, fit, progress))


@in_own_units
def add(session: Session, names: Sequence[str], progress: Progress) -> Session:
    """Effects added, each in place of its rival, and everything fitted again."""
    changed, by = with_added(session.last.task, names)
    return _refitted(session, changed, by, ("add", *names), progress)


@in_own_units
def drop(session: Session, names: Sequence[str], progress: Progress) -> Session:
    """Effects taken out, and everything fitted again."""
    changed, by = with_dropped(session.last.task, names)
    return _refitted(session, changed, by, ("drop", *names), progress)


def define(session: Session, line: str) -> tuple[Session, str]:
    """The session in which one line defines an effect, and that effect's name. The line is parsed, never run."""
    step = session.last
    known = with_line(step.task.library, line.strip(), "the line")
    name = defined_name(line)
    request = dataclasses.replace(session.request, define=(*session.request.define, line.strip()))
    session = dataclasses.replace(session, request=request)
    return with_last(session, dataclasses.replace(step, task=dataclasses.replace(step.task, library=known))), name


def undo(session: Session) -> Session:
    """One step back; the first stays."""
    return dataclasses.replace(session, steps=session.steps[:-1] or session.steps)


@in_own_units
def examine(session: Session, progress: Progress, candidates: Sequence[str] = ()) -> Session:
    """The last step with its diagnosis."""
    task = session.last.task
    found, compared = diagnose_task(task, candidates_of(task, candidates), progress)
    step = session.last
    comparison = step.comparison or compared
    alike = step.held_out_rmse is None and comparison.unit == "N"  # a diagnosis is in N, whatever was measured
    held_out = found.held_out_rmse if alike else step.held_out_rmse
    return with_last(
        session,
        dataclasses.replace(
            step, comparison=comparison, held_out_rmse=held_out, diagnosis=found, sought=tuple(candidates)
        ),
    )


def told(session: Session, answer: Answer) -> Session:
    """The session in which this was answered, in place of an earlier answer to the same question."""
    said = tuple(each for each in session.last.said if each.title != answer.title)
    return with_last(session, dataclasses.replace(session.last, said=(*said, answer)))


def _refitted(session: Session, changed: Task, by: Difference, typed: tuple[str, ...], progress: Progress) -> Session:
    progress("fitting the changed model", 0.1)
    values = session.last.fit.values if session.last.fit is not None else session.last.task.known
    known = {name: value for name, value in values.items() if name in changed.layout.names}
    task = dataclasses.replace(changed, known=known)
    before = None if session.last.comparison is None else session.last.comparison.rmse
    step = _compared(Step("", typed, task, by=by, before=before), fit_task(task), progress)
    return dataclasses.replace(session, steps=(*session.steps, step))


def _compared(step: Step, fit: Fit, progress: Progress) -> Step:
    progress("comparing", 0.8)
    comparison = compare(fit, step.task.experiments)
    progress("leaving runs out", 0.9)
    task = dataclasses.replace(step.task, known=fit.values)
    return dataclasses.replace(step, task=task, comparison=comparison, held_out_rmse=held_out_rmse(fit))


def with_last(session: Session, step: Step) -> Session:
    """The session whose last step is this one."""
    return dataclasses.replace(session, steps=(*session.steps[:-1], step))


@in_own_units
def frames_of(step: Step) -> list[Frame]:
    """The axes of every run, drawn once for a step; the model of the moment is laid over them."""
    residual = step.laid_out.residual()
    shown = panels(step.task.experiments, step.laid_out.samples, residual)
    return [frame(panel, k, [residual]) for k, panel in enumerate(shown)]


@in_own_units
def loops_of(step: Step, frames: Sequence[Frame], moved: dict[str, float]) -> tuple[str, float]:
    """Measured and model as HTML with some parameters moved (SI), and the rms error then (of force, if any)."""
    residual = step.laid_out.residual(moved)
    runs = sum(len(r.runs) for e in step.task.experiments for r in e.recordings)
    words = thinning_text(frames, runs)
    picture = f"{key(frames)}{loops_html(frames, [residual])}<p class='thinned'>{words}</p>"
    return picture, error_of(step, residual)


def error_of(step: Step, residual: np.ndarray) -> float:
    """Root mean square of model minus measured (of force, if any), SI."""
    mine = residual[step.laid_out.given.of_force(step.laid_out.samples)]
    return float(np.sqrt(np.mean(mine**2)))


def fit_of(session: Session) -> Fit:
    """The last fit; InputError before the first."""
    if session.last.fit is None:
        raise InputError("nothing was fitted yet", cure="wait for the first fit")
    return session.last.fit


@in_own_units
def where_we_are(session: Session) -> str:
    """The state of the session in one sentence, in which names are marked."""
    step = session.last
    if step.comparison is None:
        return "The model at its starting values: it is being fitted."
    if step.diagnosis is not None:
        return verdict_text(step.diagnosis)
    return judgement(step.comparison)
