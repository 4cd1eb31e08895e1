"""What the workbench does, without its looks: a session is a row of steps, and every action gives a new session."""

import dataclasses
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np

from fitting import units
from fitting.compare import Comparison, compare
from fitting.console.changing import with_added, with_dropped
from fitting.console.diagnosing import candidates_of, diagnosed
from fitting.console.options import Asked
from fitting.console.task import Task, as_known, fitted, task_of
from fitting.diagnosis.record import Diagnosis
from fitting.errors import InputError
from fitting.figures import Stage
from fitting.least_squares import Fit
from fitting.reading.define import defined_name
from fitting.reading.model_file import write_model
from fitting.reading.own_effects import with_line
from fitting.residuals import Problem, Samples, problem
from fitting.showing.loops_picture import Frame, frame, key, loops_html, thinned_in_words
from fitting.showing.page import as_text, page
from fitting.showing.panels import panels
from fitting.showing.sentences import judged, verdict_in_words
from fitting.solving.evaluate import left_out_rmse
from fitting.solving.unknowns import Unknowns

Progress = Callable[[str, float], None]
NEXT, POSTERIOR = "What to measure next", "What the data leave open"
PLACES = 201  # of a slider
AROUND = 10.0  # standard errors that a slider goes to either side, if that is more than the value itself


@dataclass(frozen=True)
class Step:
    """One model on the way. Before its first fit there is no comparison, only a model at its starting values."""

    words: str
    typed: tuple[str, ...]  # what the command line would be told: the command, then names
    task: Task
    comparison: Comparison | None = None
    left_out: float | None = None
    diagnosis: Diagnosis | None = None
    said: tuple[tuple[str, str], ...] = ()  # titles and texts of what else was asked

    @property
    def fit(self) -> Fit | None:
        """The fitted model."""
        return None if self.comparison is None else self.comparison.fit

    @property
    def stage(self) -> Stage:
        """The step as a bar of the picture that shows the error falling."""
        assert self.comparison is not None  # only steps that were fitted are drawn
        verdict = "" if self.diagnosis is None else self.diagnosis.verdict
        return Stage(self.words, self.comparison.rmse, self.left_out, verdict, self.comparison.fit.residual)

    @cached_property
    def laid_out(self) -> "LaidOut":
        """The step's model as one compiled function."""
        return laid_out(self.task, self.fit)


@dataclass(frozen=True)
class Session:
    """What one user has done so far; immutable, so that two browser tabs cannot mix and undoing is to go back."""

    asked: Asked
    steps: tuple[Step, ...]

    @property
    def last(self) -> Step:
        """Where the user is."""
        return self.steps[-1]

    @property
    def stages(self) -> tuple[Stage, ...]:
        """The steps that were fitted."""
        return tuple(step.stage for step in self.steps if step.comparison is not None)


# ------------------------------------------------------------------------------------------------------------ actions


def opened(asked: Asked) -> Session:
    """Read the data and lay out the model; nothing is fitted yet, so that there is something to see at once."""
    task = task_of(asked)
    return Session(asked, (Step("the model as it is", ("fit",), task),))


def begun(session: Session, told: Progress) -> Session:
    """The first step fitted, where its values are not known from a model file."""
    told("fitting the model", 0.1)
    step = session.last
    fit, _ = as_known(step.task)
    return _with_last(session, _compared(step, fit, told))


def added(session: Session, names: Sequence[str], told: Progress) -> Session:
    """Effects added, each in place of its rival, and everything fitted again."""
    changed, words = with_added(session.last.task, names)
    return _refitted(session, changed, words, ("add", *names), told)


def dropped(session: Session, names: Sequence[str], told: Progress) -> Session:
    """Effects taken out, and everything fitted again."""
    changed, words = with_dropped(session.last.task, names)
    return _refitted(session, changed, words, ("drop", *names), told)


def defined(session: Session, line: str) -> tuple[Session, str]:
    """The session in which one line defines an effect, and that effect's name. The line is parsed, never run."""
    step = session.last
    known = with_line(step.task.library, line.strip(), "the line")
    name = defined_name(line)
    asked = dataclasses.replace(session.asked, define=(*session.asked.define, line.strip()))
    session = dataclasses.replace(session, asked=asked)
    return _with_last(session, dataclasses.replace(step, task=dataclasses.replace(step.task, library=known))), name


def undone(session: Session) -> Session:
    """One step back; the first stays."""
    return dataclasses.replace(session, steps=session.steps[:-1] or session.steps)


def examined(session: Session, told: Progress, candidates: Sequence[str] = ()) -> Session:
    """The last step with its diagnosis."""
    task = session.last.task
    found, compared = diagnosed(task, candidates_of(task, candidates), told)
    step = session.last
    comparison = step.comparison or compared
    left_out = found.held_out_rmse if step.left_out is None else step.left_out
    return _with_last(
        session, dataclasses.replace(step, comparison=comparison, left_out=left_out, diagnosis=found)
    )


