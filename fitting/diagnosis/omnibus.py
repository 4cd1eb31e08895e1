"""A basis that knows no effect: smooth in contraction and pressure, with direction, speed and cycle number."""

import numpy as np

from fitting.residuals import Samples

HATS = 6
ACROSS = 5  # most hats in the other variable: pressure in loops, contraction where it is held
SAME_LEVEL = 0.03  # of the range: levels closer than this are one


def basis(samples: Samples) -> np.ndarray:
    """Columns (rows, q) in units of newtons over sigma, for every recording its own block."""
    blocks = []
    for recording in np.unique(samples.recording):
        mask = samples.recording == recording
        columns = _columns(samples.where(mask))
        block = np.zeros((len(samples), columns.shape[1]))
        block[mask] = columns
        blocks.append(block)
    return np.hstack(blocks)


def _columns(s: Samples) -> np.ndarray:
    pressure = _unit(s.pressure)
    held = np.all(s.rate == 0) or np.all(np.abs(s.rate) <= 1e-8)
    moving = _unit(s.pressure_rate) if held else _unit(np.log(np.maximum(np.abs(s.rate), 1e-6)))
    if held and np.all(s.pressure_rate == 0):  # a static map: no history, no speed
        return _surface(s, pressure)
    along = pressure if held else s.contraction
    across = _unit(s.contraction) if held else pressure
    hats = _hats(along, np.linspace(along.min(), along.max() + 1e-12, HATS))
    levels = _hats(across, _levels(across))
    surface = (hats[:, :, None] * levels[:, None, :]).reshape(len(hats), -1)
    direction = np.sign(s.branch)[:, None]
    rest = [moving[:, None], moving[:, None] * direction, _unit(s.loop)[:, None]]
    return np.hstack([surface, surface * direction, *rest])


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


def _levels(x: np.ndarray) -> np.ndarray:
    """The levels at which something was held, where they are few; else evenly spread."""
    ordered = np.sort(x)
    ends = np.flatnonzero(np.diff(ordered) > SAME_LEVEL * max(np.ptp(x), 1e-12)) + 1
    if len(ends) < ACROSS:
        return np.array([np.median(part) for part in np.split(ordered, ends)])
    return np.linspace(ordered[0], ordered[-1], ACROSS)


def _unit(x: np.ndarray) -> np.ndarray:
    """Centred and scaled to about +-1."""
    x = np.asarray(x, float)
    spread = np.ptp(x)
    return (x - x.mean()) / spread * 2 if spread > 0 else np.zeros_like(x)
