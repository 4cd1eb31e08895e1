"""What evaluates the rows of a fit and searches for its best place: one of two compiled programs.

A fit asks for the rows at a place and for searches from some places. One program holds the effects of the model alone;
the other holds every effect of a library, and those that the model lacks are switched off. A fit need not know which.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from fitting.instruments.through import Through, standard_number
from fitting.least_squares.search import (
    Evaluated,
    MultistartResult,
    on_the_host,
    rows_and_slopes,
    solve,
)
from fitting.least_squares.subset import Array, Subset
from fitting.problem.residuals import Problem
from fitting.problem.sizes import Standard
from mckibben_jax.model import Model


class Searches(Protocol):
    """What answers a fit: rows and slopes at a place of the unit box, and the ends of searches from some places."""

    @property
    def standard(self) -> Standard:
        """The problem as it is searched."""
        ...

    @property
    def template(self) -> Model:
        """A model of the effects that the switches of a subset are of, in their order."""
        ...

    def at(self, subset: Subset, place: Array, problem: Problem | None = None) -> Evaluated:
        """Rows and slopes at one place; on another problem of the same shape, if given."""
        ...

    def look(self, subset: Subset, places: np.ndarray) -> np.ndarray:
        """Half the sum of squares at each of these places (places, free); infinite where a row is no finite number."""
        ...

    def search(self, subset: Subset, starts: np.ndarray, errors: np.ndarray | None = None) -> MultistartResult:
        """Searches from each of these places (starts, free), with rows and slopes at the best end.

        Rows are made small as instruments let them be seen, if they make `errors` (measured rows, errors), and given
        back as they are.
        """
        ...

    def room(self, errors: int) -> int | None:
        """For how many errors of instruments there is room where there are so many; None where they are too many."""
        ...

    def coarser(self, times: float) -> "Searches":
        """The same with so many times fewer steps of integration."""
        ...


@dataclass(frozen=True)
class Alone:
    """Programs compiled for one model: one for rows, one for `count` searches at once."""

    standard: Standard
    count: int

    @classmethod
    def of(cls, given: Problem, count: int = 1) -> "Alone":
        """For a problem brought to standard size."""
        return cls(Standard.of(given), count)

    @property
    def template(self) -> Model:
        """The model with all its effects."""
        return self.standard.problem.templates[0]

    def at(self, subset: Subset, place: Array, problem: Problem | None = None) -> Evaluated:
        """Rows and slopes at one place; on another problem of the same shape, if given."""
        given = self.standard.problem if problem is None else problem
        if not np.size(place):  # nothing varies, and nothing has to be compiled
            rows = np.asarray(given.rows(subset.full, subset.switches, None))
            return Evaluated(place, rows, np.zeros((rows.size, 0)))
        return Evaluated(place, *map(np.asarray, rows_and_slopes(given, subset, np.asarray(place))))

    def look(self, subset: Subset, places: np.ndarray) -> np.ndarray:
        """Half the sum of squares at each of these places, by the program for searches: no other is compiled."""
        return np.concatenate([self._solved(subset, some, None, True).ends.cost for some in self._parts(places)])

    def search(self, subset: Subset, starts: np.ndarray, errors: np.ndarray | None = None) -> MultistartResult:
        """Searches from each of these places (starts, free); see `Searches`."""
        through = None if errors is None else self._through(errors)
        found = joined([self._solved(subset, some, through, False) for some in self._parts(starts)])
        if through is None:
            return found
        return replace(found, rows=through.undone(found.rows), slopes=through.undone(found.slopes))

    def _solved(self, subset: Subset, starts: np.ndarray, through: Through | None, look: bool) -> MultistartResult:
        """At most `count` searches, filled up with some that only look, as do all if they are to `look`."""
        count = len(starts)
        begin = np.concatenate([starts, np.repeat(starts[-1:], self.count - count, axis=0)])
        only = look | (np.arange(self.count) >= count)
        found = on_the_host(solve(self.standard.problem, subset, begin, look=only, through=through))
        return replace(found, ends=replace(found.ends, **{name: end[:count] for name, end in vars(found.ends).items()}))

    def _parts(self, places: np.ndarray) -> list[np.ndarray]:
        """As many places at once as the compiled program takes."""
        return [places[first : first + self.count] for first in range(0, len(places), self.count)]

    def room(self, errors: int) -> int | None:
        """The standard number of errors for which a program is compiled."""
        return standard_number(errors)

    def coarser(self, times: float) -> "Alone":
        """The same with so many times fewer steps of integration."""
        return replace(self, standard=replace(self.standard, problem=self.standard.problem.coarser(times)))

    def _through(self, errors: np.ndarray) -> Through:
        wide = np.zeros((self.standard.problem.count, errors.shape[1]))
        wide[self.standard.rows[: len(errors)]] = errors
        return Through.of(wide)


def cost_of(at: Evaluated) -> float:
    """Half the sum of squares of the rows; infinite where one of them is no finite number."""
    cost = 0.5 * float(np.sum(np.square(np.asarray(at.rows))))
    return cost if np.isfinite(cost) else np.inf


def joined(results: Sequence[MultistartResult]) -> MultistartResult:
    """Searches one after another as one: all their ends, and rows and slopes at the best of them."""
    best = min(results, key=lambda each: float(each.cost))
    ends = [vars(each.ends) for each in results]
    return replace(best, ends=replace(best.ends, **{name: np.concatenate([e[name] for e in ends]) for name in ends[0]}))
