"""A basis that knows no effect: smooth in contraction and pressure, with direction, speed and cycle number."""

import numpy as np

from fitting.residuals import Samples

HATS = 6


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
    hats = _hats(along)
    direction = np.sign(s.branch)[:, None]
    columns = [hats, hats * direction, hats * across[:, None], hats * (across[:, None] * direction)]
    columns += [moving[:, None], moving[:, None] * direction, _unit(s.loop)[:, None]]
    return np.hstack(columns)


def _surface(s: Samples, pressure: np.ndarray) -> np.ndarray:
    x, y = _unit(s.contraction), pressure
    powers = [(i, j) for i in range(4) for j in range(4 - i)]
    direction = np.sign(s.branch)
    even = [x**i * y**j for i, j in powers]
    odd = [direction * x**i for i in range(2)] if np.any(direction) else []
    return np.stack(even + odd, axis=1)


def _hats(x: np.ndarray) -> np.ndarray:
    """Piecewise linear functions that add up to one."""
    knots = np.linspace(x.min(), x.max() + 1e-12, HATS)
    return np.stack([np.interp(x, knots, row) for row in np.eye(HATS)], axis=1)


def _unit(x: np.ndarray) -> np.ndarray:
    """Centred and scaled to about +-1."""
    x = np.asarray(x, float)
    spread = np.ptp(x)
    return (x - x.mean()) / spread * 2 if spread > 0 else np.zeros_like(x)
