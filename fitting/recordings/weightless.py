"""Samples by which no model is judged: what is measured there, or when, cannot be told."""

import itertools

import numpy as np

from fitting.recordings.settings import JUMPS


def near_edges(edges: np.ndarray, count: int) -> np.ndarray:
    """Samples within three of an edge, or within a tenth of the branch where that is less: there reversals blur."""
    near = np.zeros(count, dtype=bool)
    for first, last in itertools.pairwise(edges):
        reach = min(3, (last - first + 1) // 10)
        near[first : first + reach + 1] = True
        near[last - reach : last + 1] = True
    return near


def late_jumps(measured: np.ndarray, edges: np.ndarray, noise: float) -> np.ndarray:
    """Samples around the one jump that a reading makes late after a turning point, in the first half of the branch.

    Where force comes later than length, so does the jump of friction. Which of two samples it falls between, a model
    knows no better than to one sample; a single such error would outweigh the noise of a whole branch.
    """
    jumps = np.zeros(len(measured), dtype=bool)
    for first, last in itertools.pairwise(edges):
        step = np.diff(measured[first : last + 1])
        if len(step) < JUMPS.fewest:
            continue
        size = np.abs(step - np.median(step))[: len(step) // 2 + 1]
        inner, beside = size[2:-2], np.maximum(size[:-4], size[4:])
        found = np.flatnonzero((inner > JUMPS.isolated * beside) & (inner > JUMPS.beyond_noise * noise)) + 2
        if len(found):
            at = first + found[np.argmax(size[found])]  # between this sample and the next
            jumps[at - 1 : at + 3] = True
    return jumps


def clipped_samples(measured: np.ndarray, imposed: np.ndarray, fewest: int = 5, moved: float = 0.02) -> np.ndarray:
    """Samples where the instrument is saturated or the muscle slack.

    There the extreme reading repeats, digit for digit, while what is imposed goes on by more than `moved` of its range.
    """
    flat = np.zeros(len(measured), dtype=bool)
    span = float(np.ptp(imposed))
    for extreme in (measured.min(), measured.max()):
        at = np.concatenate([[0], (measured == extreme).astype(np.int8), [0]])
        starts, stops = np.flatnonzero(np.diff(at) == 1), np.flatnonzero(np.diff(at) == -1)
        for start, stop in zip(starts, stops, strict=True):
            if stop - start >= fewest and span > 0 and np.ptp(imposed[start:stop]) > moved * span:
                flat[start:stop] = True
    return flat
