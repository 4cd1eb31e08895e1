"""Bases that know no effect: smooth in contraction, pressure and speed, and fine along the stroke, by direction."""

from dataclasses import dataclass

import numpy as np

from fitting.problem.kinds import is_held, is_static
from fitting.problem.residuals import Samples

HATS = ((6, 5), (5, 4), (4, 3), (3, 2))  # along the stroke, and most in the other variable: pressure in loops,
#                                          contraction where it is held; the first that readings are enough for
ENOUGH = 3  # readings for each column, if the coarsest hats have so few: fewer leave nothing that tells the noise
SAME_LEVEL = 0.03  # of the range: levels closer than this are one
FINE = 40  # most hats along the stroke: a ripple of a twentieth of it is seen
PER_HAT = 5  # samples of one branch
AFTER = (0.01, 0.03, 0.1)  # of the range: over which what a turning point leaves dies away


@dataclass(frozen=True)
class Basis:
    """Columns in newtons over sigma: what varies smoothly (rows, q), and ripples along the stroke (rows, r)."""

    smooth: np.ndarray
    fine: np.ndarray

    @property
    def whole(self) -> np.ndarray:
        """Both (rows, q + r)."""
        return np.hstack([self.smooth, self.fine])


def basis(samples: Samples) -> Basis:
    """Both bases, for every recording a block of its own."""
    recordings = [samples.recording == recording for recording in np.unique(samples.recording)]
    parts = [samples.where(mask) for mask in recordings]
    return Basis(_blocks(recordings, [_smooth(s) for s in parts]), _blocks(recordings, [_fine(s) for s in parts]))


def _blocks(masks: list[np.ndarray], parts: list[np.ndarray]) -> np.ndarray:
    blocks = []
    for mask, columns in zip(masks, parts, strict=True):
        block = np.zeros((len(mask), columns.shape[1]))
        block[mask] = columns
        blocks.append(block)
    return np.hstack(blocks)


def _smooth(s: Samples) -> np.ndarray:
    if is_static(s):
        return _surface(s, _unit(s.pressure))
    columns = np.zeros((len(s), 0))
    for along, across in HATS:
        columns = _piecewise(s, along, across)
        if ENOUGH * columns.shape[1] <= len(s):
            break
    return columns


def _piecewise(s: Samples, most_along: int, most_across: int) -> np.ndarray:
    """So many hats along the stroke, and at most so many in the other variable."""
    pressure, held = _unit(s.pressure), is_held(s)
    moving = _unit(s.pressure_rate) if held else _unit(np.log(np.maximum(np.abs(s.rate), 1e-6)))
    along = pressure if held else s.contraction
    across = _unit(s.contraction) if held else pressure
    hats = _hats(along, np.linspace(along.min(), along.max() + 1e-12, most_along))
    levels = _hats(across, _levels(across, most_across))
    surface = (hats[:, :, None] * levels[:, None, :]).reshape(len(hats), -1)
    direction = np.sign(s.branch)[:, None]
    of_speed = moving[:, None] if held else _hats(moving, _levels(moving, most_across))
    losses = direction * of_speed
    turned = _after_turning(s, along)
    both = [surface, turned]
    return np.hstack([*both, *(part * direction for part in both), moving[:, None], losses, _unit(s.loop)[:, None]])


def _after_turning(s: Samples, along: np.ndarray) -> np.ndarray:
    """What dies away from where each half loop begins: lags, delays and elastic slip before sliding (rows, 3)."""
    _, first, half = np.unique(np.stack([s.run, s.half]), axis=1, return_index=True, return_inverse=True)
    way = np.abs(along - along[first][half]) / max(float(np.ptp(along)), 1e-12)
    return np.exp(-way[:, None] / np.array(AFTER))


def _fine(s: Samples) -> np.ndarray:
    """Hats along the stroke, even and odd in the direction; none where branches have few samples."""
    if is_static(s):
        return np.zeros((len(s), 0))
    along = s.pressure if is_held(s) else s.contraction
    branch = float(np.median(np.unique(s.half, return_counts=True)[1]))
    count = int(min(FINE, branch / PER_HAT))
    if count <= 2 * HATS[0][0]:  # no finer than what is smooth
        return np.zeros((len(s), 0))
    hats = _hats(along, np.linspace(along.min(), along.max() + 1e-12 * max(abs(along.max()), 1.0), count))
    return np.hstack([hats, hats * np.sign(s.branch)[:, None]])


def _surface(s: Samples, pressure: np.ndarray) -> np.ndarray:
    x, y = _unit(s.contraction), pressure
    powers = [(i, j) for i in range(4) for j in range(4 - i)]
    direction = np.sign(s.branch)
    even = [x**i * y**j for i, j in powers]
    odd = [direction * x**i for i in range(2)] if np.any(direction) else []
    return np.stack(even + odd, axis=1)


def _hats(x: np.ndarray, knots: np.ndarray) -> np.ndarray:
    """Piecewise linear functions that add up to one."""
    return np.stack([np.interp(x, knots, row) for row in np.eye(len(knots))], axis=1)


def _levels(x: np.ndarray, most: int) -> np.ndarray:
    """The levels at which something was held, where they are few; else so many, evenly spread."""
    ordered = np.sort(x)
    ends = np.flatnonzero(np.diff(ordered) > SAME_LEVEL * max(np.ptp(x), 1e-12)) + 1
    if len(ends) < most:
        return np.array([np.median(part) for part in np.split(ordered, ends)])
    return np.linspace(ordered[0], ordered[-1], most)


def _unit(x: np.ndarray) -> np.ndarray:
    """Centred and scaled to about +-1."""
    x = np.asarray(x, float)
    spread = np.ptp(x)
    return (x - x.mean()) / spread * 2 if spread > 0 else np.zeros_like(x)
