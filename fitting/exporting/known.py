"""What the data of a model say of it, for whoever exports it: its force error, and draws of its parameters."""

import sqlite3
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from fitting.errors import InputError
from fitting.exporting.draws import Draws, normal_draws, posterior_draws
from fitting.exporting.force_error import ForceError, force_error, unknown_error
from fitting.exporting.settings import EXPORT
from fitting.least_squares.record import Fit
from fitting.posterior.record import Posterior
from fitting.posterior.stored import stored_posterior
from fitting.study.fitted_data import fitted_data
from fitting.study.request import CHAINS
from fitting.study.task import Task


@dataclass(frozen=True)
class Known:
    """A model at its values on the data that it was fitted to, and its posterior where one was sampled."""

    task: Task
    fit: Fit
    posterior: Posterior | None
    note: str = ""  # why there is none though a file of chains is there

    @property
    def origin(self) -> str:
        """Where the uncertainty is from, in words."""
        return "robust covariance of the fit" if self.posterior is None else f"posterior, {self.posterior.method}"

    def error(self) -> ForceError:
        """The largest force error to expect."""
        covariance = self._covariance()
        if self.posterior is not None or not self.fit.free:
            return force_error(self.fit, self.task.experiments, covariance, self.origin)
        origin = f"{self.origin}, for readings of the same instruments"
        return force_error(self.fit, self.task.experiments, covariance, origin, self.fit.robust)

    def draws(self, count: int, seed: int, dataset: str | None = None) -> Draws:
        """So many sets of parameters of one data set, the first unless named; InputError where none varies."""
        names = [each.name for each in self.task.experiments]
        number = names.index(dataset) if dataset else 0
        return self._draws(count, seed).of_set(self.fit.layout.names_of(number).values())

    def _draws(self, count: int, seed: int) -> Draws:
        if not self.fit.free:
            cure = "a value with +/- in muscle.toml varies, and so do the parameters of effects"
            raise InputError("no parameter of this model varies, so that there is nothing to draw", cure=cure)
        if self.posterior is None:
            drawn = normal_draws(self.fit, count, seed)
            return replace(drawn, origin=drawn.origin + self.note)
        return posterior_draws(self.fit, self.posterior, count, seed)

    def _covariance(self) -> np.ndarray:
        """Of the parameters, for readings on the same rig: its instruments err there as they did before."""
        if self.posterior is None or not self.fit.free:
            return self.fit.repeatable
        return np.cov(posterior_draws(self.fit, self.posterior, EXPORT.spread_draws, 0).values.T).reshape(
            self.fit.robust.shape
        )


def known_of(given: dict[str, Any]) -> Known:
    """From what was typed: the data of --data, or those beside the model file. InputError where they cannot be used."""
    task, fit, folder = fitted_data(given)
    kept = folder / CHAINS
    found = _posterior(kept, task, fit)
    note = f"; {kept} holds no posterior of this model" if found is None and kept.is_file() else ""
    return Known(task, fit, found, note)


def _posterior(kept: Path, task: Task, fit: Fit) -> Posterior | None:
    if not kept.is_file() or not fit.free:
        return None
    try:
        return stored_posterior(kept, fit, task.experiments, seed=task.seed, priors=task.priors)
    except (OSError, sqlite3.Error) as error:
        raise InputError(f"the stored posterior cannot be read: {error}", kept, cure="move the file away") from None


def error_of(given: dict[str, Any]) -> ForceError:
    """The force error of a model file, or why it is not known: an export does not fail for lack of data."""
    try:
        return known_of(given).error()
    except InputError as error:
        return unknown_error(f"{error.problem} ({error.cure})" if error.cure else error.problem)
