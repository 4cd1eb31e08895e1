"""Where the search of a larger model begins: at the optimum of the smaller one, with what is new as good as absent.

A model that contains another can describe the data no worse, if its search does not end in a worse valley. From this
place it cannot: every step of the search lowers the sum of squares.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from fitting.least_squares.search import MultistartResult
from fitting.least_squares.subset import Subset
from fitting.problem.unknowns import Unknown

Solve = Callable[
    [Subset, np.ndarray, np.ndarray], MultistartResult
]  # of a subset, starts (count, free) and look (count,)
NEUTRAL = (0.0, 1.0)  # values at which a sum or a product changes nothing


def as_good_as_absent(
    solve: Solve, subset: Subset, entries: Sequence[Unknown], new: np.ndarray, count: int
) -> np.ndarray:
    """The best place (free,) for the new parameters while all others stay as they are in `subset.full`.

    `entries` are the free unknowns in their order, `new` is a mask over them (free,). No effect has to say which values
    switch it off: the ends of the ranges, neutral numbers and declared starts are looked at, and the search of the new
    parameters alone goes on from the best. `solve` takes `count` starts, as the caller's own searches do, so that
    nothing is compiled for this.
    """
    here = subset.place(subset.full)
    places = _places(subset, here, entries, new)
    alone, look = _only(subset, new), np.ones(count, bool)
    costs = [
        np.asarray(solve(alone, _filled(part, count), look).ends.cost)[: len(part)] for part in _parts(places, count)
    ]
    best = places[int(np.argmin(np.concatenate(costs)))]
    found = solve(alone, _filled(best[None], count), np.arange(count) > 0)  # the first is searched, the others fill up
    return np.asarray(found.place) if np.isfinite(found.cost) else best


def _places(subset: Subset, here: np.ndarray, entries: Sequence[Unknown], new: np.ndarray) -> np.ndarray:
    """Places (n, free) to look at: the new parameters at their starts, then one after the other at a special value."""
    at, full = [i for i, fresh in enumerate(new) if fresh], subset.full
    position = subset.free
    first = full.copy()
    first[position[at]] = [entries[i].start for i in at]
    vectors = [first]
    for i in at:
        entry = entries[i]
        special = (entry.lower, entry.upper, *entry.starts, *(v for v in NEUTRAL if entry.lower < v < entry.upper))
        for value in dict.fromkeys(special):
            vectors.append(first.copy())
            vectors[-1][position[i]] = value
    places = np.array([subset.place(vector) for vector in vectors])
    return np.where(_padded(new, len(here)), places, here)


def _only(subset: Subset, new: np.ndarray) -> Subset:
    """The same subset in which the range of every parameter that is not new has shrunk to the value that it has."""
    position = subset.free
    still = position[: len(new)][~new]
    lower, upper, full = (x.copy() for x in (subset.lower, subset.upper, subset.full))
    lower[still] = upper[still] = full[still]
    return replace(subset, lower=lower, upper=upper)


def _padded(mask: np.ndarray, size: int) -> np.ndarray:
    """A mask as long as what is free; what was added to reach a standard size is not new."""
    return np.concatenate([mask, np.zeros(size - len(mask), bool)])


def _parts(places: np.ndarray, count: int) -> list[np.ndarray]:
    return [places[i : i + count] for i in range(0, len(places), count)]


def _filled(places: np.ndarray, count: int) -> np.ndarray:
    """As many places as the compiled function takes, the last repeated."""
    return np.concatenate([places, np.repeat(places[-1:], count - len(places), axis=0)])
