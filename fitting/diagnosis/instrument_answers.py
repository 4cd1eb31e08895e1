"""Instruments as answers: how large each error seems, may be, and had to be to explain a misfit."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import minimize_scalar

from fitting.diagnosis.candidate_fit import CandidateFit
from fitting.diagnosis.examine import Examiner
from fitting.diagnosis.findings import InstrumentAnswer
from fitting.diagnosis.missing_effect import Ground
from fitting.diagnosis.nuisance import Nuisance
from fitting.instruments.errors import InstrumentErrors
from fitting.instruments.settings import INSTRUMENTS, InstrumentSettings
from fitting.instruments.sources import Source
from fitting.least_squares.decomposed import orthonormal, svd
from fitting.threads import at_once


def instrument_answers(
    examiner: Examiner, fit: CandidateFit, rejected: bool, settings: InstrumentSettings = INSTRUMENTS
) -> tuple[InstrumentAnswer, ...]:
    """Of every error that an instrument could make, in a fitted set; `rejected` is whether anything is missing."""
    every = examiner.errors(fit, every=True)
    _, columns = examiner.columns(fit, {}, glance=True) if rejected else ([], None)
    white = WithoutNoise.of(examiner.ground(fit), every, fit)

    def answer(source: Source) -> InstrumentAnswer:
        times = likeliest_size(white, source, settings)
        needed = None
        if columns is not None and times * source.width > source.allowed:
            wide = every.chosen([s for s in every.sources if s.allowed > 0 or s == source]).widened(source, times)
            needed = None if examiner.rejected(fit, wide, columns) else times * source.width
        return InstrumentAnswer(source, times * source.width, needed)

    return tuple(at_once(examiner.world.settings.workers, answer, every.sources))


@dataclass(frozen=True)
class WithoutNoise:
    """A fitted set free of the correlation that noise makes: what instruments could add to it, rows, what gives way."""

    every: InstrumentErrors
    rows: np.ndarray
    by: Nuisance

    @classmethod
    def of(cls, ground: Ground, every: InstrumentErrors, fit: CandidateFit) -> "WithoutNoise":
        """That of one fitted set."""
        errors = every.changed(ground.without_noise(every.per_run), ground.without_noise(every.shared))
        by = replace(Nuisance.of(fit), slopes=ground.without_noise(fit.slopes))
        return cls(errors, ground.without_noise(fit.rows), by)


def likeliest_size(white: WithoutNoise, source: Source, settings: InstrumentSettings = INSTRUMENTS) -> float:
    """The size of one error, in widths of its columns, of the largest restricted likelihood.

    Whitened by noise and all other errors, and free of the parameters, scores along the columns' own directions have
    the variances 1 + (size x strength)^2.
    """
    every, by = white.every, white.by
    without = every.chosen([s for s in every.sources if s.allowed > 0 and s != source]).whitener()
    mine = without(every.chosen([source]).columns)
    known = orthonormal(np.vstack([without(by.slopes), by.prior_slopes]))
    free = lambda rows, prior: _free_of(known, np.concatenate([rows, prior]))  # noqa: E731
    side, strength, _ = svd(free(mine, np.zeros((len(by.prior_rows), mine.shape[1]))))
    seen = strength > settings.visible
    score = side[:, seen].T @ free(without(white.rows), by.prior_rows)
    return _likeliest(strength[seen], score, settings)


def _free_of(known: np.ndarray, rows: np.ndarray) -> np.ndarray:
    return rows - known @ (known.T @ rows)


def _likeliest(strength: np.ndarray, score: np.ndarray, settings: InstrumentSettings) -> float:
    if not len(strength):
        return 0.0

    def unlikely(log: float) -> float:
        variance = 1 + (np.exp(log) * strength) ** 2
        return float(np.sum(np.log(variance) + score**2 / variance))

    low, high = np.log(settings.sizes)
    found = minimize_scalar(unlikely, bounds=(low, high), method="bounded", options={"xatol": 0.02})
    return float(np.exp(found.x)) if found.fun < float(np.sum(score**2)) else 0.0
