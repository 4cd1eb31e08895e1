"""Where the search of a larger model begins: at the optimum of the smaller one, with what is new as good as absent.

A model that contains another can describe the data no worse, if its search does not end in a worse valley. From this
place it cannot: every step of the search lowers the sum of squares.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fitting.least_squares.searches import Searches
from fitting.least_squares.subset import Subset
from fitting.problem.unknowns import Unknown

NEUTRAL = (0.0, 1.0)  # values at which a sum or a product changes nothing


def as_good_as_absent(searches: Searches, subset: Subset, entries: Sequence[Unknown], new: np.ndarray) -> np.ndarray:
    """The best place (free,) for the new parameters while all others stay as they are in `subset.full`.

    `entries` are the free unknowns in their order, `new` is a mask over them (free,). No effect has to say which values
    switch it off: the ends of the ranges, neutral numbers and declared starts are looked at, and the search of the new
    parameters alone goes on from the best.
    """
    places, alone = _places(subset, subset.place(subset.full), entries, new), _only(subset, new)
    best = places[int(np.argmin(searches.look(alone, places)))]
    found = searches.search(alone, best[None])
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
