"""A fitted muscle examined once: its model checked against its data, diagnosed, and sampled around its mode."""

from collections.abc import Sequence

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from fitting.errors import InputError
from fitting.exporting.table import forces, free_contraction
from fitting.full_names import owner_of
from fitting.identified.record import Behaviour, Identified, Known
from fitting.least_squares.record import Fit
from fitting.posterior.quick import quick_look
from fitting.posterior.record import Posterior
from fitting.progress import Progress
from fitting.study.diagnosing import diagnose_task
from fitting.study.known import as_known
from fitting.study.task import Task
from mckibben_jax.effect import name_of
from mckibben_jax.model import Model
from mckibben_jax.state import State

USUAL_PRESSURE = 3e5  # Pa, at which muscles are compared; the highest of the data where they end below it; chosen


def identified(task: Task, name: str, progress: Progress) -> Identified:
    """The record of the muscle of one data set, with the model and the values of its model file."""
    if len(task.experiments) != 1:
        raise InputError("a muscle is identified from one data set", cure="name one folder")
    (experiment,) = task.experiments
    progress("evaluating the model", 0.0)
    fit, missing = as_known(task)
    if missing:
        raise InputError(f"the model has no value for {missing[0]}", experiment.folder, cure="'mckibben fit' first")
    progress("diagnosing", 0.1)
    found, compared = diagnose_task(task, None, lambda text, share: progress(text, 0.1 + 0.7 * share))
    progress("the posterior around the mode", 0.8)
    posterior = quick_look(fit, task.experiments, seed=task.seed, priors=task.priors) if fit.free else None
    pressures = [run.pressure for recording in experiment.recordings for run in recording.runs]
    return Identified(
        name=name,
        effects=task.names,
        parameters={each: _known(fit, each, posterior) for each in fit.layout.names},
        behaviour=behaviour(fit.model(), pressures, _friction_is_seen(fit)),
        rmse=compared.rmse,
        held_out_rmse=found.held_out_rmse,
        full_scale=compared.full_scale,
        readings=len(fit.samples),
        verdict=found.verdict.value,
        explanations=found.explanations,
        is_trusted=posterior is None or posterior.trusted,
        source=dict(experiment.source),
        sha256=experiment.sha256,
    )


def _known(fit: Fit, name: str, posterior: Posterior | None) -> Known:
    error = fit.error(name)
    middle = posterior.parameters.get(name) if posterior is not None and posterior.trusted else None
    return Known(
        fit.values[name],
        fit.layout.entry(name).unit,
        str(fit.state(name)),
        float(error) if np.isfinite(error) else None,
        None if middle is None else float(middle.q05),
        None if middle is None else float(middle.q95),
    )


def _friction_is_seen(fit: Fit) -> bool:
    """Whether the data constrain what is lost to motion: nothing of it was held at a value that nobody measured."""
    lost = {name_of(effect) for effect in fit.layout.templates[0].effects if effect.stage == "lost"}
    return not any(owner_of(name) in lost for name in fit.held)


def behaviour(whole: Model, pressures: Sequence[np.ndarray], friction_is_seen: bool) -> Behaviour:
    """What a muscle does at a usual pressure, or at the highest that was recorded (arrays, Pa)."""
    highest = max(float(np.max(values)) for values in pressures)
    pressure = min(USUAL_PRESSURE, highest)
    stroke = free_contraction(whole, pressure)
    places = np.array([0.0, stroke / 2, stroke / 2, stroke / 2])
    rest, there, back, _ = forces(whole, places, np.full(4, pressure), np.array([0.0, 1.0, -1.0, 0.0]))
    section = np.pi * float(whole.muscle.radius) ** 2
    return Behaviour(
        pressure, float(rest), float(rest / (pressure * section)), stroke,
        float(back - there) if friction_is_seen else None, _rubber(whole, stroke / 2, pressure),
    )  # fmt: skip


def _rubber(whole: Model, contraction: float, pressure: float) -> float:
    """With how much the rubber opposes, N."""
    state = State(jnp.asarray(contraction), jnp.asarray(pressure))
    memories = whole.start_memories(state)
    return 0.0 - float(eqx.filter_jit(lambda m, s: m.pull(m.felt_now(s, memories), memories)[1])(whole, state))
