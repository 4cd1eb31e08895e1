"""Instruments as answers: how large each error seems, may be, and had to be to explain a misfit."""

import numpy as np
from scipy.optimize import minimize_scalar

from fitting.diagnosis.candidate_fit import CandidateFit
from fitting.diagnosis.examine import Examiner
from fitting.diagnosis.findings import InstrumentAnswer, Source
from fitting.diagnosis.instrument_errors import InstrumentErrors
from fitting.diagnosis.missing_effect import Ground
from fitting.diagnosis.nuisance import Nuisance
from fitting.diagnosis.settings import INSTRUMENTS, InstrumentSettings
from fitting.diagnosis.working_noise import Whitener, orthonormal
from fitting.least_squares.decomposed import svd


def instrument_answers(
    examiner: Examiner, fit: CandidateFit, rejected: bool, settings: InstrumentSettings = INSTRUMENTS
) -> tuple[InstrumentAnswer, ...]:
    """Of every error that an instrument could make, in a fitted set; `rejected` is whether anything is missing."""
    every, ground = examiner.errors(fit, every=True), examiner.ground(fit)
    _, columns = examiner.columns(fit, {}, glance=True) if rejected else ([], None)
    answers = []
    for source in every.sources:
        times = likeliest_size(ground, every, source, fit, settings)
        needed = None
        if columns is not None and times * source.width > source.allowed:
            wide = every.chosen([s for s in every.sources if s.allowed > 0 or s == source]).widened(source, times)
            needed = None if examiner.rejected(fit, wide, columns) else times * source.width
        answers.append(InstrumentAnswer(source, times * source.width, needed))
    return tuple(answers)


def likeliest_size(
    ground: Ground, every: InstrumentErrors, source: Source, fit: CandidateFit, settings: InstrumentSettings
) -> float:
    """The size of one error, in widths of its columns, of the largest restricted likelihood.

    Whitened by noise and all other errors, and free of the parameters, scores along the columns' own directions have
    the variances 1 + (size x strength)^2.
    """
    noise = Whitener.of(ground.noise, ground.samples, ground.flip_groups.together)
    others = every.chosen([s for s in every.sources if s.allowed > 0 and s != source])
    white = others.changed(noise(others.per_run), noise(others.shared)).whitener()
    mine = white(noise(every.chosen([source]).columns))
    by = Nuisance.of(fit)
    slopes = np.vstack([white(noise(by.slopes)), by.prior_slopes])
    known = orthonormal(slopes)
    free = lambda rows, prior: _free_of(known, np.concatenate([rows, prior]))  # noqa: E731
    side, strength, _ = svd(free(mine, np.zeros((len(by.prior_rows), mine.shape[1]))))
    seen = strength > settings.visible
    score = side[:, seen].T @ free(white(noise(fit.rows)), by.prior_rows)
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
