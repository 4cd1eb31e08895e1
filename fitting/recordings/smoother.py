"""Estimate a signal from readings with white error: a fixed-interval smoother with its bandwidth by likelihood.

Pressure and length are read with an error, but enter the laws as if exact. What this file gives back is the best
estimate of the signal behind the readings and the variance of that estimate.

The model is that of the Kalman and Rauch-Tung-Striebel smoother with a local level and a local slope:

    reading = level + white error of variance R,    d level = slope dt,    d slope = sqrt(q) dW  (Wiener process)

Its smoothed level is the cubic smoothing spline (Wahba 1978; Kohn and Ansley 1987). Divided second differences z of
the readings are free of the unknown first level and slope, and their covariance has five bands, so that likelihood,
estimate and variance come from one banded Cholesky factor, in time proportional to the number of samples and for any
spacing of them. The ratio q/R maximises this (restricted) likelihood. Where the slope may change abruptly, at turning
points and where the readings themselves say so, it is free (auxiliary residuals: Harvey and Koopman 1992); a jump of
the level is two such places side by side.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import cho_solve_banded
from scipy.ndimage import maximum_filter1d
from scipy.optimize import minimize_scalar

from fitting.recordings import contrasts as algebra
from fitting.recordings.contrasts import Contrasts


@dataclass(frozen=True)
class Settings:
    """Constants of the method; all without unit."""

    fewest: int = 10  # samples: below, R and q cannot be told apart; the likelihood has n - 2 degrees of freedom
    smallest: float = -10.0  # log10 of q dt^3/R: about 1,000 samples are averaged; below, rounding (1e-16) is near
    largest: float = 5.0  # log10 of q dt^3/R: at 1e5 the level follows each reading to one part in 1e5
    grid: int = 7  # values of log10(q dt^3/R) from which the search begins: the likelihood is smooth over 2.5 decades
    evidence: float = 6.63  # twice the log-likelihood ratio that says it moves: chi-squared (1), 1 %
    slope: float = 2.58  # standard errors from which a straight line is no constant: normal, 1 %
    abrupt: float = 5.0  # standard errors of a change: 1 in 1,000 runs of 1,000 samples shows one by chance (normal)
    expected: float = 2.58  # standard errors of the same where a change is expected, at turning points: normal, 1 %
    dust: float = 1e-12  # of the largest reading: errors below are those of arithmetic
    rounds: int = 30  # searches for changes at most; each finds several
    follows: float = 1.0  # q dt^3/R from which on less than a sample is averaged: the readings are their own signal
    reach: float = 3.0  # bandwidths, (R/q dt^3)^(1/4) samples, within which two changes would be told as one


SETTINGS = Settings()


@dataclass(frozen=True)
class Estimate:
    """A signal behind its readings, and its time derivative; arrays have the shape of the readings, and SI units.

    Where the slope is free to change abruptly, at a turning point, it is that of the branch which ends there.
    """

    level: np.ndarray
    variance: np.ndarray  # of `level`
    error: float  # standard deviation of one reading's white error
    constant: bool = False  # within its error the signal does not change
    slope: np.ndarray | None = None  # time derivative of `level`; None where the readings themselves are the level
    slope_variance: np.ndarray | None = None  # of `slope`

    @classmethod
    def as_read(cls, readings: np.ndarray, error: float) -> "Estimate":
        """The readings themselves, each with this standard deviation."""
        return cls(readings, np.full(len(readings), error**2), error, bool(np.ptp(readings) == 0))


def estimate(
    time: np.ndarray,
    readings: np.ndarray,
    rounding: float = 0.0,
    turns: np.ndarray | None = None,
    noise: float | None = None,
) -> Estimate:
    """The signal behind `readings` (n,), taken at `time` (n,), rising.

    `rounding` is the step in which they are rounded (same unit): their error is at least rounding/sqrt(12). `turns`
    (n,), bool, says where an abrupt change of slope is expected. `noise` is the standard deviation of one reading,
    rounding included, where it is known; else the likelihood says it. The signal is a constant or a straight line
    unless the likelihood ratio says otherwise at 1 %.
    """
    error = max(rounding / np.sqrt(12) if noise is None else noise, SETTINGS.dust * float(np.abs(readings).max()))
    if len(readings) < SETTINGS.fewest or (np.ptp(readings) == 0 and noise is None):
        return Estimate.as_read(readings, error)
    at = algebra.clock(time)
    contrasts = algebra.contrasts_of(at, readings, error**2, np.inf if noise is None else error**2)
    ratio = _likeliest(contrasts)
    line = _line(at, readings, contrasts)
    still = contrasts.misfit(algebra.size_of_noise(at, contrasts), line.squares)
    if still - contrasts.misfit_at(ratio) < SETTINGS.evidence:
        return _by_seconds(line.estimate, time)
    expected = np.zeros(len(at) - 2, bool) if turns is None else turns[1:-1]
    return _by_seconds(_smoothed(at, readings, contrasts, ratio, expected), time)


def _by_seconds(found: Estimate, time: np.ndarray) -> Estimate:
    """The same with its slope per second instead of per mean step."""
    if found.slope is None or found.slope_variance is None:
        return found
    rate = (len(time) - 1) / float(time[-1] - time[0])
    return replace(found, slope=rate * found.slope, slope_variance=rate**2 * found.slope_variance)


def _likeliest(contrasts: Contrasts) -> float:
    """The ratio q/R (time in mean steps) of largest likelihood."""
    contrasts = contrasts.pieces()
    grid = np.linspace(SETTINGS.smallest, SETTINGS.largest, SETTINGS.grid)
    values = [contrasts.misfit_at(10.0**each) for each in grid]
    best = int(np.argmin(values))
    around = (grid[max(best - 1, 0)], grid[min(best + 1, len(grid) - 1)])
    found = minimize_scalar(
        lambda each: contrasts.misfit_at(10.0**each), bounds=around, method="bounded", options={"xatol": 0.03}
    )
    return 10.0 ** (found.x if found.fun < values[best] else grid[best])


@dataclass(frozen=True)
class _Line:
    """What is left of the model where q is zero."""

    estimate: Estimate
    squares: float  # of what the line leaves


def _line(at: np.ndarray, readings: np.ndarray, contrasts: Contrasts) -> _Line:
    """The straight line through the readings, or their mean if its slope cannot be told from zero."""
    count, mean, spread = len(at), float(readings.mean()), float(at @ at)
    slope = float(at @ (readings - mean)) / spread
    squares = float(((readings - mean - slope * at) ** 2).sum())
    variance = contrasts.variance(squares)
    error = float(np.sqrt(variance))
    unsure = np.full(count, variance / spread)
    if abs(slope) < SETTINGS.slope * np.sqrt(variance / spread):
        level, known = np.full(count, mean), np.full(count, variance / count)
        return _Line(Estimate(level, known, error, True, np.zeros(count), unsure), squares)
    level, known = mean + slope * at, variance * (1 / count + at**2 / spread)
    return _Line(Estimate(level, known, error, False, np.full(count, slope), unsure), squares)


def _smoothed(at: np.ndarray, readings: np.ndarray, contrasts: Contrasts, ratio: float, turns: np.ndarray) -> Estimate:
    """Level and slope at this ratio; abrupt changes that the readings show are set free first."""
    for left in range(SETTINGS.rounds, -1, -1):
        factor = contrasts.factor(ratio)
        solved, inverse = cho_solve_banded((factor, True), contrasts.z), algebra.inverse_bands(factor)
        variance = contrasts.variance(float(contrasts.z @ solved))
        found = _abrupt(solved, inverse * variance, ratio, turns) & ~contrasts.free
        if not (left and found.any()):
            break
        contrasts = replace(contrasts, free=contrasts.free | found)
        ratio = _likeliest(contrasts)
    error, known = float(np.sqrt(variance)), algebra.explained(contrasts.weights, inverse)
    off = algebra.spread(contrasts.weights * solved)
    slope = unsure = None
    if ratio < SETTINGS.follows:
        slope = algebra.slopes(at, readings - off, np.asarray(ratio * solved))
        unsure = variance * _slope_variance(at, contrasts.free, ratio)
    believed = np.abs(off) > SETTINGS.abrupt * error  # a single reading far off: a valve that springs back, for example
    off, known = np.where(believed, 0.0, off), np.where(believed, 0.0, known)
    return Estimate(readings - off, variance * np.clip(1 - known, 0.0, 1.0), error, False, slope, unsure)


def _slope_variance(at: np.ndarray, free: np.ndarray, ratio: float) -> np.ndarray:
    """Variance (n,) of the slope per R, per squared step.

    Far from ends it is that of the steady state, (q/R)^(3/4)/(2 sqrt(2)); within a bandwidth of an end, or of a place
    where the slope is free, that of a filter, which knows one side only: four times as large (Harvey 1989, 4.5). Where
    a whole piece between two such places is shorter, it is that of a line through its n readings, 12/n^3.
    """
    edges = np.concatenate([[0], np.flatnonzero(free) + 1, [len(at) - 1]])
    piece = np.clip(np.searchsorted(edges, np.arange(len(at)), side="left"), 1, len(edges) - 1)
    first, last = at[edges[piece - 1]], at[edges[piece]]
    near = np.minimum(at - first, last - at) < ratio**-0.25
    steady = ratio**0.75 / (2 * np.sqrt(2)) * np.where(near, 4.0, 1.0)
    return np.maximum(steady, 12 / (last - first + 1) ** 3)


def _abrupt(solved: np.ndarray, inverse: np.ndarray, ratio: float, turns: np.ndarray) -> np.ndarray:
    """Contrasts (n-2,), bool, at which slope or level change by more than the model allows.

    A statistic is the amount of a change over its standard error; within a bandwidth only the largest is believed.
    A jump of the level between two samples is in two contrasts, with opposite signs.
    """
    beside = inverse[0, :-1] + inverse[0, 1:] - 2 * inverse[1, :-1]
    kink = np.abs(solved) / np.sqrt(inverse[0])
    jump = np.abs(np.diff(solved)) / np.sqrt(np.maximum(beside, 1e-300))
    width = 2 * int(min(SETTINGS.reach * ratio**-0.25, len(kink) / 2) + 2) + 1
    highest = [maximum_filter1d(each, width, mode="constant") for each in (kink, np.append(jump, 0.0))]
    here = np.maximum(*highest)
    found = (kink > SETTINGS.abrupt) & (kink == here) | turns & (kink > SETTINGS.expected)
    jumps = np.flatnonzero((jump > SETTINGS.abrupt) & (jump == here[:-1]))
    found[jumps] = found[jumps + 1] = True
    return found
