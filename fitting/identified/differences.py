"""How two identified muscles differ: the numbers that both have, their ratio, and how sure it is."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from fitting.identified.record import Behaviour, Identified

CLEAR = 2.0  # standard errors of the logarithm of a ratio, beyond which it is not 1; chosen: 95 of 100
LARGE = 1.2  # ratio from which, up or down, it is worth a sentence; chosen


@dataclass(frozen=True)
class Difference:
    """One number of both, SI; `error` is the standard error of the logarithm of the ratio mine/theirs, if known."""

    name: str
    unit: str
    mine: float
    theirs: float
    my_error: float | None
    their_error: float | None

    @property
    def ratio(self) -> float | None:
        """Mine over theirs; None where that says nothing."""
        if not (self.mine * self.theirs > 0):
            return None
        return self.mine / self.theirs

    @property
    def error(self) -> float | None:
        """Of the logarithm of the ratio; None where neither error is known."""
        known = [(e, v) for e, v in ((self.my_error, self.mine), (self.their_error, self.theirs)) if e is not None]
        return float(np.hypot.reduce([e / abs(v) for e, v in known])) if known and self.ratio is not None else None

    @property
    def range(self) -> tuple[float, float] | None:
        """The ratio's range that holds the truth in 95 of 100 cases."""
        if self.ratio is None or self.error is None:
            return None
        times = float(np.exp(CLEAR * self.error))
        return self.ratio / times, self.ratio * times

    @property
    def is_opposite(self) -> bool:
        """Whether the two are of opposite signs, each farther from zero than its errors."""
        both = ((self.mine, self.my_error), (self.theirs, self.their_error))
        return self.mine * self.theirs < 0 and all(e is not None and abs(v) > CLEAR * e for v, e in both)

    @property
    def is_large(self) -> bool:
        """Whether it is large, and larger than its error as far as that is known."""
        if self.ratio is None:
            return self.is_opposite
        apart = abs(float(np.log(self.ratio)))
        return apart > np.log(LARGE) and apart > CLEAR * (self.error or 0.0)


SAME_PRESSURE = 0.01  # share by which the pressures of two muscles may differ to compare what they do; chosen
UNITS = {"pull_at_rest": "N", "pull_over_section": "1", "stroke": "1", "loop_width": "N", "rubber": "N"}


def differences(mine: Identified, theirs: Identified) -> tuple[Difference, ...]:
    """Of all numbers that both have: sizes, parameters of effects that both have, what both do at their pressure."""
    return (*_parameters(mine, theirs), *_behaviour(mine.behaviour, theirs.behaviour))


def _parameters(mine: Identified, theirs: Identified) -> Iterator[Difference]:
    for name, here in mine.parameters.items():
        there = theirs.parameters.get(name)
        if there is not None and "held" not in (here.state, there.state) and (here.value or there.value):
            yield Difference(name, here.unit, here.value, there.value, here.error, there.error)


def _behaviour(mine: Behaviour, theirs: Behaviour) -> Iterator[Difference]:
    if abs(mine.pressure / theirs.pressure - 1) > SAME_PRESSURE:
        return
    for name, unit in UNITS.items():
        here, there = getattr(mine, name), getattr(theirs, name)
        if here is not None and there is not None:
            yield Difference(f"behaviour.{name}", unit, here, there, None, None)
