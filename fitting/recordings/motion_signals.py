"""What a recorded motion tells besides its readings: noise, turning points, monotone branches, speed."""

import itertools
import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import isotonic_regression

from fitting.recordings.settings import SIGNALS

FEWEST = SIGNALS.fewest  # samples


@dataclass(frozen=True)
class Branches:
    """A signal cut at its turning points.

    `turns` are the samples where it turns; `edges` these and both ends of the run; `half` says in which branch a sample
    lies (a turning point belongs to the branch that it ends) and `sign` whether that branch rises (+1) or falls (-1).
    """

    turns: np.ndarray
    edges: np.ndarray
    half: np.ndarray
    sign: np.ndarray  # per sample

    @property
    def loop(self) -> np.ndarray:
        """Closed loops: from a turning point to the next but one."""
        return self.half // 2


def noise_level(time: np.ndarray, signal: np.ndarray) -> float:
    """Standard deviation of one reading's noise, in the signal's unit; robust against the motion underneath.

    Each reading is compared with the line through its neighbours, and the next such difference is taken off, which
    leaves nothing of a smooth motion; the median absolute deviation ignores jumps. A signal that is rounded more
    coarsely than its noise has the noise of rounding.
    """
    if len(signal) < 5:
        return 0.0
    dt = np.diff(time)
    before = dt[1:] / (dt[1:] + dt[:-1])  # weight of the reading before in the line through the neighbours
    residual = signal[1:-1] - before * signal[:-2] - (1 - before) * signal[2:]
    a, b = before[:-1], before[1:]
    # residual[i] - residual[i+1] as a sum over four readings
    weights = np.stack([-a, 1 + b, -(1 - a) - 1, 1 - b])
    scaled = np.diff(residual) / np.sqrt((weights**2).sum(0))
    return max(1.4826 * float(np.median(np.abs(scaled))), resolution(signal) / math.sqrt(12))


def resolution(signal: np.ndarray) -> float:
    """Step in which a signal is rounded, where that is coarser than its noise and motion: else 0.

    Then most readings repeat the one before, and the smallest difference between two is the step.
    """
    steps = np.abs(np.diff(signal))
    moved = steps[steps > 1e-9 * max(float(np.abs(signal).max()), 1e-300)]  # beyond arithmetic dust
    return float(moved.min()) if moved.size and moved.size < 0.6 * steps.size else 0.0


def turning_threshold(time: np.ndarray, signal: np.ndarray, share: float) -> float:
    """How far a signal must go back before that counts as turning: beyond noise, and at least `share` of its range.

    Between the largest and the smallest of n normal errors lie 2 sqrt(2 ln n) standard deviations.
    """
    noise = 2.2 * math.sqrt(2 * math.log(len(signal) + 2)) * noise_level(time, signal)
    return max(noise, share * float(np.ptp(signal)), 2.5 * resolution(signal))


def turning_points(signal: np.ndarray, threshold: float) -> np.ndarray:
    """Samples where a signal turns (zig-zag): extremes with a way back of more than `threshold` on both sides."""
    candidates = _local_extremes(signal)
    values = signal[candidates].tolist()
    turns: list[int] = []
    low = high = 0
    direction = 0
    for k, value in enumerate(values):
        if value > values[high]:
            high = k
        if value < values[low]:
            low = k
        if direction >= 0 and values[high] - value > threshold:
            turns += [high] * direction  # before the first clear motion there is nothing to turn from
            direction, low, high = -1, k, k
        elif direction <= 0 and value - values[low] > threshold:
            turns += [low] * -direction
            direction, low, high = 1, k, k
    inner = candidates[np.array(turns, dtype=int)]
    return inner[(inner > 0) & (inner < len(signal) - 1)]


def _local_extremes(signal: np.ndarray) -> np.ndarray:
    """First and last sample, and every sample where the signal changes its direction."""
    moving = np.flatnonzero(np.diff(signal)) + 1  # samples that differ from the one before
    rising = np.sign(np.diff(signal))[moving - 1]
    inner = moving[:-1][rising[:-1] != rising[1:]]
    return np.concatenate([[0], inner, [len(signal) - 1]]).astype(int)


