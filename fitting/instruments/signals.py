"""Channels as a model feels them: their readings, their rates, and the slopes of the rows along them."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from fitting.instruments.settings import INSTRUMENTS, InstrumentSettings
from fitting.problem.residuals import Problem, Samples
from fitting.recordings.accuracy import Channel

RowsAt = Callable[[Problem, Sequence[str]], np.ndarray]


@dataclass(frozen=True)
class Signal:
    """One channel as an error of it is felt: arrays (rows,) of its readings, their rate, and d(row)/d(reading).

    In the channel's unit, rows in the order of measurement; `full_scale` is the largest reading.
    """

    slope: np.ndarray
    reading: np.ndarray
    rate: np.ndarray
    full_scale: float

    def lags(self, run: np.ndarray, widths: Sequence[float]) -> np.ndarray:
        """How far the reading lags behind, from -1 to 1, in cells that turn around within each width (rows, widths).

        Prandtl's play: an instrument whose reading turns follows only when it has moved by twice a width, which is a
        share of full scale. It starts in the middle of its play in every run.
        """
        return np.array([self._lag(run, self.full_scale * width) for width in widths]).T

    def _lag(self, run: np.ndarray, way: float) -> list[float]:
        """The same within one width (rows,); plain numbers, for arrays as small as one step are slow."""
        lags, state, before, last = [], 0.0, None, 0.0
        for one, reading in zip(run.tolist(), self.reading.tolist(), strict=True):
            if one != before:
                before, last, state = one, reading, 0.0
            state = min(max(state + (reading - last) / way, -1.0), 1.0)
            last = reading
            lags.append(state)
        return lags


def channel_signals(
    problem: Problem,
    samples: Samples,
    rows: np.ndarray,
    rows_at: RowsAt,
    lengths: np.ndarray,
    settings: InstrumentSettings = INSTRUMENTS,
) -> dict[Channel, Signal]:
    """The channels as the model's rows feel them: pressure (Pa), position (m of shortening), force (N)."""

    def slope(pressure: float, contraction: float) -> np.ndarray:
        there, back = (rows_at(problem.shifted(sign * pressure, sign * contraction), ()) for sign in (1.0, -1.0))
        return np.nan_to_num((there - back) / (2 * (pressure + contraction)), posinf=0.0, neginf=0.0)

    length = lengths[samples.dataset]
    by_pressure = slope(settings.step * _largest(samples.pressure), 0.0)
    by_contraction = slope(0.0, settings.step)
    position = length * samples.contraction
    force = samples.measured + rows * samples.sigma  # as predicted: no error of the reading
    of_force = _of_force(problem, samples)
    by_position = np.where(of_force, by_contraction / length, -1 / samples.sigma)
    of_pressure, of_length = by_pressure * samples.pressure_rate, by_contraction * samples.rate
    # a force that stays the same is never late, but the pressure may be late against the length
    rate = np.where(of_held_force(samples, settings), of_pressure, of_pressure + of_length) * samples.sigma
    return {
        Channel.PRESSURE: Signal(by_pressure, samples.pressure, samples.pressure_rate, _largest(samples.pressure)),
        Channel.POSITION: Signal(by_position, position, length * samples.rate, _largest(position)),
        Channel.FORCE: Signal(np.where(of_force, -1 / samples.sigma, 0.0), force, rate, _largest(samples.measured)),
    }


def of_held_force(samples: Samples, settings: InstrumentSettings) -> np.ndarray:
    """Rows of runs in which the force stays the same, as under a load that hangs, a mask."""
    held = np.zeros(len(samples.run), bool)
    for one in np.unique(samples.run):
        mine = samples.run == one
        force = samples.measured[mine]
        steady = float(np.std(force)) < settings.held_force * float(np.median(samples.sigma[mine]))
        held[mine] = steady and len(force) >= settings.held_readings
    return held


def _of_force(problem: Problem, samples: Samples) -> np.ndarray:
    """Which rows measure force; the others measure the position itself, and a problem with such has all its blocks."""
    which = np.array([block.of_force for block in problem.blocks])
    return np.ones(len(samples), bool) if which.all() else which[samples.recording]


def _largest(values: np.ndarray) -> float:
    return max(float(np.max(np.abs(values))), 1e-300)
