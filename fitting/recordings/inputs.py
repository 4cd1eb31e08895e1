"""Pressure and length as they enter the laws: estimated from their readings, where the readings' errors matter.

An error of these readings stands in every force that a law predicts from them. It matters from a share of the error
of the force reading on; a gauge or encoder better than that is taken as it reads.
"""

from dataclasses import dataclass

import numpy as np

from fitting.recordings import motion_signals as signals
from fitting.recordings import weightless
from fitting.recordings.smoother import Estimate, estimate


@dataclass(frozen=True)
class Settings:
    """Constants of this file; all without unit."""

    # Of a force reading's error. Where the pressure is held, the signature of a supply's lag is nothing but the gauge's
    # error, which the residual shows too: in 10,000 rows this share of it makes a z of 1.
    pressure: float = 0.01
    length: float = 0.1  # of the same: it adds 1 % to the variance; a length moves, and its error is no signature
    noise: float = 1e-4  # of full scale: no load cell is better
    step: float = 1e-3  # contraction over which the slope of the ideal law is taken
    dust: float = 1e-9  # of the largest reading: below is arithmetic
    stamps: float = 1.5  # times the error that rounded time stamps make. The error found from 300 readings is within a
    # tenth of the true one: with half as much again the reading itself errs too


SETTINGS = Settings()


@dataclass(frozen=True)
class WhiteError:
    """What is known of a channel's white error before its readings are looked at, in the unit of the reading."""

    negligible: float = 0.0  # standard deviation up to which a reading is taken as it is
    noise: float | None = None  # standard deviation of one reading, rounding included, as stated
    resolution: float | None = None  # step in which it is rounded, as stated

    @property
    def stated(self) -> float | None:
        """Standard deviation of one reading where it is stated: at least that of its rounding. None: readings tell."""
        return None if self.noise is None else max(self.noise, (self.resolution or 0.0) / np.sqrt(12))


@dataclass(frozen=True)
class InputErrors:
    """The white errors of the channels that enter the laws; what is not known is found in the readings."""

    pressure: WhiteError = WhiteError()  # Pa
    contraction: WhiteError = WhiteError()  # 1


UNKNOWN = InputErrors()


def smoothed(time: np.ndarray, reading: np.ndarray, turns: np.ndarray, white: WhiteError) -> Estimate:
    """The signal behind a reading (n,), however small its error; at the samples `turns` it may turn abruptly.

    A rate feels errors that the force does not: `as_felt` gives the reading itself back where the force does not.
    What looks like an error because time stamps are rounded is none: the force was read at the same moment.
    """
    known = white.stated
    error = signals.noise_level(time, reading) if known is None else known
    least = SETTINGS.dust * float(np.abs(reading).max())
    if known is None:
        least = max(least, SETTINGS.stamps * stamp_error(time, reading))
    if error <= least:
        return Estimate.as_read(reading, error)
    edges = np.unique(np.concatenate([[0], turns, [len(reading) - 1]]))
    near = weightless.near_edges(edges, len(reading)) & (len(turns) > 0)
    step = rounding(reading) if white.resolution is None else white.resolution
    found = estimate(time, reading, step, near, known)
    exact = not found.constant and found.error <= least  # steps and rests of a set-point look like rounding at first
    return Estimate.as_read(reading, found.error) if exact else found


def as_felt(time: np.ndarray, reading: np.ndarray, behind: Estimate, white: WhiteError) -> Estimate:
    """The smoothed signal `behind` a reading, or the reading itself where its error is not felt in the force."""
    error = signals.noise_level(time, reading) if white.stated is None else white.stated
    exact = not behind.constant and behind.error <= white.negligible
    return Estimate.as_read(reading, error) if error <= white.negligible or exact else behind


def stamp_error(time: np.ndarray, reading: np.ndarray) -> float:
    """How far readings seem to err, in their unit, because their time stamps are rounded: speed x step / sqrt(12).

    Zero where the samples are evenly spaced: then the step of the time stamps is the sampling itself.
    """
    steps = np.diff(time)
    step = rounding(time)
    if len(steps) == 0 or step > 0.5 * float(np.median(steps)):
        return 0.0
    path = np.abs(np.diff(reading))
    moving = float(steps[path > 0].sum())
    return float(path.sum()) / moving * step / np.sqrt(12) if moving else 0.0


def rounding(reading: np.ndarray) -> float:
    """The step in which a channel is rounded, in its unit: the largest of which all differences are multiples (Euclid).

    Of readings that are not rounded, arithmetic dust.
    """
    dust = SETTINGS.dust * float(np.abs(reading).max())
    rest, step = np.diff(np.unique(reading)), dust
    while (rest := rest[rest > dust]).size:
        step = float(rest.min())
        rest = np.abs(rest - step * np.round(rest / step))
    return step
