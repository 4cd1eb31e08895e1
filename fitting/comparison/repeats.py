"""What repeated loops at equal state tell: how well the rig agrees with itself, whatever the model."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from fitting.comparison.settings import ERRORS
from fitting.problem.residuals import Samples


@dataclass(frozen=True)
class Pair:
    """One branch and its next repetition: how much the residual differs, sample by sample."""

    difference: np.ndarray  # later minus earlier, N
    spread: np.ndarray  # variance of the difference, in units of the variance of one reading
    run: int  # of which run

    @property
    def variance(self) -> float:
        """Variance of one reading."""
        return float(np.mean(self.difference**2 / self.spread))

    @property
    def shift(self) -> float:
        """How much the residual changes on average, N."""
        return float(np.mean(self.difference))

    @property
    def own_variance(self) -> float:
        """Variance of one reading beside that change."""
        return float(np.mean((self.difference - self.shift) ** 2 / self.spread))


@dataclass(frozen=True)
class OneWay:
    """What every loop differs by from the one before, always in one direction: the muscle or the rig changes."""

    shift: float  # of the residual from loop to loop, N or m: positive where the later one pulls less
    runs: int  # all of which agree in the direction


def find_repeats(samples: Samples, residual: np.ndarray, pressure_led: np.ndarray) -> tuple[Pair, ...]:
    """Every branch beside its next repetition at equal pressure, speed and turning points.

    `pressure_led` marks samples of tests in which the pressure moves and the length is held (or follows).
    """
    found: dict[tuple, list[np.ndarray]] = {}
    for at in _branches(samples):
        found.setdefault(_key(samples, at, bool(pressure_led[at[0]])), []).append(at)
    return tuple(
        pair
        for alike in found.values()
        for earlier, later in pairwise(alike)
        if (pair := _pair(samples, residual, earlier, later, bool(pressure_led[earlier[0]]))) is not None
    )


def noise_floor(pairs: tuple[Pair, ...]) -> float | None:
    """Standard deviation of one reading from repetitions, N; None without any.

    The median over pairs: a first loop with a fresh memory may differ from the second for a good reason. What changes
    in every run in the same direction is no noise, and is left out.
    """
    if not pairs:
        return None
    steady = one_way(pairs) is None
    return float(np.sqrt(np.median([pair.variance if steady else pair.own_variance for pair in pairs])))


def one_way(pairs: tuple[Pair, ...]) -> OneWay | None:
    """Whether loops change in one direction by more than they scatter; None where they do not, or in few runs.

    By the signs of the runs, which are independent where the branches of one loop are not: six that agree come about by
    chance in one of 32 rigs.
    """
    runs = {pair.run: [p.shift for p in pairs if p.run == pair.run] for pair in pairs}
    shifts = np.array([np.mean(each) for each in runs.values()])
    agree = len(shifts) >= ERRORS.fewest_agreeing and abs(np.sum(np.sign(shifts))) == len(shifts)
    if not agree or np.mean(shifts**2) < np.median([pair.own_variance for pair in pairs]):
        return None
    return OneWay(float(np.mean(shifts)), len(shifts))


def drift(pairs: tuple[Pair, ...]) -> float | None:
    """Root mean square of how far a branch moves from one repetition to the next, N; None without any."""
    if not pairs:
        return None
    moved = [np.mean(pair.difference) ** 2 - pair.variance * np.mean(pair.spread) / len(pair.spread) for pair in pairs]
    return float(np.sqrt(max(np.mean(moved), 0.0)))


def _branches(samples: Samples) -> list[np.ndarray]:
    """Positions of the samples of each half-loop, in the order of measurement."""
    _, first, of = np.unique(np.stack([samples.run, samples.half]), axis=1, return_index=True, return_inverse=True)
    parts = [np.flatnonzero(of == k) for k in np.argsort(first)]
    return [part for part in parts if len(part) >= ERRORS.fewest_shared]


def _key(samples: Samples, at: np.ndarray, pressure_led: bool) -> tuple:
    """What two branches must have in common, coarse enough for a real rig."""
    stroke = max(float(np.ptp(samples.contraction)), 1e-9)
    full = max(float(np.max(np.abs(samples.pressure))), 1e-9)
    along = samples.pressure[at] / full if pressure_led else samples.contraction[at] / stroke
    held = samples.contraction[at] / stroke if pressure_led else samples.pressure[at] / full
    rate = samples.pressure_rate[at] / full if pressure_led else samples.rate[at] / stroke
    speed = np.median(np.abs(rate))
    return (
        int(samples.recording[at[0]]),
        int(samples.branch[at[0]]),
        round(20 * float(along.min())),
        round(20 * float(along.max())),
        round(50 * float(np.median(held))),
        round(5 * float(np.log(max(speed, 1e-9)))),
    )


def _pair(
    samples: Samples, residual: np.ndarray, earlier: np.ndarray, later: np.ndarray, pressure_led: bool
) -> Pair | None:
    """The later branch interpolated at the places of the earlier one."""
    along = samples.pressure if pressure_led else samples.contraction
    later = later[np.argsort(along[later])]
    inside = earlier[(along[earlier] > along[later[0]]) & (along[earlier] < along[later[-1]])]
    if len(inside) < ERRORS.fewest_shared:
        return None
    right = np.searchsorted(along[later], along[inside])
    left = right - 1
    share = (along[inside] - along[later[left]]) / np.maximum(along[later[right]] - along[later[left]], 1e-300)
    value = (1 - share) * residual[later[left]] + share * residual[later[right]]
    return Pair(value - residual[inside], 1 + share**2 + (1 - share) ** 2, int(samples.run[earlier[0]]))
