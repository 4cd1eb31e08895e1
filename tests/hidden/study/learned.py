"""A learned function as a rival: does anything that it finds in the residual foretell recordings left out?

In the manner of the New Physics Learning Machine (D'Agnolo & Wulzer 2019; kernels: Letizia et al. 2022): a flexible
function is fitted to what the model leaves and asked how much of it is there. Here it is a Gaussian process mean
(kernel ridge) of contraction, pressure, speed and direction. It sees rows free of noise and errors of instruments, as
this program does, and is calibrated by the same flips. It cannot name an effect.
"""

from __future__ import annotations

from typing import Any

import numpy as np

ROWS = 1200  # at most, evenly thinned: the kernel is as large as their square
WIDTHS = (0.3, 1.0)  # of the kernel, in standard deviations of each feature
RIDGES = (1.0, 100.0)  # noise variance over that of the function
FLIPS = 399
LEVEL = 0.01
FOUND = "a learned function"


def learned(search: Any) -> list[str]:
    """Names nothing but that something is there; empty where nothing is."""
    return [FOUND] if learned_p(search) < LEVEL else []


def learned_p(search: Any) -> float:
    """The p-value of the largest share that any of these functions foretells of groups left out."""
    from fitting.diagnosis.schwarz import free_of_noise

    base, samples = search.base, search.world.samples
    free = free_of_noise(search.examiner.ground(base))
    both = free(np.column_stack([base.rows, base.slopes]))
    left = both[:, 0] - both[:, 1:] @ np.linalg.lstsq(both[:, 1:], both[:, 0], rcond=1e-10)[0]
    every = slice(None, None, -(-len(left) // ROWS))
    groups = np.asarray(search.examiner.flip_groups.number)[every]
    return flipped_p(left[every], features(samples)[every], groups, seed=search.examiner.seed)


def features(samples: Any) -> np.ndarray:
    """Contraction, pressure, speed and direction of motion (rows, 4), each of unit standard deviation."""
    columns = np.column_stack([samples.contraction, samples.pressure, samples.rate, samples.branch]).astype(float)
    return (columns - columns.mean(axis=0)) / np.maximum(columns.std(axis=0), 1e-12)


def flipped_p(left: np.ndarray, at: np.ndarray, groups: np.ndarray, seed: int = 0) -> float:
    """How often groups with their signs drawn anew are foretold as well as they are, by the best of the functions."""
    names = np.unique(groups)
    if len(names) < 2:
        return 1.0
    signs = np.random.default_rng(seed).choice([-1.0, 1.0], (FLIPS, len(names)))
    drawn = np.column_stack([left, (signs[:, np.searchsorted(names, groups)] * left).T])
    shares = [foretold(held_out(at, groups, width, ridge) @ drawn, drawn) for width in WIDTHS for ridge in RIDGES]
    best = np.max(shares, axis=0)
    return float(np.mean(best >= best[0] - 1e-12))  # the first column is what was measured


def foretold(errors: np.ndarray, of: np.ndarray) -> np.ndarray:
    """The share of each column's square that is foretold."""
    return 1 - np.sum(errors**2, axis=0) / np.sum(of**2, axis=0)


def held_out(at: np.ndarray, groups: np.ndarray, width: float, ridge: float) -> np.ndarray:
    """The matrix from readings to their errors when the group of each is left out, of kernel ridge regression."""
    from sklearn.metrics.pairwise import rbf_kernel

    kernel = rbf_kernel(at, gamma=0.5 / width**2)
    inverse = np.linalg.inv(kernel + ridge * np.eye(len(kernel)))
    errors = np.empty_like(inverse)
    for each in np.unique(groups):  # (K + r)^-1 y of a group, over its own block, is its error when it is left out
        mine = np.flatnonzero(groups == each)
        errors[mine] = np.linalg.solve(inverse[np.ix_(mine, mine)], inverse[mine])
    return errors