def departures(signal: np.ndarray, turns: np.ndarray, threshold: float) -> np.ndarray:
    """Where the signal leaves its turning values for good: the end of a rest there, or the extreme itself.

    Half the threshold away it has certainly left; a rest is told by the time until then being long against the time
    for the second half, and is taken to end that second time earlier. A few samples are no rest but a slow turn.
    """
    left = turns.copy()
    for k, (turn, stop) in enumerate(itertools.pairwise(np.append(turns, len(signal)))):
        away = np.abs(signal[turn:stop] - signal[turn])
        half, whole = (int(np.argmax(away > share * threshold)) for share in (0.5, 1.0))
        pace = max(whole - half, 1)
        if half > max(3 * pace, SIGNALS.brief):
            left[k] = turn + half - pace
    return left


def branches_of(signal: np.ndarray, threshold: float, rests: bool = False) -> Branches:
    """A signal cut at its turning points; with `rests`, a rest at a turning value belongs to the branch before it."""
    turns = turning_points(signal, threshold)
    turns = departures(signal, turns, threshold) if rests else turns
    edges = np.unique(np.concatenate([[0], turns, [len(signal) - 1]]))
    half = np.clip(np.searchsorted(edges, np.arange(len(signal)), side="left") - 1, 0, None)
    rise = np.sign(np.diff(signal[edges])) if len(edges) > 1 else np.zeros(1)
    # a first stretch that does not move enough to be a branch takes its direction from the ends all the same
    return Branches(turns, edges, half, rise[half].astype(int))


def branches_from_labels(sign: np.ndarray) -> Branches:
    """Branches as the recording states them: `sign` is +1, -1 or 0 per sample."""
    turns = np.flatnonzero(np.diff(sign))  # the last sample before each change
    edges = np.unique(np.concatenate([[0], turns, [len(sign) - 1]]))
    half = np.concatenate([[0], np.cumsum(np.diff(sign) != 0)])
    return Branches(turns, edges, half, sign.astype(int))


def monotone(signal: np.ndarray, branches: Branches) -> np.ndarray:
    """The raw signal, but never turning inside a branch: jitter that would reverse the motion is averaged away."""
    made = signal.astype(float, copy=True)
    for first, last in itertools.pairwise(branches.edges):
        rising = bool(signal[last] >= signal[first])
        made[first : last + 1] = isotonic_regression(signal[first : last + 1], increasing=rising).x
    return made


def rate(time: np.ndarray, signal: np.ndarray, edges: np.ndarray, noise: float) -> tuple[np.ndarray, np.ndarray]:
    """Time derivative of a signal and its standard error, from local polynomials that never cross an edge.

    Where the derivative is below twice its error its sign is unknown, and it is exactly 0. `edges` are the ends of the
    run and its turning points; `noise` is the standard deviation of one reading.
    """
    slope, error = np.zeros(len(signal)), np.full(len(signal), np.inf)
    noise = max(noise, 1e-12 * float(np.abs(signal).max()))  # arithmetic dust is not motion
    for first, last in itertools.pairwise(edges):
        # a turning sample was chosen for its error: where samples abound it stays out of the polynomials
        inset = (int(first > 0), int(last < len(signal) - 1)) if last - first > 4 * SIGNALS.fewest else (0, 0)
        inner = slice(first + inset[0], last + 1 - inset[1])
        s, e = _branch_rate(time[inner], signal[inner], noise)
        own = slice(first + (first > 0), last + 1)  # a turning point belongs to the branch it ends
        slope[own], error[own] = (np.pad(v, inset, mode="edge")[own.start - first :] for v in (s, e))
    return without_doubt(time, slope, error, noise), error


def without_doubt(time: np.ndarray, slope: np.ndarray, error: np.ndarray, noise: float) -> np.ndarray:
    """A time derivative, exactly 0 where its sign is unknown: below twice its error, or for a way lost in the noise."""
    return _without_flicker(time, np.where(np.abs(slope) <= 2 * error, 0.0, slope), noise)


