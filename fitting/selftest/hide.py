"""Effects hidden in a model by the amount they leave when the model has given way to them.

An effect is absent at some value of one of its parameters (a stiffness of 0, an exponent of 1). From there this
parameter moves through its range until the effect leaves what is wanted; no effect has to say how it is switched off.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.optimize import root_scalar

from fitting.diagnosis.nuisance import Nuisance
from fitting.diagnosis.search import Search
from fitting.full_names import common
from fitting.least_squares.absent import NEUTRAL
from fitting.problem.unknowns import Unknown
from fitting.selftest.settings import SELFTEST


@dataclass(frozen=True)
class Hidden:
    """An effect with its parameters' values (SI, by full name), and what it leaves (N rms) beside the model's fit."""

    effect: str
    values: dict[str, float]
    size: float
    vector: np.ndarray  # of all unknowns, the model's at its fit


@dataclass(frozen=True)
class Way:
    """How an effect grows: one parameter moves from its place in its range (0 to 1) where it is absent to an end.

    The others stay as `vector` has them.
    """

    vector: np.ndarray
    at: tuple[int, ...]  # one position for each data set that has a value of its own
    absent: float
    end: float


@dataclass(frozen=True)
class Hiding:
    """One effect of the library beside (or, of a rival, in place of what it replaces in) a fitted model."""

    search: Search
    effect: str

    @cached_property
    def effects(self) -> frozenset[str]:
        """All effects of the model that it is hidden in."""
        return self.search.world.with_added([self.effect], self.search.base.effects)

    def of(self, size: float) -> Hidden | None:
        """It as large as to leave about this (N rms) when the model is fitted again; None where it never does."""
        found = (self._as_large(way, size) for way in self._ways)
        return next((hidden for hidden in found if hidden is not None), None)

    def _as_large(self, way: Way, size: float) -> Hidden | None:
        """The place on a way where this is left: to first order, and from there by fits."""
        first = self._share(way, size)
        if first is None:
            return None
        left = lambda share: self._fitted_again(self._on(way, float(np.exp(share)))).size  # noqa: E731
        over = lambda share: float(np.log(max(left(share), 1e-300) / size))  # noqa: E731
        low, high = np.log(first / SELFTEST.around), np.log(min(first * SELFTEST.around, 1.0))
        if not over(low) < 0 < over(high):  # what it leaves does not grow all the way
            return self._fitted_again(self._on(way, first))
        share = root_scalar(over, bracket=(low, high), xtol=SELFTEST.near_enough).root
        return self._fitted_again(self._on(way, float(np.exp(share))))

    def _fitted_again(self, hidden: Hidden) -> Hidden:
        """The same with what it leaves when the model is fitted again to it."""
        world, base = self.search.world, self.search.base
        truth = replace(base, rows=self._rows(hidden.vector))
        return replace(hidden, size=world.rmse(world.mimicking(truth).fit(base.effects, base.vector).rows))

    @cached_property
    def smallest(self) -> Hidden:
        """Where it leaves least: of a rival without a free size this is all that it can be."""
        return self._fitted_again(min((self._at(vector) for vector in self._starts()), key=lambda each: each.size))

    def _share(self, way: Way, size: float) -> float | None:
        """How far on a way this is left, to first order; None where it is not."""
        short, long = SELFTEST.first, 1.0
        if self._on(way, long).size < size:
            return None
        for _ in range(SELFTEST.halvings):
            middle = float(np.sqrt(short * long))
            short, long = (middle, long) if self._on(way, middle).size < size else (short, middle)
        return long

    def _on(self, way: Way, share: float) -> Hidden:
        vector = way.vector.copy()
        vector[list(way.at)] = value_at(self._entry(way.at), way.absent + share * (way.end - way.absent))
        return self._at(vector)

    @cached_property
    def _ways(self) -> list[Way]:
        """The ways that lead from its absence: of the parameter with which it goes best, towards its usual value."""
        positions = self._positions
        starts = [(self._at(self._usual(i, place)).size, i, place) for i in positions for place in self._special(i)]
        if not starts:
            return []
        left, at, absent = min(starts)
        if left > SELFTEST.as_good_as_absent * self._noise:
            return []
        usual = place_of(self._entry(at), float(self._usual()[at[0]]))
        ends = [end for end in (0.0, 1.0) if abs(end - absent) > SELFTEST.first]
        ends.sort(key=lambda end: (end - absent) * (usual - absent) < 0)
        return [Way(self._usual(at, absent), at, absent, end) for end in ends[:1]]

    def _starts(self) -> list[np.ndarray]:
        return [self._usual(), *(self._usual(i, place) for i in self._positions for place in self._special(i))]

    @property
    def _positions(self) -> list[tuple[int, ...]]:
        """Its own parameters that may vary, each with its positions of all data sets."""
        layout, alike = self.search.world.layout, dict[str, list[int]]()
        for name in layout.of_effect(self.effect):
            if name not in self.search.world.fixed:
                alike.setdefault(common(name), []).append(int(layout.at([name])[0]))
        return [tuple(positions) for positions in alike.values()]

    def _usual(self, at: tuple[int, ...] | None = None, place: float = 0.0) -> np.ndarray:
        """The model's fit with the effect's usual values, a size it shares with the rival it replaces being that one's;
        one of its parameters at a place of its range.
        """
        layout, vector = self.search.world.layout, self.search.base.vector.copy()
        for i in (i for positions in self._positions for i in positions):
            vector[i] = layout.entries[i].start
            for old in self.search.base.effects - self.effects:
                twin = f"{old}.{layout.names[i].split('.', 1)[1]}"
                if twin in layout.names:
                    vector[i] = vector[layout.names.index(twin)]
        if at is not None:
            vector[list(at)] = value_at(self._entry(at), place)
        return vector

    def _special(self, at: tuple[int, ...]) -> list[float]:
        """Places at which a parameter may switch its effect off: the ends of its range, neutral numbers."""
        entry = self._entry(at)
        neutral = [value for value in NEUTRAL if entry.lower < value < entry.upper]
        return [0.0, 1.0, *(place_of(entry, value) for value in neutral)]

    def _entry(self, at: tuple[int, ...]) -> Unknown:
        return self.search.world.layout.entries[at[0]]

    @property
    def _noise(self) -> float:
        """The noise of a reading, N: what is far smaller is not there."""
        world = self.search.world
        return float(np.sqrt(np.mean(world.samples.sigma[world.in_newtons] ** 2)))

    def _rows(self, vector: np.ndarray) -> np.ndarray:
        """The rows of the model with it."""
        world, base = self.search.world, self.search.base
        return world.rows_at(replace(base, effects=self.effects, vector=vector), world.problem)

    def _at(self, vector: np.ndarray) -> Hidden:
        """It with these values of all unknowns."""
        world, base = self.search.world, self.search.base
        change = np.nan_to_num(self._rows(vector) - base.rows, nan=np.inf, posinf=np.inf, neginf=-np.inf)
        size = np.inf
        if np.isfinite(change).all():
            size = world.rmse(Nuisance.of(base).project_out(change[:, None])[:, 0])
        names = world.layout.of_effect(self.effect)
        values = dict(zip(names, map(float, vector[world.layout.at(names)]), strict=True))
        return Hidden(self.effect, values, size, vector)


def place_of(entry: Unknown, value: float) -> float:
    """Where in its range a value stands, from 0 to 1; of a wide positive range in the logarithm."""
    low, high, value = ((np.log(v) if entry.logarithmic else v) for v in (entry.lower, entry.upper, value))
    return float((value - low) / (high - low))


def value_at(entry: Unknown, place: float) -> float:
    """The value at a place of its range."""
    if entry.logarithmic:
        return float(np.exp(np.log(entry.lower) + place * np.log(entry.upper / entry.lower)))
    return float(entry.lower + place * (entry.upper - entry.lower))
