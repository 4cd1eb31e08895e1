"""How wide a band must be to hold a reading of a new run: runs are exchangeable, readings within a run are not.

The readings of one run err together: the zero of the load cell, the pressure, and what the model lacks there are the
same in all of them. So nothing is presumed of the readings of a run, nor of the model; only the runs are taken to
be drawn alike. What is said is this: of a reading taken at random from one more run like these, the band holds a
share `level`. Every run then counts alike, however many readings it has.

Scores are the distances of readings from what a fit without their run predicts. With K runs, and F_k(q) the share of
the scores of run k that are at most q, the new run is one of K + 1 of which any might have been left out. Two widths q:

cautious: sum_k F_k(q) / (K + 1) >= level. The new run is presumed to lie wholly outside, the worst that is possible.
For scores of a fit that has seen none of the runs, the statement then holds whatever the noise and the model are (Dunn,
Wasserman & Ramdas 2022, J. Am. Stat. Assoc. 118:2491; Lee, Barber & Willett 2023, arXiv:2306.06342). For fits that
leave out one run each, it holds as far as one run more or less does not change the fit (of single readings the
jackknife+ is certain to hold 1 - 2 (1 - level): Barber, Candes, Ramdas & Tibshirani 2021, Ann. Stat. 49:486). It needs
K >= level / (1 - level) runs: 9 for 90 %.

expected: (sum_k F_k(q) + min_k F_k(q)) / (K + 1) >= level. The new run is presumed to be as bad as the worst that was
measured. Where every run has an error of its own, this is the cautious width; where runs are alike, it is little
more than the quantile itself. It is no bound: `tests/new_runs` measures how many readings of new runs it holds.
"""

from collections.abc import Sequence

import numpy as np

ROUNDING = 1e-12  # of a share: sums of equal weights differ by so much


def runs_needed(level: float) -> int:
    """The fewest runs from which a band of this level can be had, whatever the noise."""
    return int(np.ceil(level / (1 - level) - 1e-9))


def shares_within(scores: Sequence[np.ndarray], width: float) -> np.ndarray:
    """The share of each run's scores (sorted) that are at most `width`: (runs,)."""
    return np.array([np.searchsorted(own, width, "right") / len(own) for own in scores])


def expected_width(scores: Sequence[np.ndarray], level: float) -> float:
    """The least width, in the unit of the scores, that holds `level` if a new run is like the worst of these.

    `scores` are those of each run, sorted; infinite where runs are fewer than `runs_needed`.
    """
    return _least_width(scores, level, lambda shares: float(shares.min()))


def cautious_width(scores: Sequence[np.ndarray], level: float) -> float:
    """The least width that holds `level` whatever a new run is like; infinite where runs are too few."""
    return _least_width(scores, level, lambda shares: 0.0)


def _least_width(scores: Sequence[np.ndarray], level: float, of_new) -> float:
    """The least score at which the runs and the new one, of which `of_new` says the share, hold the level."""
    if len(scores) < runs_needed(level):
        return float("inf")
    widths = np.unique(np.concatenate(scores))
    low, high = 0, len(widths) - 1  # the largest of all scores holds all runs, which is enough where runs are enough
    while low < high:
        middle = (low + high) // 2
        shares = shares_within(scores, widths[middle])
        enough = shares.sum() + of_new(shares) >= level * (len(scores) + 1) - ROUNDING
        low, high = (low, middle) if enough else (middle + 1, high)
    return float(widths[low])


def band_edges(scores: Sequence[np.ndarray], predictions: np.ndarray, width: float) -> tuple[np.ndarray, np.ndarray]:
    """Lower and upper edge (points,) of the jackknife+ band around predictions (runs, points), each without one run.

    The edges hold the share of `prediction of the fit without run k +- score of run k` that `width` holds of the
    scores, every run counting alike (Barber, Candes, Ramdas & Tibshirani 2021, Ann. Stat. 49:486). Where left-out fits
    agree this is their prediction +- width; where they differ, beyond what was measured, the band grows by that.
    """
    share = float(np.mean(shares_within(scores, width)))
    return -_upper_edge(scores, -predictions, share), _upper_edge(scores, predictions, share)


def _upper_edge(scores: Sequence[np.ndarray], predictions: np.ndarray, share: float) -> np.ndarray:
    """The least value at each point below which this share of `prediction + score` lies, found by halving."""
    low, high = predictions.min(axis=0), predictions.max(axis=0) + max(own[-1] for own in scores)
    for _ in range(60):
        middle = (low + high) / 2
        above = zip(scores, middle - predictions, strict=True)
        held = np.mean([np.searchsorted(own, gap, "right") / len(own) for own, gap in above], axis=0)
        low, high = np.where(held < share - ROUNDING, middle, low), np.where(held < share - ROUNDING, high, middle)
    return high
