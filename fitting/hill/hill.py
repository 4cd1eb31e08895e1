"""Is it a Hill muscle? Speed over load from quick releases, Hill's curve through it, and what else gives that curve.

The speed is read as the review does (Tondu 2012, fig. 17): from the straight part of each recorded position. A load
that only inertia and dry friction hold back has such a straight part too, where its acceleration vanishes (eq 47
solved); so that curve is fitted to the same readings. `motion` asks the recorded positions themselves.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import curve_fit
from scipy.signal import savgol_filter

from fitting import showing
from fitting.comparison.bins import bins
from fitting.errors import InputError
from fitting.hill.settings import RELEASES
from fitting.recordings.noise import noise_of
from fitting.recordings.records import Experiment, Run
from mckibben_jax.laws.biology import hill_velocity_ratio

TEST = "quick release"


@dataclass(frozen=True)
class Reading:
    """The straight part of one release."""

    run: str
    load: float  # N
    pressure: float  # Pa
    speed: float  # m/s
    error: float  # m/s, of the slope
    begin: float  # s
    end: float  # s


@dataclass(frozen=True)
class HillCurve:
    """Hill's law fitted to speeds over loads at one pressure; errors are standard errors from the scatter."""

    pressure: float  # Pa
    readings: tuple[Reading, ...]
    isometric: float  # F0, N
    isometric_error: float
    curvature: float  # a/F0
    curvature_error: float
    largest: float  # V_max, m/s
    largest_error: float
    misfit: float  # rms, as a share of the rms speed

    @property
    def a(self) -> float:
        """Hill's a, N."""
        return self.curvature * self.isometric

    @property
    def b(self) -> float:
        """Hill's b, m/s."""
        return self.curvature * self.largest

    @property
    def b_error(self) -> float:
        """Standard error of b, m/s, as if a/F0 and V_max were independent."""
        return self.b * float(np.hypot(self.curvature_error / self.curvature, self.largest_error / self.largest))

    def speed(self, load: float | np.ndarray) -> np.ndarray:
        """Speed at a load (N), m/s."""
        return self.largest * np.asarray(hill_velocity_ratio(load / self.isometric, self.curvature))


@dataclass(frozen=True)
class DryCurve:
    """Speeds that inertia and constant friction alone give (eq 47), fitted to the same readings."""

    heaviest: float  # N, the heaviest load that moves
    scale: float  # m/s, of (1 - w)/sqrt(w), w = load/heaviest
    misfit: float  # rms, as a share of the rms speed
    read_as_hill: HillCurve  # what Hill's law would make of these speeds at these loads

    def speed(self, load: float | np.ndarray) -> np.ndarray:
        """Speed at a load (N), m/s."""
        w = load / self.heaviest
        return self.scale * (1 - w) / np.sqrt(w)


@dataclass(frozen=True)
class Curves:
    """Hill's curve through the readings at one pressure, and that of inertia and dry friction alone."""

    hill: HillCurve
    dry: DryCurve

    @property
    def alike(self) -> bool:
        """Whether these speeds cannot tell Hill's law from inertia with dry friction.

        Either fits about as well, or Hill's law would read the same a/F0 from what has no viscosity at all.
        """
        read = self.dry.read_as_hill
        error = float(np.hypot(self.hill.curvature_error, read.curvature_error))
        as_well = self.dry.misfit < RELEASES.worse * max(self.hill.misfit, RELEASES.read)
        return as_well or abs(self.hill.curvature - read.curvature) < RELEASES.same * error


# Speed over load -----------------------------------------------------------------------------------------------------


