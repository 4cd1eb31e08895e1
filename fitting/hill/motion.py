"""Is there viscosity in the motion? Models without and with Hill's force, fitted to the recorded positions."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import count
from typing import Any

import jax.numpy as jnp
import numpy as np

from fitting.errors import InputError
from fitting.hill.hill import Curves, HillCurve, curves, releases
from fitting.hill.settings import MOTION
from fitting.least_squares.fit import fit
from fitting.least_squares.record import Fit
from fitting.recordings.noise import noise_of
from fitting.recordings.records import Experiment, Run
from fitting.study.task import Task
from mckibben_jax.effect import Effect
from mckibben_jax.effects import LIBRARY
from mckibben_jax.model import with_effects

CURVE = "force-velocity curve"  # what an effect declares that it gives: its parameters are a ratio a/F0 and a speed b


@dataclass(frozen=True)
class Motions:
    """Two models fitted to the recorded positions: without viscosity, and with Hill's."""

    dry: Fit
    viscous: Fit
    read_again: tuple[HillCurve, ...] = ()  # curves through speeds read off the motion of the viscous model itself

    @property
    def errors(self) -> tuple[float, float]:
        """Root mean square errors of both, m."""
        return self.dry.rmse, self.viscous.rmse

    @property
    def direct(self) -> dict[str, tuple[float, float]]:
        """Hill's numbers from the motion itself, with robust errors, by full name."""
        names = [name for name in self.viscous.layout.names if name not in self.dry.layout.names]
        return {name: (self.viscous.values[name], self.viscous.error(name)) for name in names}

    @property
    def at_ends(self) -> tuple[str, ...]:
        """Those of Hill's numbers that ended at an end of their range."""
        return tuple(name for name in self.direct if name in self.viscous.at_bound)

    def straight(self, fastest: float) -> bool:
        """Whether Hill's force is a plain drag, (F0 + a)/b times the speed, up to the `fastest` speed (m/s)."""
        speeds = {entry.name for entry in self.viscous.layout.entries if entry.unit == "m/s"}
        return any(value > MOTION.straight * fastest for name, (value, _) in self.direct.items() if name in speeds)

    @property
    def explained(self) -> bool:
        """Whether the better of the two leaves no more than noise."""
        return min(self.dry.over_noise, self.viscous.over_noise) < MOTION.far


def motions(task: Task, read: Sequence[Curves]) -> Motions:
    """The task's model without and with Hill's viscous force, fitted to the releases.

    The model with Hill's force begins where the one without it ends, the force as faint as its range allows (which is
    not absence: some 10 N at 1 m/s and 900 N); where the other leaves more than noise, also from the numbers `read` off
    the speeds.
    """
    experiments = releases(task.experiments)
    options: dict[str, Any] = task.asked | {"shooting": task.shooting}
    dry_effects = [effect for effect in task.effects if CURVE not in effect.gives]
    dry = fit(experiments, dry_effects, start=task.known, starts=min(task.starts, MOTION.starts), **options)
    curve = read[0].hill
    begins = [(curve.curvature, MOTION.faded)]
    begins += [(curve.curvature, curve.b)] if dry.over_noise > MOTION.far else []
    viscous = []
    for curvature, b in begins:
        effects = with_effects(dry_effects, [_force_velocity_law()(jnp.asarray(curvature), jnp.asarray(b))])
        viscous.append(fit(experiments, effects, start={**task.known, **dry.values}, starts=1, **options))
    found = Motions(dry, min(viscous, key=lambda each: each.rmse))
    return replace(found, read_again=_read_again(experiments, found.viscous)) if found.explained else found


def _read_again(experiments: Sequence[Experiment], fit: Fit) -> tuple[HillCurve, ...]:
    """Hill's curves through the speeds of a fitted model, read as those of the muscle; none where it moves no load."""
    try:
        return tuple(one.hill for one in curves(_as_modelled(experiments, fit)))
    except (InputError, ValueError):  # ValueError: speeds that no curve can begin from
        return ()


def _as_modelled(experiments: Sequence[Experiment], fit: Fit) -> list[Experiment]:
    """The same releases with the positions of a fitted model in place of those that were read."""
    number, made = count(), []
    for experiment in experiments:
        recordings = [
            replace(one, noise=noise_of(one), runs=tuple(_run_as_modelled(run, fit, next(number)) for run in one.runs))
            for one in experiment.recordings
        ]
        made.append(replace(experiment, recordings=tuple(recordings)))
    return made


def _run_as_modelled(run: Run, fit: Fit, number: int) -> Run:
    mine = fit.samples.run == number
    place = np.array(run.measured)
    place[fit.samples.position[mine]] = (fit.samples.measured + fit.residual)[mine]
    return replace(run, measured=place)


def _force_velocity_law() -> Callable[..., Effect]:
    """The library's effect that gives a force-velocity curve."""
    return next(kind for kind in LIBRARY if CURVE in kind.gives)