def planned(session: Session, told: Progress) -> Session:
    """Which recording would tell apart what the diagnosis leaves tied."""
    from fitting.planning.protocol import plan_of, plan_report

    step = session.last
    if step.diagnosis is None:
        raise InputError("there is no diagnosis yet", cure="run it first: the plan separates what it leaves tied")
    told("planning", 0.1)
    plan = plan_of(step.task, step.diagnosis, session.asked.data)
    return _saying(session, NEXT, as_text(plan_report(plan)))


def sampled(session: Session, told: Progress, seconds: float = 60.0) -> Session:
    """What the data leave open of the parameters, sampled for at most so long."""
    from fitting.posterior import sample
    from fitting.sampling.record import describe

    step, fit = session.last, _fit_of(session)
    found = sample(
        fit,
        step.task.experiments,
        seed=step.task.seed,
        limit_s=seconds,
        progress=lambda done, worth: told(f"{done} steps, {worth:.0f} independent samples", 0.5),
    )
    return _saying(session, POSTERIOR, describe(found))


def designed(spec: str, told: Progress) -> str:
    """The muscle that does best what a design file asks for, in words."""
    from fitting.designs.file import read_design
    from fitting.designs.words import describe
    from mckibben_jax.design import design

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "design.toml"
        path.write_text(spec, encoding="utf-8")
        told("designing", 0.1)
        try:
            task = read_design(path)
        except InputError as error:
            error.file = None  # the user has not named it
            raise
    return describe(design(task))


def _saying(session: Session, title: str, text: str) -> Session:
    said = tuple(entry for entry in session.last.said if entry[0] != title)
    return _with_last(session, dataclasses.replace(session.last, said=(*said, (title, text))))


def _refitted(session: Session, changed: Task, words: str, typed: tuple[str, ...], told: Progress) -> Session:
    told(f"fitting the model {words}", 0.1)
    before = session.last.fit.values if session.last.fit is not None else session.last.task.known
    known = {name: value for name, value in before.items() if name in changed.layout.names}
    task = dataclasses.replace(changed, known=known)
    step = _compared(Step(words, typed, task), fitted(task), told)
    return dataclasses.replace(session, steps=(*session.steps, step))


def _compared(step: Step, fit: Fit, told: Progress) -> Step:
    told("comparing", 0.8)
    comparison = compare(fit, step.task.experiments)
    told("leaving runs out", 0.9)
    task = dataclasses.replace(step.task, known=fit.values)
    return dataclasses.replace(step, task=task, comparison=comparison, left_out=left_out_rmse(fit))


def _with_last(session: Session, step: Step) -> Session:
    return dataclasses.replace(session, steps=(*session.steps[:-1], step))


# ------------------------------------------------------------------------------------------------------------ sliders


@jax.jit
def _data_rows(given: Problem, vector: jax.Array, switches: jax.Array) -> jax.Array:
    return given.data_rows(vector, switches)


@dataclass(frozen=True)
class Slider:
    """One parameter to move: its places in a unit for people, and the one where the fit is."""

    name: str
    unit: str
    size: float  # how much of SI one of the unit is
    places: tuple[float, ...]
    start: float

    @property
    def label(self) -> str:
        """Name and unit."""
        return f"{self.name} [{self.unit}]" if self.unit else self.name


@dataclass(frozen=True)
class LaidOut:
    """A model and its data as one compiled function of the parameters: numbers in, numpy out."""

    layout: Unknowns
    given: Problem
    samples: Samples
    vector: np.ndarray
    switches: np.ndarray
    sliders: tuple[Slider, ...]

    def residual(self, values: dict[str, float] | None = None) -> np.ndarray:
        """Model minus measurement with some parameters moved (by full name, SI), in the recordings' units."""
        vector = self.vector.copy()
        for name, value in (values or {}).items():
            vector[self.layout.names.index(name)] = value
        rows = _data_rows(self.given, jnp.asarray(vector), jnp.asarray(self.switches))
        return np.asarray(rows) * self.samples.sigma

    def moved(self, shown: dict[str, float]) -> dict[str, float]:
        """Values of sliders in SI; only those that were moved."""
        return {s.name: shown[s.name] * s.size for s in self.sliders if shown.get(s.name, s.start) != s.start}


def laid_out(task: Task, fit: Fit | None) -> LaidOut:
    """The task's model at its fitted values, or at those where a search would start."""
    if fit is None:
        layout = task.layout
        given, samples = problem(task.experiments, layout)
        vector = np.array([task.known.get(n, s) for n, s in zip(layout.names, layout.start, strict=True)])
        switches = np.ones(len(layout.templates[0].effects))
    else:
        layout, given, samples, vector, switches = fit.layout, fit.problem, fit.samples, fit.vector, fit.switches
    names = [name for name in task.varying(layout) if fit is None or name not in fit.held]
    sliders = tuple(_slider(layout, vector, name, 0.0 if fit is None else fit.error(name)) for name in names)
    return LaidOut(layout, given, samples, vector, switches, sliders)


