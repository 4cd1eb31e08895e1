"""Where the searches of a fit begin, and which of the unknowns they may change."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fitting.least_squares.absent import as_good_as_absent
from fitting.least_squares.searches import Searches
from fitting.least_squares.subset import Subset
from fitting.problem.unknowns import Unknowns


@dataclass(frozen=True)
class StartSettings:
    """Settings of the places where searches begin. All were chosen: nobody has derived them."""

    blind: float = 1e-7  # of the strongest column's norm: a parameter whose whole range moves the rows by less is held
    looks: int = 4  # places at which to see whether the data constrain a parameter
    spread: float = 0.6  # of a range over which further starts are spread, from `spread_from`
    spread_from: float = 0.02  # of a range


STARTS = StartSettings()


def constrained_names(searches: Searches, subset: Subset, names: Sequence[str]) -> tuple[str, ...]:
    """Those of the free names that the data constrain: along which the rows of the measurements change at all."""
    count = sum(int(block.keep.size) for block in searches.standard.problem.blocks)
    slopes = searches.at(subset, np.clip(subset.place(subset.full), 0.01, 0.99)).slopes
    moves = np.linalg.norm(np.nan_to_num(np.asarray(slopes)[:count], posinf=0.0, neginf=0.0), axis=0)
    least = STARTS.blind * max(moves.max(), 1e-300)
    return tuple(name for name, move in zip(names, moves, strict=True) if move > least)


def constrained_somewhere(
    layout: Unknowns, searches: Searches, subset: Subset, asked: tuple[str, ...], seed: int
) -> tuple[str, ...]:
    """Those that the data constrain, at the start or at other places to begin from.

    A muscle may be stuck at the start, and a stop of the stroke lie beyond all that was measured.
    """
    found = set(constrained_names(searches, subset, asked))
    if len(found) < len(asked):
        for place in starting_places(layout, subset, asked, STARTS.looks, seed)[1:]:
            found |= set(constrained_names(searches, replace(subset, full=subset.vector(np.asarray(place))), asked))
    return tuple(name for name in asked if name in found)


def starting_places(layout: Unknowns, subset: Subset, names: Sequence[str], count: int, seed: int) -> np.ndarray:
    """Where to begin: at the declared starts, then spread over the effects' ranges; the muscle as it was measured."""
    at = layout.at(names)
    first = subset.full.copy()
    for i in at:
        first[i] = layout.entries[i].starts[0]
    declared = [first]
    for i in at:
        for other in layout.entries[i].starts[1:]:
            declared.append(first.copy())
            declared[-1][i] = other
    places = [subset.place(vector) for vector in [subset.full, *declared]]
    spread = _sobol(len(at), seed) if len(places) < count and len(at) else np.zeros((0, len(at)))
    own = np.array([layout.entries[i].name.startswith("muscle.") for i in at], bool)
    more = [np.where(own, places[0], STARTS.spread_from + STARTS.spread * row) for row in spread]
    return np.array([*places, *more][: max(count, 1)])


def _sobol(dimensions: int, seed: int) -> np.ndarray:
    """Places (64, dimensions) spread evenly over the unit box."""
    from scipy.stats import qmc  # it takes half a second to load, and a saved model is looked at without it

    return qmc.Sobol(dimensions, rng=seed).random_base2(6)


def from_known(
    searches: Searches, layout: Unknowns, subset: Subset, names: tuple[str, ...], known: Sequence[str],
    begin: np.ndarray,
) -> np.ndarray:  # fmt: skip
    """The places to begin from, the first of them at the values that are known, with what is new as good as absent."""
    new = np.array([name not in known for name in names], bool)
    if not new.any() or new.all():
        return begin
    entries = [layout.entries[i] for i in layout.at(names)]
    place = as_good_as_absent(searches, subset, entries, new)
    return np.concatenate([place[None], begin])[: len(begin)]


def from_best_of_forces(searches: Searches, subset: Subset, place: np.ndarray, begin: np.ndarray) -> np.ndarray:
    """Where to begin if the best fit to forces ended at `place`: there, and at others only where they lie lower."""
    cost, *others = searches.look(subset, np.concatenate([place[None], begin]))
    return np.concatenate([place[None], begin[np.array(others) < cost]])
