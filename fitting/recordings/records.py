"""What a measurement is, once read and checked: immutable records in SI units that everything else works on."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path

import numpy as np

from mckibben_jax.muscle import Muscle

FORCE_TESTS = ("loop", "isometric", "static")
MOVING_TESTS = ("quick release", "step")  # the mass counts, and an equation of motion is integrated
POSITION_TESTS = ("isotonic", "quick release", "step")
TESTS = FORCE_TESTS + POSITION_TESTS


class NoiseSource(Enum):
    """Where the noise of one reading is known from."""

    STATED = "stated"  # by muscle.toml
    NEIGHBOURS = "neighbours"  # from the scatter of neighbouring readings
    MOTION = "motion"  # the noise of a position, carried on to the force that moves the mass
    ASSUMED = "assumed"  # a share of full scale: nothing tells it


@dataclass(frozen=True)
class Run:
    """One experiment without interruption: arrays of one length, SI, in the order of measurement.

    `pressure` and `contraction` are estimates of what was there, as they enter the laws; `rate` and `pressure_rate`
    are derived and exactly 0 where their sign cannot be told from noise. `branch` is +1 while contracting (in isometric
    tests: inflating), -1 while elongating (deflating), 0 where it cannot be told. `loop` numbers closed loops from
    turning point to the next but one, `half` the branches between turning points. `weight` is 0 for samples that count
    in no model, else 1.
    """

    name: str
    time: np.ndarray  # s
    pressure: np.ndarray  # Pa, gauge
    contraction: np.ndarray  # 1; in position tests NaN where unknown, the measured channel says where the muscle is
    rate: np.ndarray  # 1/s
    pressure_rate: np.ndarray  # Pa/s
    measured: np.ndarray  # N (force tests) or m of shortening (position tests)
    weight: np.ndarray  # 0 or 1
    branch: np.ndarray  # -1, 0, +1
    loop: np.ndarray  # int
    half: np.ndarray  # int
    row: np.ndarray  # int, line of the file that a sample stands in
    load: np.ndarray | None = None  # N hung on the muscle (position tests)
    set_pressure: np.ndarray | None = None  # Pa, the valve's set-point (step tests)
    pressure_variance: np.ndarray | None = None  # Pa^2, of the estimate `pressure`; None where it is known exactly
    contraction_variance: np.ndarray | None = None  # 1, of the estimate `contraction`; None where it is no estimate

    def __len__(self) -> int:
        return len(self.time)


@dataclass(frozen=True)
class Recording:
    """One file: runs of one kind of test, measured in one unit."""

    file: str
    test: str
    runs: tuple[Run, ...]
    noise: float | None  # standard deviation of one reading, N or m; None: the readings themselves tell it
    notes: tuple[str, ...] = ()  # what was set aside and why, with counts
    position: str = "contraction"  # what the rig read: "contraction", "length" or "displacement"
    units: Mapping[str, str] = field(default_factory=dict)  # SI unit -> what the file gives it in ("Pa" -> "psi")
    noise_source: NoiseSource = NoiseSource.STATED  # where `noise` is known from, if it is given

    @property
    def unit(self) -> str:
        """Unit of the measured channel."""
        return "N" if self.test in FORCE_TESTS else "m"


@dataclass(frozen=True)
class Experiment:
    """A data set: one muscle, its recordings and what is known of its geometry."""

    name: str
    folder: Path
    muscle: Muscle
    recordings: tuple[Recording, ...]
    priors: dict[str, tuple[float, float]]  # "muscle.radius" -> mean and standard deviation, SI
    sha256: str  # of every file that was read
    source: dict[str, str] = field(default_factory=dict)
    length_unit: str = ""  # that muscle.toml gives the length in

    @property
    def units(self) -> tuple[Mapping[str, str], ...]:
        """The units that the data's owner uses: of each recording, and of lengths muscle.toml's if none has one."""
        stated = tuple(recording.units for recording in self.recordings)
        return stated if any("m" in given for given in stated) else (*stated, {"m": self.length_unit or "m"})


def force_was_measured(experiments: Sequence[Experiment]) -> bool:
    """Whether any recording of these data sets is one of force."""
    return any(recording.test in FORCE_TESTS for each in experiments for recording in each.recordings)