def _slider(layout: Unknowns, vector: np.ndarray, name: str, error: float) -> Slider:
    at = layout.names.index(name)
    entry, value = layout.entries[at], float(vector[at])
    reach = max(abs(value), AROUND * error if np.isfinite(error) else 0.0, 0.01 * (entry.upper - entry.lower))
    lower, upper = max(entry.lower, value - reach), min(entry.upper, value + reach)
    unit, size = units.shown_in(entry.unit, max(abs(lower), abs(upper)))
    places = np.unique(np.append(np.linspace(lower, upper, PLACES), value)) / size
    shown = [float(f"{place:.5g}") for place in places]
    return Slider(name, unit, size, tuple(dict.fromkeys(shown)), float(f"{value / size:.5g}"))


# ------------------------------------------------------------------------------------------------------------ pictures


def frames_of(step: Step) -> list[Frame]:
    """The axes of every run, drawn once for a step; the model of the moment is laid over them."""
    residual = step.laid_out.residual()
    shown = panels(step.task.experiments, step.laid_out.samples, residual)
    return [frame(panel, k, [residual]) for k, panel in enumerate(shown)]


def loops_of(step: Step, frames: Sequence[Frame], moved: dict[str, float]) -> tuple[str, float]:
    """Measured and model as HTML with some parameters moved (SI), and the rms error then (of force, if any)."""
    residual = step.laid_out.residual(moved)
    runs = sum(len(r.runs) for e in step.task.experiments for r in e.recordings)
    words = thinned_in_words(frames, runs)
    picture = f"{key(frames)}{loops_html(frames, [residual])}<p class='thinned'>{words}</p>"
    force = np.array([block.of_force for block in step.laid_out.given.blocks])[step.laid_out.samples.recording]
    mine = residual[force] if force.any() else residual
    return picture, float(np.sqrt(np.mean(mine**2)))


# ----------------------------------------------------------------------------------------------------------- downloads


def model_text(session: Session) -> str:
    """The fitted model as a model.toml."""
    fit = _fit_of(session)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "model.toml"
        why = write_model(path, fit, session.last.task.experiments)
        if why:
            raise InputError(why)
        return path.read_text(encoding="utf-8")


def report_text(session: Session) -> str:
    """The report page, with every step."""
    step = session.last
    if step.comparison is None:
        raise InputError("nothing was fitted yet", cure="wait for the first fit")
    diagnosis = next((s.diagnosis for s in reversed(session.steps) if s.diagnosis is not None), None)
    posterior = dict(step.said).get(POSTERIOR, "")
    return page(step.task, step.comparison, diagnosis, session.stages, posterior=posterior)


def _fit_of(session: Session) -> Fit:
    if session.last.fit is None:
        raise InputError("nothing was fitted yet", cure="wait for the first fit")
    return session.last.fit


SCRIPT = '''"""What was done at the workbench, to be run again: python session.py [DATASET]"""

import subprocess
import sys

DATA = sys.argv[1:] or {data!r}
COMMANDS = {commands}

for name, *arguments in COMMANDS:
    command = ["mckibben", name, *DATA, *arguments]
    print("$", *command, flush=True)
    ended = subprocess.run([sys.executable, "-m", "fitting.cli", *command[1:]])
    if ended.returncode:
        sys.exit(ended.returncode)
'''


def script_text(session: Session) -> str:
    """The session as a Python script that gives the same commands."""
    asked, commands = session.asked, []
    model = _model_words(asked)
    for number, step in enumerate(session.steps):
        if step.comparison is None:
            continue
        saved = f"session_model_{number}.toml"
        commands.append([step.typed[0], *step.typed[1:], *model, "--save", saved])
        model = ["--model", saved, *_data_words(asked)]
        if step.diagnosis is not None:
            commands.append(["diagnose", *model])
    commands.append(["report", *model, "--no-diagnosis", "--html", "session_report.html"])
    lines = ",\n".join(f"    {command!r}" for command in commands)
    return SCRIPT.format(data=list(asked.data), commands=f"[\n{lines},\n]")


def _data_words(asked: Asked) -> list[str]:
    words = [word for name in ("muscle", "test", "effect_file") if getattr(asked, name)
             for word in (f"--{name.replace('_', '-')}", getattr(asked, name))]  # fmt: skip
    defined_ones = [word for line in asked.define for word in ("--define", line)]
    return [*words, *defined_ones, "--seed", str(asked.seed)]


def _model_words(asked: Asked) -> list[str]:
    chosen = ["--baseline"] if asked.baseline else ["--model", asked.model] if asked.model else []
    return [*chosen, *_data_words(asked)]


# --------------------------------------------------------------------------------------------------------------- words


def where_we_are(session: Session) -> str:
    """The state of the session in one sentence."""
    step = session.last
    if step.comparison is None:
        return "The model at its starting values: it is being fitted."
    if step.diagnosis is not None:
        return verdict_in_words(step.diagnosis)
    return judged(step.comparison)
