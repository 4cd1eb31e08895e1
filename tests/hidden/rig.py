"""The test rig: protocols that impose length, pressure or load, and how the force's readings err."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.signal import lfilter

from .felt import BEFORE, felt, pull, through, yielded
from .instruments import EXACT, Instruments, RunErrors, Session
from .lost import direction, lost, size
from .physics import Muscle, State, Truth

OVERSAMPLE = 16
DWELL = 10.0  # s from one point of a static map to the next


@dataclass(frozen=True)
class Noise:
    """How the readings err. `sd` is the standard deviation of one reading of what is measured.

    `phi`: of an AR(1) sequence (0 is white). `drift`: sd of a slow AR(0.99) wander on top, in units of sd.
    `zero`: sd of what every run reads too much from its first to its last reading, in units of sd.
    `grows`: "pressure" (sd ~ P^1.5), "force" (sd ~ |F|) or None; scaled so that the rms stays sd.
    `step`: resolution of the reading. `spread`: relative scatter of every effect's parameters from run to run.
    `position`, `pressure`: white noise of these readings (m, Pa).
    """

    sd: float = 0.6
    phi: float = 0.0
    drift: float = 0.0
    zero: float = 0.0
    grows: str | None = None
    step: float = 0.0
    spread: float = 0.0
    position: float = 0.0
    pressure: float = 0.0


NOISES = {
    "white": Noise(),
    "ar": Noise(phi=0.9),
    "drift": Noise(drift=1.0),
    "pressure": Noise(phi=0.7, grows="pressure"),
    "force": Noise(phi=0.7, grows="force"),
    "quantised": Noise(sd=0.3, step=1.0),
    "spread": Noise(phi=0.7, spread=0.02),
}
UNSTEADY = {"stepping zero": Noise(drift=1.5, zero=1.0)}  # of recordings in which that looks like an effect
EVERY_NOISE = {**NOISES, **UNSTEADY}


@dataclass(frozen=True)
class Recording:
    """One CSV: SI columns (a dict of arrays), what was measured and what it would be without noise."""

    file: str
    test: str
    columns: dict
    measured: str
    clean: np.ndarray
    noise_sd: float | None = None
    instruments: Instruments = EXACT


@dataclass(frozen=True)
class Dataset:
    """What goes into a folder: the muscle as its owner states it, recordings, and the sealed truth."""

    name: str
    stated: dict[str, str]
    truth: Truth
    recordings: tuple[Recording, ...]
    noise: Noise = field(default_factory=Noise)
    seed: int = 0


def correlated(random, count: int, phi: float):
    """AR(1) of unit standard deviation, stationary from the first sample."""
    shocks = random.standard_normal(count) * np.sqrt(1 - phi**2)
    shocks[0] /= np.sqrt(1 - phi**2)
    return lfilter([1.0], [1.0, -phi], shocks)


def disturbed(random, clean, pressure, noise: Noise):
    """One run's readings."""
    shape = {"pressure": np.abs(pressure) ** 1.5, "force": np.abs(clean), None: np.ones(len(clean))}[noise.grows]
    # A typical rig sees 3 bar: the scale is the same for all runs, so that weak runs are quiet.
    typical = {"pressure": 3.3e5**1.5, "force": 350.0, None: 1.0}[noise.grows]
    error = correlated(random, len(clean), noise.phi) * shape / typical
    if noise.drift:
        error = error + noise.drift * correlated(random, len(clean), 0.99)
    if noise.zero:
        error = error + noise.zero * random.standard_normal()
    reading = clean + noise.sd * error
    return noise.step * np.round(reading / noise.step) if noise.step else reading


def scattered(random, truth: Truth, spread: float) -> Truth:
    """The same muscle on another day: every parameter a little different."""
    if not spread:
        return truth
    effects = {
        name: {key: apart(key, value, 1 + spread * random.standard_normal()) for key, value in given.items()}
        for name, given in truth.effects.items()
    }
    return replace(truth, effects=effects)


NEUTRAL = {"k": 1.0, "b_k": 1.0, "ratio": 1.0, "beta": 1.0}


def apart(key: str, value: float, factor: float) -> float:
    """A parameter whose distance from doing nothing is `factor` times as large."""
    return NEUTRAL.get(key, 0.0) + (value - NEUTRAL.get(key, 0.0)) * factor


CORNER = 1.0  # N


def borne(force, slack):
    """What a tube bears that bends aside: y of (y - slack) (y - force) = CORNER^2, above the load when slack."""
    middle = (force + slack) / 2
    return middle + np.hypot(middle - slack, CORNER)


def weighed(truth: Truth, force):
    """What the load cell makes of a force: where the muscle is slack, then gain, then offset."""
    if "slack" in truth.effects:
        force = borne(force, truth.effects["slack"]["F_s"])
    force = force * (1 + truth.effects.get("force_gain", {"g": 0.0})["g"])
    return force + truth.effects.get("force_offset", {"F_off": 0.0})["F_off"]


