"""A recording that could be made, and what it asks of the rig."""

from dataclasses import dataclass
from enum import StrEnum
from typing import NamedTuple

import numpy as np


class Need(StrEnum):
    """What a recording needs of the rig that the data do not show."""

    LENGTH_DRIVE = "length drive"  # that moves the length while the force is read
    PRESSURE_SWEEP = "pressure sweep"  # while the length is held
    PRESSURE = "pressure"  # Pa, more than the largest seen
    SPEED = "speed"  # m/s, faster than the fastest seen
    RAMP = "ramp"  # Pa/s, the same of the pressure


class Demand(NamedTuple):
    """A need and, where it is one of size, how much is asked for and the most that the data show; SI."""

    need: Need
    asked: float = 0.0
    seen: float = 0.0


class Specimen(StrEnum):
    """A muscle: the one that was measured, or another of the same make."""

    MEASURED = ""
    HALF_AS_LONG = "half as long"
    TWICE_AS_LONG = "twice as long"
    THICK_WALL = "wall twice as thick"


@dataclass(frozen=True)
class Protocol:
    """A recording that could be made: repeats of one closed cycle, SI.

    A loop goes between two contractions at one pressure, an isometric test between two pressures at one contraction, a
    static one from point to point. `rate` is that of the contraction (1/s), in isometric tests of the pressure (Pa/s).
    `unseen` is what the data do not show that the rig can do; `beyond` whether that is more than most rigs can.
    """

    test: str
    pressures: tuple[float, float]
    contractions: tuple[float, float]
    rate: float
    hold: float = 0.0  # s, at each turning point
    unseen: tuple[Demand, ...] = ()
    beyond: bool = False
    specimen: Specimen = Specimen.MEASURED

    @property
    def branch_time(self) -> float:
        """Duration from one turning point to the next, s."""
        span = np.ptp(self.pressures) if self.test == "isometric" else np.ptp(self.contractions)
        return float(span / self.rate) if self.rate > 0 else 0.0
