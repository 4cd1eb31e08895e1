"""Releases and steps read as recordings of force: along a recorded motion the muscle pulls the load and M x''.

The position is smoothed by local polynomials (Savitzky & Golay 1964), whose second derivative gives the force; no
equation of motion is integrated. At a standstill, a stop or a reversal dry friction is any force up to its size, and
a polynomial blurs its jump: such samples count in no model, so neither a break-away nor a standstill is seen.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.constants import g
from scipy.ndimage import maximum_filter1d, minimum_filter1d
from scipy.signal import savgol_coeffs, savgol_filter

from fitting import showing
from fitting.recordings.noise import noise_of
from fitting.recordings.records import FORCE_TESTS, MOVING_TESTS, Experiment, NoiseSource, Recording, Run
from fitting.recordings.settings import DYNAMICS

ASIDE = "joins the fit and the comparison, but is not looked at here"


def as_force(experiment: Experiment) -> tuple[Experiment, tuple[str, ...]]:
    """The data set in newtons: recordings of force as they are, motions as loops; and what is said of the others.

    A motion becomes one recording for each kind of noise, for a force errs by mass x gain of the filter x noise of the
    position. The data set has no recordings where none is of use.
    """
    recordings, notes = [], []
    for recording in experiment.recordings:
        if recording.test in FORCE_TESTS:
            recordings.append(recording)
        elif recording.test in MOVING_TESTS:
            loops, said = _loops(recording, experiment)
            recordings += loops
            notes += said
        else:
            notes.append(f"{recording.file}: the {recording.test} test {ASIDE}")
    return replace(experiment, recordings=tuple(recordings)), tuple(notes)


def _loops(recording: Recording, experiment: Experiment) -> tuple[list[Recording], list[str]]:
    """A recording of motions as recordings of force, each of runs that err alike, and what to say of it."""
    read, refused = [], {}
    for run in recording.runs:
        motion = _motion(run, recording, experiment)
        if isinstance(motion, str):
            refused.setdefault(motion, []).append(run.name)
        else:
            read.append(motion)
    if not read:
        return [], [f"{recording.file}: the {recording.test} test {ASIDE}: {'; '.join(refused)}"]
    said = "read as force through the moving mass (a break-away or standstill is not seen in it)"
    notes = [f"{recording.file}: {said}", *(_left_out(recording.file, why, runs) for why, runs in refused.items())]
    parts = _alike(sorted(read, key=lambda motion: motion.noise))
    length = float(experiment.muscle.length)
    return [_recording(recording, part, length, first=part is parts[0]) for part in parts], notes


def _left_out(file: str, why: str, runs: Sequence[str]) -> str:
    return f"{file}: not read as force, {'run' if len(runs) == 1 else 'runs'} {', '.join(runs)}: {why}"


# -------------------------------------------------------------------------------------------------------- one motion


@dataclass(frozen=True)
class Motion:
    """One run whose position is smoothed over a window; arrays over its samples, SI."""

    run: Run
    interval: float  # s
    window: int  # samples, odd
    error: float  # standard deviation of one position, m
    mass: float  # kg, of all that moves
    load: float  # N

    @cached_property
    def position(self) -> np.ndarray:
        """Shortening, m."""
        return self._derivative(0)

    @cached_property
    def speed(self) -> np.ndarray:
        """m/s."""
        return self._derivative(1)

    @cached_property
    def acceleration(self) -> np.ndarray:
        """m/s2."""
        return self._derivative(2)

    def _derivative(self, order: int) -> np.ndarray:
        return savgol_filter(
            self.run.measured, self.window, DYNAMICS.order, deriv=order, delta=self.interval, mode="interp"
        )

    @property
    def force(self) -> np.ndarray:
        """What the muscle pulls, N."""
        return self.load + self.mass * self.acceleration

    @property
    def noise(self) -> float:
        """Standard deviation of one force, N."""
        return self.mass * self.error * float(np.linalg.norm(self.filter))

    @property
    def filter(self) -> np.ndarray:
        """Weights of the positions of one window in its acceleration, 1/s2."""
        return savgol_coeffs(self.window, DYNAMICS.order, deriv=2, delta=self.interval)

    @cached_property
    def moving(self) -> np.ndarray:
        """Samples whose window is whole and holds motion in one direction at a pressure that hardly changes."""
        least = lambda values: minimum_filter1d(values, self.window)  # noqa: E731
        most = lambda values: maximum_filter1d(values, self.window)  # noqa: E731
        blur = 3 * self.error * np.linalg.norm(savgol_coeffs(self.window, DYNAMICS.order, deriv=1, delta=self.interval))
        slow = max(DYNAMICS.slow, float(blur))
        one_way = (least(self.speed) > slow) | (most(self.speed) < -slow)
        pressure = self.run.pressure
        steady = most(pressure) - least(pressure) < DYNAMICS.steady * float(np.abs(pressure).max())
        whole = least(self._even * (self.run.weight > 0)) > 0
        inside = np.zeros(len(self.run), bool)
        inside[self.window // 2 : len(self.run) - self.window // 2] = True
        return one_way & steady & whole & inside

    @property
    def _even(self) -> np.ndarray:
        """Samples that lie one interval from both neighbours."""
        uneven = np.abs(np.diff(self.run.time) / self.interval - 1) > DYNAMICS.uneven
        return ~(np.append(uneven, False) | np.insert(uneven, 0, False))

    @property
    def usable(self) -> np.ndarray:
        """Moving samples at which the mass need not be known well.

        Told from the speeds at both ends of the window: the acceleration's own noise would choose among the readings.
        """
        half = self.window // 2
        padded = np.pad(self.speed, half, mode="edge")
        mean = (padded[2 * half :] - padded[: len(self.speed)]) / (2 * half * self.interval)
        return self.moving & (np.abs(self.mass * mean) <= DYNAMICS.inertia * self.load)

    @property
    def kept(self) -> np.ndarray:
        """Places that remain: both ends, for what remembers the way, and one in half a window between them."""
        apart = max(self.window // 2, 1)
        return np.union1d(np.arange(0, len(self.run), apart), [len(self.run) - 1])


def _motion(run: Run, recording: Recording, experiment: Experiment) -> Motion | str:
    """A run smoothed over the longest window that blurs nothing, or why it cannot be read as force."""
    if run.set_pressure is not None and np.array_equal(run.pressure, run.set_pressure):
        return "the pressure in the muscle was not recorded, only the valve's set-point"
    run = _let_go(run) if recording.test == "quick release" else run
    if run.load is None or len(run) < DYNAMICS.shortest:
        return "too few samples"
    load = float(np.median(run.load))
    mass = load / g + float(experiment.muscle.moving_mass)
    if mass <= 0 or np.ptp(run.load) > 0.01 * load:
        return "the moving mass is not known: no load hangs on it, or one that changes"
    motion = Motion(run, float(np.median(np.diff(run.time))), DYNAMICS.shortest, noise_of(recording), mass, load)
    motion = _smoothed(motion)
    count = int(np.count_nonzero(motion.usable[motion.kept]))
    if count < DYNAMICS.fewest:
        slow = showing.show(DYNAMICS.slow, "m/s", digits=2)
        return (
            f"fewer than {DYNAMICS.fewest} readings in even motion ({count}): faster than {slow} one way, "
            f"accelerated by less than {DYNAMICS.inertia:.0%} of the load; "
            "record it for longer, or under a heavier load"
        )
    if motion.noise > DYNAMICS.loud * load:
        loud, whole = showing.show(motion.noise, "N", digits=2), showing.show(load, "N", digits=3)
        return f"M x'' is too noisy, {loud} of {whole}: read the position more finely or more often"
    return motion


def _let_go(run: Run) -> Run:
    """What follows t = 0."""
    return run.at(run.time >= 0)


def _smoothed(motion: Motion) -> Motion:
    """Over the longest window, up to `LONGEST`, whose accelerations differ from a shorter one's by noise alone."""
    wanted = float(DYNAMICS.shortest)
    while (wanted := wanted * DYNAMICS.longer) * motion.interval <= DYNAMICS.longest and wanted < len(motion.run):
        if motion.noise < DYNAMICS.quiet * motion.load:
            break
        longer = replace(motion, window=int(wanted) | 1)
        if longer.window > motion.window and not _as_good(longer, motion):
            break
        motion = longer
    return motion