def straight_part(time: np.ndarray, position: np.ndarray, noise: float) -> tuple[float, float, slice]:
    """Slope of the straight part of a rising position (m/s), its standard error, and where that part is.

    It grows to both sides of the steepest place until it bends by more than noise or a thousandth of the travel, which
    makes the peak of a cosine 2 % slower than it is.
    """
    window = max(5, len(time) // 40 | 1)
    peak = int(np.argmax(np.asarray(savgol_filter(position, window, 1, deriv=1))))
    bent = max(1.5 * noise, RELEASES.bent * float(np.ptp(position)))
    slope, error, part = 0.0, np.inf, slice(0, 0)
    for half in range(2, len(time)):
        wider = slice(peak - half, peak + half + 1)
        if wider.start < 0 or wider.stop > len(time):
            break
        steep, unsure, left = _line(time[wider], position[wider])
        if left > bent and half > 2:
            break
        slope, error, part = steep, unsure, wider
    return slope, error, part


def _line(time: np.ndarray, position: np.ndarray) -> tuple[float, float, float]:
    """Slope, its standard error, and the rms deviation from the line."""
    about = time - time.mean()
    spread = float(np.sum(about**2))
    slope = float(np.sum(about * position)) / spread
    left = position - position.mean() - slope * about
    return slope, float(np.sqrt(np.sum(left**2) / max(len(time) - 2, 1) / spread)), float(np.sqrt(np.mean(left**2)))


def readings(runs: Sequence[Run], noise: float) -> tuple[Reading, ...]:
    """The straight part of every run that moves."""
    found = []
    for run in runs:
        after = run.time >= 0
        time, place = run.time[after], run.measured[after]
        if run.load is None or len(time) < RELEASES.fewest_samples:
            continue
        if np.ptp(place) < max(20 * noise, RELEASES.least_travel):
            continue
        slope, error, part = straight_part(time, place, noise)
        pressure, load = float(np.mean(run.pressure[after])), float(np.mean(run.load))
        found.append(Reading(run.name, load, pressure, slope, error, float(time[part][0]), float(time[part][-1])))
    return tuple(found)


def hill_curve(read: Sequence[Reading]) -> HillCurve:
    """Hill's law by least squares of the speeds at four loads or more: isometric force, a/F0 and V_max."""
    load, speed = _columns(read)

    def law(load: np.ndarray, isometric: float, log_curvature: float, largest: float) -> np.ndarray:
        curvature = np.exp(log_curvature)
        return largest * curvature * (1 - load / isometric) / (load / isometric + curvature)

    begin = (1.2 * load.max(), np.log(0.3), 1.5 * speed.max())
    bounds = ([load.max(), np.log(1e-3), 0.1 * speed.max()], [10 * load.max(), np.log(1e3), 1e3 * speed.max()])
    try:
        best, spread = curve_fit(law, load, speed, begin, bounds=bounds, x_scale=np.abs(begin), max_nfev=5000)
    except RuntimeError:
        raise InputError("the speeds follow no Hill curve at all", cure="look at the recordings") from None
    errors, curvature = np.sqrt(np.diag(spread)), float(np.exp(best[1]))
    left = _share(law(load, *best) - speed, speed)
    pressure = float(np.mean([r.pressure for r in read]))
    return HillCurve(pressure, tuple(read), float(best[0]), float(errors[0]), curvature, float(curvature * errors[1]),
                     float(best[2]), float(errors[2]), left)  # fmt: skip


def dry_curve(read: Sequence[Reading]) -> DryCurve:
    """The speeds of a linear spring with constant friction that lifts a load (eq 47), fitted to readings.

    V sqrt(load) is a straight line over the load, which ends at the heaviest that moves.
    """
    load, speed = _columns(read)

    def law(load: np.ndarray, heaviest: float, scale: float) -> np.ndarray:
        return scale * (1 - load / heaviest) / np.sqrt(load / heaviest)

    best, _ = curve_fit(law, load, speed, (1.2 * load.max(), speed.max()), bounds=([load.max(), 0], [np.inf, np.inf]))
    fitted = law(load, *best)
    same = [replace(reading, speed=float(value)) for reading, value in zip(read, fitted, strict=True)]
    return DryCurve(float(best[0]), float(best[1]), _share(fitted - speed, speed), hill_curve(same))


def _columns(read: Sequence[Reading]) -> tuple[np.ndarray, np.ndarray]:
    return np.array([reading.load for reading in read]), np.array([reading.speed for reading in read])


def _share(left: np.ndarray, whole: np.ndarray) -> float:
    return float(np.sqrt(np.mean(left**2) / np.mean(whole**2)))


def releases(experiments: Sequence[Experiment]) -> tuple[Experiment, ...]:
    """The data sets with their quick releases alone."""
    kept = [replace(e, recordings=tuple(r for r in e.recordings if r.test == TEST)) for e in experiments]
    kept = [experiment for experiment in kept if experiment.recordings]
    if not kept:
        raise InputError("there is no quick release in these data", cure="give a data set with test = 'quick release'")
    return tuple(kept)


def by_pressure(experiments: Sequence[Experiment]) -> tuple[tuple[Reading, ...], ...]:
    """The readings of each data set at each pressure."""
    found: list[tuple[Reading, ...]] = []
    for experiment in releases(experiments):
        runs = [run for recording in experiment.recordings for run in recording.runs]
        read = readings(runs, max(noise_of(recording) for recording in experiment.recordings))
        if not read:
            raise InputError("no release moves its load", experiment.folder, cure="record releases under lighter loads")
        groups = bins(np.array([reading.pressure for reading in read]))
        for k in range(len(groups)):
            found.append(tuple(reading for reading, of in zip(read, groups.of, strict=True) if of == k))
    return tuple(found)


def loads_of(read: Sequence[Reading]) -> int:
    """Under how many loads these were released."""
    return len(np.unique([reading.load for reading in read]))


def curves(experiments: Sequence[Experiment]) -> tuple[Curves, ...]:
    """Speed over load, one pair of curves for each data set and pressure under which there are loads enough.

    InputError where there are too few under every pressure.
    """
    groups = by_pressure(experiments)
    enough = [read for read in groups if loads_of(read) >= RELEASES.fewest_loads]
    if not enough:
        most = max(groups, key=loads_of)
        at = showing.show(float(np.mean([reading.pressure for reading in most])), "Pa", digits=3)
        raise InputError(f"Hill's curve needs {RELEASES.fewest_loads} loads at one pressure; here are at most "
                         f"{loads_of(most)} (at {at})", cure="record quick releases under more loads")  # fmt: skip
    return tuple(Curves(hill_curve(read), dry_curve(read)) for read in enough)
