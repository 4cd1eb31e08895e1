"""What evaluates the rows of a fit and searches for its best place: one of two compiled programs.

A fit asks for the rows at a place and for searches from some places. One program holds the effects of the model alone;
the other holds every effect of a library, and those that the model lacks are switched off. A fit need not know which.
"""

from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from fitting.instruments.through import Through, standard_number
from fitting.least_squares.search import Evaluated, MultistartResult, SearchResult, joined, on_the_host, solve
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
    """A program compiled for one model: it searches from one place, or looks at it."""

    standard: Standard

    @classmethod
    def of(cls, given: Problem) -> "Alone":
        """For a problem brought to standard size."""
        return cls(Standard.of(given))

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
        found = on_the_host(self.solved(subset, place, given, look=True))
        return Evaluated(place, found.rows, found.slopes)

    def look(self, subset: Subset, places: np.ndarray) -> np.ndarray:
        """Half the sum of squares at each of these places (places, free); infinite where a row is no finite number."""
        return np.array([float(self.solved(subset, place, look=True).cost) for place in places])

    def search(self, subset: Subset, starts: np.ndarray, errors: np.ndarray | None = None) -> MultistartResult:
        """Searches from each of these places (starts, free); see `Searches`."""
        through = None if errors is None else self._through(errors)
        found = joined(self.solved(subset, start, through=through) for start in starts)
        if through is None:
            return found
        return replace(found, rows=through.undone(found.rows), slopes=through.undone(found.slopes))

    def solved(
        self, subset: Subset, place: Array, problem: Problem | None = None, look: bool = False,
        through: Through | None = None,
    ) -> SearchResult:  # fmt: skip
        """One search from a place, or a look at it; on another problem of the same shape, if given."""
        given = self.standard.problem if problem is None else problem
        return solve(given, subset, np.asarray(place), look=np.asarray(look), through=through)

    def without(self, left_out: np.ndarray) -> "Alone":
        """The same where these of the measured rows (a mask) count next to nothing."""
        return replace(self, standard=self.standard.without(left_out))

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