def _without_flicker(time: np.ndarray, slope: np.ndarray, noise: float) -> np.ndarray:
    """Speeds, 0 also where they last for less than four times the noise: a held muscle flickers."""
    starts = np.flatnonzero(np.diff(np.sign(slope), prepend=np.nan) != 0)
    travel = np.add.reduceat(np.abs(slope) * np.gradient(time), starts)
    short = np.repeat(travel < 4 * noise, np.diff(np.append(starts, len(slope))))
    return np.where(short, 0.0, slope)


def _branch_rate(time: np.ndarray, signal: np.ndarray, noise: float) -> tuple[np.ndarray, np.ndarray]:
    wanted = _window(time, signal, noise)
    if wanted <= SIGNALS.window:
        return _local_slopes(time, signal, min(wanted, len(time)), noise)
    block = -(-wanted // SIGNALS.window)
    count = len(time) // block
    centre, mean = (_block_means(values, block, count) for values in (time, signal))
    slope, error = _local_slopes(centre, mean, min(SIGNALS.window, count), noise / math.sqrt(block))
    return np.interp(time, centre, slope), np.interp(time, centre, error)


def _window(time: np.ndarray, signal: np.ndarray, noise: float) -> int:
    """Samples in a local line for it to know the mean speed of this branch to 5 %; at most a quarter of the branch.

    The slope of n readings with spacing dt has the error noise sqrt(12/n^3)/dt.
    """
    count = len(time)
    travel = abs(float(signal[-1] - signal[0])) / max(count - 1, 1)  # mean way per sample
    needed = (12 * (20 * noise / travel) ** 2) ** (1 / 3) if travel > 0 else count
    return int(np.clip(needed, SIGNALS.fewest, max(count // 4, SIGNALS.fewest))) | 1


def _block_means(values: np.ndarray, block: int, count: int) -> np.ndarray:
    return values[: count * block].reshape(count, block).mean(1)


def _local_slopes(time: np.ndarray, signal: np.ndarray, window: int, noise: float) -> tuple[np.ndarray, np.ndarray]:
    """Slope at every sample of the polynomial through the `window` samples around it, shifted inwards at both ends."""
    count = len(time)
    if window < 2:
        return np.zeros(count), np.full(count, np.inf)
    first = np.clip(np.arange(count) - window // 2, 0, count - window)
    parts = [
        _polynomial_slopes(time, signal, first[at : at + SIGNALS.piece], slice(at, at + SIGNALS.piece), window, noise)
        for at in range(0, count, SIGNALS.piece)
    ]
    return np.concatenate([p[0] for p in parts]), np.concatenate([p[1] for p in parts])


def _polynomial_slopes(
    time: np.ndarray, signal: np.ndarray, first: np.ndarray, here: slice, window: int, noise: float
) -> tuple[np.ndarray, np.ndarray]:
    """Slopes of least-squares parabolas (lines through fewer than five samples) in orthogonal polynomials of time."""
    t = np.lib.stride_tricks.sliding_window_view(time, window)[first]
    x = np.lib.stride_tricks.sliding_window_view(signal, window)[first]
    centre = t.mean(1, keepdims=True)
    t = t - centre
    spread = (t**2).sum(1)
    slope, variance = (t * x).sum(1) / spread, 1 / spread
    if window >= SIGNALS.fewest:
        skew = (t**3).sum(1) / spread
        bow = t**2 - skew[:, None] * t - (spread / window)[:, None]
        bow_spread = (bow**2).sum(1)
        at = 2 * (time[here] - centre[:, 0]) - skew  # derivative of the bow where the sample lies
        slope = slope + (bow * x).sum(1) / bow_spread * at
        variance = variance + at**2 / bow_spread
    return slope, noise * np.sqrt(variance)


def smooth(signal: np.ndarray, window: int = 5) -> np.ndarray:
    """Running mean over a few samples, narrower towards the ends of the run."""
    count = len(signal)
    half = np.minimum(np.minimum(np.arange(count), np.arange(count)[::-1]), window // 2)
    total = np.concatenate([[0.0], np.cumsum(signal - signal[0])])
    at = np.arange(count)
    return signal[0] + (total[at + half + 1] - total[at - half]) / (2 * half + 1)