def _as_good(longer: Motion, shorter: Motion) -> bool:
    """Whether the longer window blurs nothing, and leaves enough."""
    count = np.count_nonzero(longer.usable[longer.kept])
    if count < (DYNAMICS.fewest if shorter.noise > DYNAMICS.loud * shorter.load else DYNAMICS.plenty):
        return False
    differ = (longer.acceleration - shorter.acceleration)[longer.moving]
    pad = (longer.window - shorter.window) // 2
    noise = longer.error * np.linalg.norm(longer.filter - np.pad(shorter.filter, pad))
    independent = np.count_nonzero(longer.moving[longer.kept])
    return bool(np.mean(differ**2) < (1 + DYNAMICS.blurred * np.sqrt(2 / independent)) * noise**2)


# ----------------------------------------------------------------------------------------------------- as recordings


def _alike(motions: Sequence[Motion]) -> list[list[Motion]]:
    """Motions, in the order of their noise, in groups of about one noise."""
    groups: list[list[Motion]] = []
    for motion in motions:
        if groups and motion.noise <= DYNAMICS.alike * groups[-1][0].noise:
            groups[-1].append(motion)
        else:
            groups.append([motion])
    return groups


def _recording(recording: Recording, motions: Sequence[Motion], length: float, first: bool) -> Recording:
    """A loop recording of these motions; what was noted of the readings is said once."""
    noise = float(np.sqrt(np.mean([motion.noise**2 for motion in motions])))
    runs = tuple(_run(motion, length) for motion in motions)
    notes = recording.notes if first else ()
    return replace(recording, test="loop", runs=runs, noise=noise, notes=notes, noise_source=NoiseSource.MOTION)


def _run(motion: Motion, length: float) -> Run:
    """The run as a loop: branches between reversals, thinned to readings that hardly share their window."""
    way = np.sign(motion.speed)
    usable = motion.usable
    thin = motion.run.at(motion.kept)
    half = np.concatenate([[0], np.cumsum(np.diff(_filled(way * motion.moving)) != 0)])[motion.kept]
    usable = usable[motion.kept]
    return replace(
        thin,
        contraction=motion.position[motion.kept] / length,
        rate=motion.speed[motion.kept] / length,
        measured=motion.force[motion.kept],
        weight=usable.astype(float),
        branch=(way[motion.kept] * usable).astype(int),
        loop=half // 2,
        half=half,
        load=None,
        set_pressure=None,
    )


def _filled(way: np.ndarray) -> np.ndarray:
    """The direction where it is known (+1, -1), carried on over where it is not (0)."""
    known = np.flatnonzero(way)
    return way[known[np.clip(np.searchsorted(known, np.arange(len(way)), "right") - 1, 0, None)]]