def read(truth: Truth, time, force):
    """What the force channel shows: gain, offset, delay (before the first sample the first value stands)."""
    force = weighed(truth, force)
    if "time_delay" in truth.effects:
        force = np.interp(time - truth.effects["time_delay"]["tau"], time, force)
    return force


def force_of(truth: Truth, time, contraction, pressure, session=0.0):
    """Reading of the load cell without noise, on the time grid given (which must be fine for memory)."""
    rate = np.gradient(contraction, time)
    seen = State(contraction, pressure, time + session, rate)
    state = felt(truth, seen)
    if "series_compliance" in truth.effects and not STICKS_ITSELF & set(truth.effects):
        dry = size(truth, state) * direction(truth, state)
        first = float(direction(truth, state)[0])
        return read(truth, time, borne_by_the_spring(truth, seen, first) - (lost(truth, state) - dry))
    return read(truth, time, pull(truth, state) - lost(truth, state))


STICKS_ITSELF = {"presliding", "maxwell_slip"}  # friction that gives way before it slides


def borne_by_the_spring(truth: Truth, seen: State, first: float):
    """What a spring in series carries, N: the braid stands behind it until friction of either direction is overcome.

    Before the `first` sample it slid in this direction.
    """
    contracting, free, elongating = (slid(truth, seen, sign) for sign in (1.0, 0.0, -1.0))
    force = [float({1.0: contracting, 0.0: free, -1.0: elongating}[first][0])]
    stretch = through(truth, seen, BEFORE).contraction * truth.effects["series_compliance"]["k_s"] * truth.muscle.length
    ends = (each.tolist() for each in (contracting[1:], elongating[1:], np.diff(stretch)))
    for least, most, moved in zip(*ends, strict=True):
        force.append(min(max(force[-1] - moved, least), most))  # of a braid that stands
    return np.array(force)


def slid(truth: Truth, seen: State, sign: float):
    """What the spring carries, N, while the braid slides in one direction (1, -1; 0: without friction)."""
    k_s = truth.effects["series_compliance"]["k_s"]
    shown, rate = through(truth, seen, BEFORE), felt(truth, seen).rate
    place = yielded(truth, shown, k_s, lambda there: sign * size(truth, replace(there, rate=rate)))
    return k_s * truth.muscle.length * (place.contraction - shown.contraction)


def polyline(turns, speed: float, count: int, rounding: float):
    """Time and value along straight lines through `turns` at a constant |slope|; corners rounded.

    `rounding` is the length of a turn as a share of the shortest stroke (constant acceleration there).
    """
    turns = np.asarray(turns, float)
    lengths = np.abs(np.diff(turns))
    corners = np.concatenate([[0.0], np.cumsum(lengths / speed)])
    fine = np.linspace(0.0, corners[-1], (count - 1) * OVERSAMPLE + 1)
    value = np.interp(fine, corners, turns)
    width = int(rounding * lengths.min() / speed / (fine[1] - fine[0])) // 2 * 2 + 1
    padded = np.pad(value, width // 2, mode="edge")
    return fine, np.convolve(padded, np.full(width, 1 / width), mode="valid")


def swing(turns, speed: float, count: int):
    """As `polyline`, but half cosines between the turns; `speed` is the mean one."""
    turns = np.asarray(turns, float)
    corners = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(turns)) / speed)])
    fine = np.linspace(0.0, corners[-1], (count - 1) * OVERSAMPLE + 1)
    piece = np.clip(np.searchsorted(corners, fine, side="right") - 1, 0, len(turns) - 2)
    share = (fine - corners[piece]) / np.diff(corners)[piece]
    return fine, turns[piece] + np.diff(turns)[piece] * (1 - np.cos(np.pi * share)) / 2


def gathered(runs, file: str, test: str, measured: str, noise_sd, instruments=EXACT) -> Recording:
    """Runs (dicts of arrays) one below the other."""
    columns = {key: np.concatenate([run[key] for run in runs]) for key in runs[0]}
    clean = columns.pop("clean")
    return Recording(file, test, columns, measured, clean, noise_sd, instruments)


@dataclass(frozen=True)
class History:
    """What really happens in one run of a force test, on the fine grid; `clock`: s since the session began."""

    time: np.ndarray
    pressure: np.ndarray
    contraction: np.ndarray
    force: np.ndarray
    clock: np.ndarray


def observed(random, run: int, real: History, muscle: Muscle, noise: Noise, errors: RunErrors):
    """One run of a force test: every OVERSAMPLE-th point, as the instruments read it."""
    pick = slice(None, None, OVERSAMPLE)
    time, clock, pressure = real.time[pick], real.clock[pick], real.pressure[pick]
    stroke, count = muscle.length * real.contraction[pick], len(time)
    force = np.interp(errors.moments(time), real.time, errors.shown("force", real.force, real.clock))
    gauge = errors.shown("pressure", pressure, clock) + noise.pressure * random.standard_normal(count)
    ruler = errors.shown("position", stroke, clock) + noise.position * random.standard_normal(count)
    return {
        "run": np.full(count, run),
        "time": time,
        "pressure": errors.read("pressure", gauge),
        "displacement": errors.read("position", ruler),
        "force": errors.read("force", disturbed(random, force, pressure, noise)),
        "clean": real.force[pick],
    }


