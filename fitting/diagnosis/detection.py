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
    added in growing amounts, and found where its score exceeds the largest that flips of groups (`signs`: flips,
    groups) reach in any column. That grows with what is added, for it is flipped too and stands in all columns like it.
    """
    if not columns.shape[1]:
        return np.zeros(0)
    first, place = _directions(columns, settings.same)
    columns, signs = columns[:, first], signs[: settings.flips]
    count = columns.shape[1]
    draws = int(np.clip(settings.entries / (len(signs) * count), settings.fewest_draws, settings.draws))
    rows = noise[:, None] * np.random.default_rng(seed).choice([-1.0, 1.0], size=(len(noise), draws))
    scores = by_group(columns, rows, number)
    flipped = np.einsum("fu,duk->kdf", signs, scores, optimize=True).astype(np.float32)  # half the time
    shared = np.stack([columns[at].T @ columns[at] for at in members(number)])
    drawn = scores.sum(axis=1).T
    added = (np.tensordot(shared[:, :, k], signs, axes=(0, 1)).astype(np.float32) for k in range(count))
    found = np.array([_limit(drawn[k], flipped, each, level, settings) for k, each in enumerate(added)])
    return found[place]


def _directions(columns: np.ndarray, same: float) -> tuple[np.ndarray, np.ndarray]:
    """Columns (rows, columns; of norm one) of which none is nearly another, by number, and which of them each is."""
    alike = np.abs(columns.T @ columns) > same
    first = np.argmax(alike, axis=1)  # the first like it; one that is like none, for its norm is not one, is its own
    first = np.where(alike.any(axis=1), first, np.arange(len(first)))
    return np.unique(first, return_inverse=True)


def _limit(drawn: np.ndarray, flipped: np.ndarray, added: np.ndarray, level: float, settings: LimitSettings) -> float:
    """Of one column: scores (draws), flips of all columns (columns, draws, flips), what one unit of it adds to them.

    `added` is of shape (columns, flips).
    """
    rank = int(np.ceil((1 - level) * flipped.shape[2])) - 1

    def too_much(amount: float) -> float:
        """By how many standard deviations the score exceeds what is needed: nearly straight in the amount."""
        beyond = []  # by how much the score exceeds the flips': nearly normal, which a share of few draws is not
        for side in (amount, -amount):
            reached = np.partition(largest(flipped, np.float32(side) * added), rank, axis=1)[:, rank]
            beyond.append(np.abs(drawn + side) - reached)
        return float(np.mean(beyond) / max(np.std(beyond), 1e-12) - special.ndtri(settings.power))

    if too_much(settings.most) < 0:
        return np.inf
    if too_much(settings.least) > 0:
        return settings.least
    return float(optimize.brentq(too_much, settings.least, settings.most, xtol=settings.near))  # pyright: ignore


def largest(flipped: np.ndarray, added: np.ndarray) -> np.ndarray:
    """The largest score of all columns (draws, flips): column by column, for that stays in the processor's cache."""
    out, each = np.zeros_like(flipped[0]), np.empty_like(flipped[0])
    for scores, more in zip(flipped, added, strict=True):
        np.add(scores, more, out=each)
        np.maximum(out, np.abs(each, out=each), out=out)
    return out


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
