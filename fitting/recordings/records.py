"""What a measurement is, once read and checked: immutable records in SI units that everything else works on."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import Enum
from pathlib import Path
from typing import Any

import numpy as np

from fitting.recordings.accuracy import NOTHING_STATED, Accuracy
from mckibben_jax.muscle import Muscle

FORCE_TESTS = ("loop", "isometric", "static")
MOVING_TESTS = ("quick release", "step")  # the mass counts, and an equation of motion is integrated
POSITION_TESTS = ("isotonic", "quick release", "step")
TESTS = FORCE_TESTS + POSITION_TESTS


class NoiseSource(Enum):
    """Where the noise of one reading is known from."""

    STATED = "stated"  # by muscle.toml
    STATED_OF_ALL = "stated of all"  # the same of a static point, whose pressure and position err, too
    NEIGHBOURS = "neighbours"  # from the scatter of neighbouring readings
    MOTION = "motion"  # the noise of a position, carried on to the force that moves the mass
    ASSUMED = "assumed"  # a share of full scale: nothing tells it


@dataclass(frozen=True, kw_only=True)
class Run:
    """One experiment without interruption: arrays of one length, SI, in the order of measurement.

    The only record of a run's signals: as read (`Run.as_read`), then with estimates, rates, branches and weights.
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
    pressure_reading: np.ndarray | None = None  # Pa, that `pressure` was estimated from; None where it is as read
    contraction_reading: np.ndarray | None = None  # 1, the same of `contraction`
    averaging: np.ndarray | None = None  # (samples, neighbours), weights of the mean that `measured` is (`averages`)
    without_weight: Mapping[str, int] = field(default_factory=dict)  # samples that lost their weight, by reason

    def __len__(self) -> int:
        return len(self.time)

    @classmethod
    def as_read(
        cls,
        *,
        name: str,
        time: np.ndarray,
        pressure: np.ndarray,
        contraction: np.ndarray,
        measured: np.ndarray,
        row: np.ndarray,
        usable: np.ndarray,
        direction: np.ndarray | None = None,
        load: np.ndarray | None = None,
        set_pressure: np.ndarray | None = None,
    ) -> "Run":
        """A run of readings alone: no rate is known, nor a branch unless `direction` (+1, -1) states it.

        `usable` is False where a reading is missing or outside `valid`.
        """
        still, none = np.zeros(len(time)), np.zeros(len(time), dtype=int)
        return cls(
            name=name,
            time=time,
            pressure=pressure,
            contraction=contraction,
            rate=still,
            pressure_rate=still,
            measured=measured,
            weight=usable * 1.0,
            branch=none if direction is None else direction,
            loop=none,
            half=none,
            row=row,
            load=load,
            set_pressure=set_pressure,
        )

    @property
    def usable(self) -> np.ndarray:
        """Samples that carry weight, a mask."""
        return self.weight > 0

    def at(self, places: Any) -> "Run":
        """The run of these samples alone: positions, a mask or a slice."""
        arrays = {name: values for name, values in vars(self).items() if isinstance(values, np.ndarray)}
        return replace(self, **{name: values[places] for name, values in arrays.items()})

    def leave_out(self, which: np.ndarray, reason: str) -> "Run":
        """The run in which these samples (a mask) carry no weight; those that did are counted under the reason."""
        lost = int(np.count_nonzero(which & self.usable))
        counts = {**self.without_weight, reason: self.without_weight.get(reason, 0) + lost}
        return replace(self, weight=np.where(which, 0.0, self.weight), without_weight=counts)


@dataclass(frozen=True)
class Recording:
    """One file, or one part of it: runs of one kind of test, measured in one unit."""

    file: str  # with the part of it that was read
    test: str
    runs: tuple[Run, ...]
    noise: float | None  # standard deviation of one reading, N or m; None: the readings themselves tell it
    notes: tuple[str, ...] = ()  # what was set aside and why, with counts
    position: str = "contraction"  # what the rig read: "contraction", "length" or "displacement"
    units: Mapping[str, str] = field(default_factory=dict)  # SI unit -> what the file gives it in ("Pa" -> "psi")
    noise_source: NoiseSource = NoiseSource.STATED  # where `noise` is known from, if it is given
    accuracy: Accuracy = NOTHING_STATED  # as muscle.toml states it; `presumed.allowed` fills what is missing
    found: Accuracy = NOTHING_STATED  # noise and resolution of its channels, as their readings show them
    noise_of_inputs: float = 0.0  # N, that stated errors of pressure and position add to a point of a static map
    hangs: bool = False  # the force is that of a load that hangs: no load cell errs differently from run to run
    ambient_is_presumed: bool = False  # pressures were absolute, and nobody said what the air's was
    part: str = ""  # how `file` ends where a part of one is meant: ", sheet Monday"

    @property
    def stored_in(self) -> str:
        """The file on disk, relative to the folder."""
        return self.file.removesuffix(self.part)

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
    is_confined: bool = False  # a fit may not deny the stated sizes: they stay within what the statement allows
    notes: tuple[str, ...] = ()  # what its recordings cannot say even together
    hose: str = ""  # that the muscle is cut from, by name: muscles of one hose share its sizes

    @property
    def units(self) -> tuple[Mapping[str, str], ...]:
        """The units that the data's owner uses: of each recording, and of lengths muscle.toml's if none has one."""
        stated = tuple(recording.units for recording in self.recordings)
        return stated if any("m" in given for given in stated) else (*stated, {"m": self.length_unit or "m"})


def force_was_measured(experiments: Sequence[Experiment]) -> bool:
    """Whether any recording of these data sets is one of force."""
    return any(recording.test in FORCE_TESTS for each in experiments for recording in each.recordings)
