"""How much of an effect must be there for the test to find it: amounts injected into noise drawn anew."""

from functools import cache

import numpy as np
from scipy import optimize, special, stats

from fitting.diagnosis.settings import LIMITS, LimitSettings


def detectable(
    columns: np.ndarray,
    noise: np.ndarray,
    number: np.ndarray,
    signs: np.ndarray,
    level: float,
    seed: int = 0,
    settings: LimitSettings = LIMITS,
) -> np.ndarray:
    """The amount of each column (rows, columns; of norm one) that is found with power 0.8; infinite where none is.

    Rows and columns are whitened and free of the model's parameters. The rows of `noise` are drawn anew many times by
    giving each a random sign, which keeps what is larger in one group (`number`, rows) than in another. A column is
    added in growing amounts, and found where its score exceeds what flips of groups (`signs`: flips, groups) reach: the
    largest score of all where it is absent, and more the more of it is there, for what is added is flipped too.
    """
    count = columns.shape[1]
    if not count:
        return np.zeros(0)
    signs = signs[: settings.flips]
    draws = int(np.clip(settings.entries / (len(signs) * count), settings.fewest_draws, settings.draws))
    rows = noise[:, None] * np.random.default_rng(seed).choice([-1.0, 1.0], size=(len(noise), draws))
    scores = by_group(columns, rows, number)
    flipped = np.einsum("fu,duk->kdf", signs, scores, optimize=True)
    top = np.abs(flipped).max(axis=0)
    added = (signs @ np.stack([np.sum(columns[at] ** 2, axis=0) for at in members(number)])).T
    drawn = scores.sum(axis=1).T
    return np.array([_limit(drawn[k], flipped[k], added[k], top, level, settings) for k in range(count)])


def _limit(
    drawn: np.ndarray,
    flipped: np.ndarray,
    added: np.ndarray,
    top: np.ndarray,
    level: float,
    settings: LimitSettings,
) -> float:
    """Of one column: scores (draws), their flips (draws, flips), those of what is added, the largest of all columns."""
    rank = int(np.ceil((1 - level) * top.shape[1])) - 1

    def power(amount: float) -> float:
        beyond = []  # by how much the score exceeds the flips': nearly normal, which a share of few draws is not
        for side in (amount, -amount):
            reached = np.partition(np.maximum(top, np.abs(flipped + side * added)), rank, axis=1)[:, rank]
            beyond.append(np.abs(drawn + side) - reached)
        return float(special.ndtr(np.mean(beyond) / max(np.std(beyond), 1e-12)))

    low, high = settings.least, settings.most
    if power(high) < settings.power:
        return np.inf
    for _ in range(settings.halvings):
        middle = np.sqrt(low * high)
        low, high = (low, middle) if power(middle) >= settings.power else (middle, high)
    return high


@cache
def enough(freedom: int, p: float, power: float = LIMITS.power) -> float:
    """The noncentrality at which a sum of that many squares is beyond its bound of level p with this power."""
    bound = stats.chi2.isf(p, freedom)
    short = lambda much: float(stats.ncx2.sf(bound, freedom, much)) - power  # noqa: E731
    return float(optimize.root_scalar(short, bracket=(1e-3, 1e5)).root)


def members(number: np.ndarray) -> list[np.ndarray]:
    """The rows of each group."""
    return [np.flatnonzero(number == group) for group in range(number.max() + 1)]


def by_group(columns: np.ndarray, rows: np.ndarray, number: np.ndarray) -> np.ndarray:
    """Scores of columns on rows, group by group: (draws, groups, columns)."""
    return np.stack([rows[at].T @ columns[at] for at in members(number)], axis=1)
