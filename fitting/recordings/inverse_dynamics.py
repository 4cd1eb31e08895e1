"""Releases and steps read as recordings of force: along a recorded motion the muscle pulls the load and M x''.

The position is smoothed by local polynomials (Savitzky & Golay 1964); no equation of motion is integrated. The second
derivative of a parabola through a window is a mean of the accelerations in it (`averages`), so a reading is the mean
force over a window as long as the motion allows. At a standstill, a stop or a reversal dry friction is any force up to
its size: no window with such samples counts in any model, so neither a break-away nor a standstill is seen.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.constants import g
from scipy.ndimage import maximum_filter1d, minimum_filter1d
from scipy.signal import savgol_coeffs, savgol_filter

from fitting import showing
from fitting.recordings.averages import of_an_instant, weights_of_mean
from fitting.recordings.hung_load import hung_as_force
from fitting.recordings.noise import noise_of
from fitting.recordings.noted import Noted, said_of
from fitting.recordings.records import FORCE_TESTS, MOVING_TESTS, Experiment, NoiseSource, Recording, Run
from fitting.recordings.settings import DYNAMICS

NODES = 4  # states of the muscle in half a window, of which its mean force is made
APART = 2  # nodes from one reading to the next
PARABOLA = 2  # order of the polynomials whose second derivative is a mean of accelerations
ASIDE = "joins the fit and the comparison, but is not looked at here"


def as_force(experiment: Experiment) -> tuple[Experiment, tuple[str, ...]]:
    """The data set in newtons: recordings of force as they are, motions and hung loads as loops; and what is said.

    A motion becomes one recording for each kind of noise, for a force errs by mass x gain of the filter x noise of the
    position. The data set has no recordings where none is of use.
    """
    recordings, noted = [], list[Noted]()
    for recording in experiment.recordings:
        if recording.test in FORCE_TESTS:
            recordings.append(recording)
        elif recording.test in MOVING_TESTS:
            loops, said = _loops(recording, experiment)
            recordings += loops
            noted += [(recording.file, each) for each in said]
        else:
            hung, said = hung_as_force(recording, experiment)
            recordings += [] if hung is None else [hung]
            noted += [(recording.file, f"the {recording.test} test {each}") for each in said]
    files = list(dict.fromkeys(recording.file for recording in experiment.recordings))
    return replace(experiment, recordings=tuple(recordings)), tuple(said_of(noted, files))


def is_read_as_force(recording: Recording) -> bool:
    """Whether a recording of a data set in newtons was one of positions."""
    return recording.hangs or recording.noise_source is NoiseSource.MOTION


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
        return [], [f"the {recording.test} test {ASIDE}: {'; '.join(refused)}"]
    said = "read as force through the moving mass (a break-away or standstill is not seen in it)"
    notes = [said, *(_left_out(why, runs) for why, runs in refused.items())]
    parts = _alike(sorted(read, key=lambda motion: motion.noise))
    length = float(experiment.muscle.length)
    return [_recording(recording, part, length, first=part is parts[0]) for part in parts], notes


def _left_out(why: str, runs: Sequence[str]) -> str:
    return f"not read as force, {'run' if len(runs) == 1 else 'runs'} {', '.join(runs)}: {why}"


# -------------------------------------------------------------------------------------------------------- one motion


@dataclass(frozen=True)
class Motion:
    """One run whose position is smoothed, and averaged over windows; arrays over its samples, SI.

    Where the muscle is and how fast it moves, polynomials tell over a short `window`, which blurs nothing. What it
    pulls is the mean over a longer window: `NODES` times `spacing` samples to either side.
    """

    run: Run
    interval: float  # s
    window: int  # samples of a polynomial, odd
    spacing: int  # samples from one state of the muscle that enters a mean to the next
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
        """m/s2, as the polynomials have it."""
        return self._derivative(2)

    def _derivative(self, order: int) -> np.ndarray:
        return savgol_filter(
            self.run.measured, self.window, DYNAMICS.order, deriv=order, delta=self.interval, mode="interp"
        )

    @property
    def filter(self) -> np.ndarray:
        """Weights of the positions of one polynomial in its acceleration, 1/s2."""
        return savgol_coeffs(self.window, DYNAMICS.order, deriv=2, delta=self.interval)

    @property
    def half(self) -> int:
        """Samples to either side of which a force is the mean."""
        return NODES * self.spacing

    @property
    def force(self) -> np.ndarray:
        """What the muscle pulls on average over the window around each sample, N."""
        whole = 2 * self.half + 1
        mean = savgol_filter(self.run.measured, whole, PARABOLA, deriv=2, delta=self.interval, mode="interp")
        return self.load + self.mass * mean

    @property
    def noise(self) -> float:
        """Standard deviation of one force, N."""
        weights = savgol_coeffs(2 * self.half + 1, PARABOLA, deriv=2, delta=self.interval)
        return self.mass * self.error * float(np.linalg.norm(weights))

    @cached_property
    def moving(self) -> np.ndarray:
        """Samples whose windows are whole and hold motion in one direction at a pressure that changes slowly.

        Both windows: of a polynomial that reaches into a standstill the speed would be wrong.
        """
        whole = max(2 * self.half + 1, self.window)
        least = lambda values, over=whole: minimum_filter1d(values, over)  # noqa: E731
        most = lambda values, over=whole: maximum_filter1d(values, over)  # noqa: E731
        blur = 3 * self.error * np.linalg.norm(savgol_coeffs(self.window, DYNAMICS.order, deriv=1, delta=self.interval))
        slow = max(DYNAMICS.slow, float(blur))
        one_way = (least(self.speed) > slow) | (most(self.speed) < -slow)
        pressure, few = self.run.pressure, self.window
        steady = most(pressure, few) - least(pressure, few) < DYNAMICS.steady * float(np.abs(pressure).max())
        steady = least(steady * 1.0) > 0
        complete = least(self._even * (self.run.weight > 0)) > 0
        inside = np.zeros(len(self.run), bool)
        inside[whole // 2 : len(self.run) - whole // 2] = True
        return one_way & steady & complete & inside

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
        padded = np.pad(self.speed, self.half, mode="edge")
        mean = (padded[2 * self.half :] - padded[: len(self.speed)]) / (2 * self.half * self.interval)
        return self.moving & (np.abs(self.mass * mean) <= DYNAMICS.inertia * self.load)

    @property
    def nodes(self) -> np.ndarray:
        """Every so many samples a state of the muscle that may enter a mean: their places."""
        return np.arange(0, len(self.run), self.spacing)

    @property
    def apart(self) -> np.ndarray:
        """Which nodes are the middle of a reading, a mask.

        The first of a stretch of usable nodes is one, and every second after it, a quarter of a window apart. The noise
        of neighbours has a correlation of -0.09, of the next but one -0.44: they are taken to err each for itself, and
        what changes slowly is told from more noise than there is.
        """
        usable = self.usable[self.nodes]
        place = np.arange(len(usable))
        begins = usable & ~np.append(False, usable[:-1])
        begin = np.maximum.accumulate(np.where(begins, place, 0))
        return usable & ((place - begin) % APART == 0)

    @property
    def kept(self) -> np.ndarray:
        """Which nodes remain, a mask: those of the readings, and few between them for what remembers the way."""
        of_readings = maximum_filter1d(self.apart, 2 * NODES - 1)
        return of_readings | (np.arange(len(of_readings)) % NODES == 0)

    @property
    def readings(self) -> int:
        """How many."""
        return int(np.count_nonzero(self.apart))


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
    interval = float(np.median(np.diff(run.time)))
    motion = _averaged(_smoothed(Motion(run, interval, DYNAMICS.shortest, 1, noise_of(recording), mass, load)))
    if motion.readings < DYNAMICS.fewest:
        slow = showing.show(DYNAMICS.slow, "m/s", digits=2)
        return (
            f"fewer than {DYNAMICS.fewest} readings in even motion ({motion.readings}): faster than {slow} one way, "
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
    """With polynomials over the longest window that blurs nothing."""
    wanted = float(DYNAMICS.shortest)
    while (wanted := wanted * DYNAMICS.longer) * motion.interval <= DYNAMICS.longest and wanted < len(motion.run):
        longer = replace(motion, window=int(wanted) | 1)
        if longer.window > motion.window and _blurs(longer, motion):
            break
        motion = longer
    return motion


def _blurs(longer: Motion, shorter: Motion) -> bool:
    """Whether a longer window changes accelerations by more than their noise."""
    moving = longer.moving
    if not moving.any():
        return False
    pad = (longer.window - shorter.window) // 2
    noise = longer.error * np.linalg.norm(longer.filter - np.pad(shorter.filter, pad))
    independent = np.count_nonzero(moving) / (longer.window // 2)
    differ = np.mean((longer.acceleration - shorter.acceleration)[moving] ** 2)
    return bool(differ >= (1 + DYNAMICS.blurred * np.sqrt(2 / max(independent, 1))) * noise**2)


def _averaged(motion: Motion) -> Motion:
    """With means over the longest window that leaves enough readings, or is quiet enough.

    Where a reading would be too loud to be used, fewer of them are enough.
    """
    best = _over(motion, 1)
    while best.noise >= DYNAMICS.quiet * best.load:
        longer = _over(motion, best.spacing + 1)
        enough = DYNAMICS.fewest if best.noise > DYNAMICS.loud * best.load else DYNAMICS.plenty
        if 2 * longer.half * longer.interval > DYNAMICS.longest or longer.readings < enough:
            break
        best = longer
    return best


def _over(motion: Motion, spacing: int) -> Motion:
    """With means over windows of this spacing, and polynomials that reach no further than these."""
    return replace(motion, spacing=spacing, window=min(motion.window, 2 * NODES * spacing + 1))


# ----------------------------------------------------------------------------------------------------- as recordings


def _alike(motions: Sequence[Motion]) -> list[list[Motion]]:
    """Motions, in the order of their noise, in groups within which it differs by a few times at most."""
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
    """The run as a loop: branches between reversals, thinned to the nodes of its means."""
    way = np.sign(motion.speed)
    places, apart = motion.nodes[motion.kept], motion.apart[motion.kept]
    thin = motion.run.at(places)
    half = np.concatenate([[0], np.cumsum(np.diff(_filled(way * motion.moving)) != 0)])[places]
    averaging = of_an_instant(len(thin), NODES - 1)
    averaging[apart] = weights_of_mean(motion.half, motion.spacing, NODES - 1)
    return replace(
        thin,
        contraction=motion.position[places] / length,
        rate=motion.speed[places] / length,
        measured=motion.force[places],
        weight=apart.astype(float),
        branch=(way[places] * apart).astype(int),
        loop=half // 2,
        half=half,
        averaging=averaging,
        load=None,
        set_pressure=None,
    )


def _filled(way: np.ndarray) -> np.ndarray:
    """The direction where it is known (+1, -1), carried on over where it is not (0)."""
    known = np.flatnonzero(way)
    return way[known[np.clip(np.searchsorted(known, np.arange(len(way)), "right") - 1, 0, None)]]