def force_test(
    truth: Truth, imposed: Iterable[tuple], noise: Noise, instruments: Instruments, seed: int, file: str, test: str
) -> Recording:
    """Runs in which time, contraction and pressure are `imposed` (arrays on the fine grid) and the force is read."""
    random, session, runs, begun = np.random.default_rng(seed), Session(instruments, seed), [], 0.0
    for time, contraction, pressure in imposed:
        own, errors, clock = scattered(random, truth, noise.spread), session.next_run(), time + begun
        own = errors.warmed(own, clock)
        # Where a length is held the one written down is the one that was meant.
        true = contraction - errors.held_length / truth.muscle.length if test == "isometric" else contraction
        felt_pressure = errors.rippled(pressure, truth.muscle.length * true)
        real = History(time, pressure, contraction, force_of(own, time, true, felt_pressure, begun), clock)
        runs.append(observed(random, len(runs), real, truth.muscle, noise, errors))
        begun += time[-1]
    return gathered(runs, file, test, "force", noise.sd, instruments)


RICH = (1e5, 2e5, 3e5, 4e5, 5e5)
MAJOR_AND_MINOR = (0.0, 0.26, 0.08, 0.18, 0.0)
STATIONS = tuple(np.linspace(0, 0.24, 9))
USUAL = Noise()


def loops(
    truth: Truth, pressures=RICH, speeds=(0.005, 0.02), turns=MAJOR_AND_MINOR, samples=1000, rounding=0.02,
    sine=False, noise=USUAL, seed=0, file="loops.csv", instruments=EXACT,
) -> Recording:  # fmt: skip
    """Length imposed along `turns` (contractions) at each pressure (Pa) and speed (m/s); one run each."""

    def imposed() -> Iterator[tuple]:
        for speed in speeds:
            for level in pressures:
                rate = speed / truth.muscle.length
                time, contraction = swing(turns, rate, samples) if sine else polyline(turns, rate, samples, rounding)
                yield time, contraction, np.full_like(time, level)

    return force_test(truth, imposed(), noise, instruments, seed, file, "loop")


def isometric(
    truth: Truth, contractions=(0.0, 0.05, 0.1, 0.15), turns=(0.2e5, 5e5, 0.2e5, 5e5, 0.2e5), ramps=(0.5e5, 2e5),
    samples=800, noise=USUAL, seed=0, file="isometric.csv", instruments=EXACT,
) -> Recording:  # fmt: skip
    """Pressure cycled through `turns` (Pa) at each rate (Pa/s), the length held."""

    def imposed() -> Iterator[tuple]:
        for ramp in ramps:
            for held in contractions:
                time, pressure = polyline(turns, ramp, samples, 0.02)
                yield time, np.full_like(time, held), pressure

    return force_test(truth, imposed(), noise, instruments, seed, file, "isometric")


def static(
    truth: Truth, contractions=STATIONS, pressures=RICH, branches=("contraction", "elongation"),
    noise=USUAL, seed=0, file="static.csv", instruments=EXACT,
) -> Recording:  # fmt: skip
    """Points without history; friction is fully developed along `branches`, absent where that is None.

    For instruments the whole map is one run: a point every DWELL seconds, pressures in turn at every contraction.
    """
    random, errors, runs = np.random.default_rng(seed), Session(instruments, seed).next_run(), []
    for number, branch in enumerate(branches or (None,)):
        sign = {"contraction": 1.0, "elongation": -1.0, None: 0.0}[branch]
        contraction, pressure = (grid.ravel() for grid in np.meshgrid(contractions, pressures, indexing="ij"))
        clock = DWELL * (number * len(pressure) + np.arange(len(pressure)))
        own = errors.warmed(truth, clock)
        seen = State(contraction, pressure)
        state = felt(own, seen)
        force = pull(own, state) - sign * size(own, state)
        force = weighed(own, slid(own, seen, sign) if "series_compliance" in own.effects else force)
        shown = errors.shown("force", force, clock)
        columns = {
            "pressure": errors.read("pressure", errors.shown("pressure", pressure, clock)),
            "displacement": errors.read("position", errors.shown("position", truth.muscle.length * contraction, clock)),
            "force": errors.read("force", disturbed(random, shown, pressure, replace(noise, phi=0.0, drift=0.0))),
            "clean": force,
        }
        if branch:
            columns["branch"] = np.full(len(force), branch)
        runs.append(columns)
    return gathered(runs, file, "static", "force", noise.sd, instruments)
