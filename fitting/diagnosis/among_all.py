"""Fits of a model alone by the compiled program that holds every effect, so that none is compiled for the model."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from fitting.diagnosis.candidate_fit import CandidateFit
from fitting.diagnosis.universe import Universe
from fitting.least_squares.absent import as_good_as_absent
from fitting.least_squares.search import Evaluated, MultistartResult, SearchResult, joined, on_the_host
from fitting.least_squares.searches import cost_of
from fitting.least_squares.subset import Array, Subset, subset_of
from fitting.problem.residuals import Problem
from fitting.problem.sizes import Standard
from fitting.problem.unknowns import Unknowns
from fitting.threads import at_once
from mckibben_jax.model import Model

MIDDLE = 0.5  # of the unit box: where stands what only fills a standard size


@dataclass(frozen=True)
class AmongAll:
    """Searches of a model that is laid out with its own effects, among all effects of a library (`Searches`).

    `layout` is the model's: its unknowns are some of the library's. Every effect of its subsets that is switched off is
    left out.
    """

    world: Universe
    layout: Unknowns

    @property
    def standard(self) -> Standard:
        """The problem as it is searched."""
        return self.world.standard

    @property
    def template(self) -> Model:
        """The model with its own effects."""
        return self.layout.templates[0]

    def at(self, subset: Subset, place: Array, problem: Problem | None = None) -> Evaluated:
        """Rows and slopes at one place; on another problem of the same shape, if given."""
        wide = self._wide(subset)
        found = on_the_host(self.world.searched(wide, _padded(np.asarray(place), wide), problem, look=True))
        return Evaluated(place, found.rows, found.slopes[:, : np.size(place)])

    def look(self, subset: Subset, places: np.ndarray) -> np.ndarray:
        """Half the sum of squares at each of these places; infinite where a row is no finite number."""
        return np.array([cost_of(self.at(subset, place)) for place in places])

    def search(self, subset: Subset, starts: np.ndarray, errors: np.ndarray | None = None) -> MultistartResult:
        """Searches from each of these places (starts, free); see `Searches`."""
        world = self.world if errors is None else self.world.seen_through(errors)
        wide, count = self._wide(subset), starts.shape[1]

        def one(start: np.ndarray) -> SearchResult:
            found = _searched(world, wide, _padded(start, wide))
            rows, slopes = world.through.undone(found.rows), world.through.undone(found.slopes[:, :count])
            return SearchResult(replace(found.end, place=found.place[:count]), rows, slopes)

        if len(starts) == 1:  # others may be at work beside this one
            return joined([one(starts[0])])
        return joined(at_once(world.settings.workers, one, starts))

    def room(self, errors: int) -> int | None:
        """The number of errors for which the program is compiled."""
        return self.world.room if errors <= self.world.room else None

    def coarser(self, times: float) -> "AmongAll":
        """The same: nothing is integrated where force is predicted."""
        return self

    @cached_property
    def _at(self) -> np.ndarray:
        """Where the model's unknowns stand among all."""
        return np.asarray(self.world.layout.at(self.layout.names), int)

    def _wide(self, subset: Subset) -> Subset:
        """The same subset among all effects."""
        names = frozenset(name for name, on in zip(self.template.names, subset.switches, strict=True) if on)
        start = self.world.start.copy()
        start[self._at] = subset.full
        wide = self.world.subset(names, self._at[subset.free], start)
        lower, upper = wide.lower.copy(), wide.upper.copy()
        lower[self._at], upper[self._at] = subset.lower, subset.upper
        return replace(wide, lower=lower, upper=upper)


def fit_from_smaller(
    world: Universe, effects: frozenset[str], smaller: CandidateFit, decide: bool = True
) -> CandidateFit:
    """Fit a set of effects from the optimum of a smaller one, with what is new as good as absent there.

    `decide` as of `Universe.fit`.
    """
    names = world.free(effects)
    new = np.array([name not in smaller.free for name in names], bool)
    if not new.any():
        return world.fit(effects, smaller.vector, decide=decide)
    subset = subset_of(world.layout, smaller.vector, names, world.switches(effects))
    entries = [world.layout.entries[i] for i in world.layout.at(names)]
    place = as_good_as_absent(AmongAll(world, world.layout), subset, entries, new)
    return world.fit(effects, subset.vector(place), decide=decide)


def _searched(world: Universe, subset: Subset, place: np.ndarray) -> SearchResult:
    """One search from a place, and others from where it ended until one has converged."""
    found = on_the_host(world.searched(subset, place))
    for _ in range(world.settings.further):
        if bool(found.end.converged) or not np.isfinite(found.cost):
            break
        found = on_the_host(world.searched(subset, np.asarray(found.place)))
    return found


def _padded(place: np.ndarray, subset: Subset) -> np.ndarray:
    """A place with what fills the standard size."""
    return np.append(place, np.full(len(subset.free) - len(place), MIDDLE))
