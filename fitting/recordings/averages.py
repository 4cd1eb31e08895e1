"""Readings that are means over a stretch of time: a force that is found from positions is one.

The second derivative of the parabola that is fitted to the positions of a window is a weighted mean of the
accelerations in it, exactly. A model is compared with the mean of its own forces with the same weights. So a window may
be long without blurring anything, and its noise falls with the power 5/2 of its length.
"""

from types import ModuleType
from typing import Any

import numpy as np

Array = Any  # of numpy, or of jax inside a compiled function


def weights_of_mean(half: int, spacing: int, reach: int) -> np.ndarray:
    """Weights (2 reach + 1,) of the accelerations at every `spacing`-th sample of a window; their sum is 1.

    The window has 2 `half` + 1 samples. Summed up twice, the weights k^2 - half (half + 1)/3 of its positions become
    (half^2 - j^2) ((half + 1)^2 - j^2) for the acceleration at place j from the middle.
    """
    place = spacing * np.arange(-reach, reach + 1)
    inside = np.abs(place) < half
    weights = np.where(inside, (half**2 - place**2) * ((half + 1) ** 2 - place**2), 0).astype(float)
    return weights / weights.sum()


def of_an_instant(count: int, reach: int) -> np.ndarray:
    """The weights (count, 2 reach + 1) of so many readings that are means of nothing but themselves."""
    weights = np.zeros((count, 2 * reach + 1))
    weights[:, reach] = 1.0
    return weights


def mean_of(values: Array, weights: Array, xp: ModuleType = np) -> Array:
    """Values (..., samples) averaged over their neighbours with weights (..., samples, 2 reach + 1)."""
    reach, count = weights.shape[-1] // 2, values.shape[-1]
    wide = xp.pad(values, [*[(0, 0)] * (values.ndim - 1), (reach, reach)], mode="edge")
    return sum(weights[..., k] * wide[..., k : k + count] for k in range(2 * reach + 1))
