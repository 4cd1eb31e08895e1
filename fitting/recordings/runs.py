"""From the readings of one experiment to a `Run`: branches, speeds and weights, for each kind of test."""

from collections import Counter
from dataclasses import dataclass, field, replace

import numpy as np

from fitting.recordings import motion_signals as signals
from fitting.recordings import weightless
from fitting.recordings.inputs import Negligible, estimated
from fitting.recordings.records import Run
from fitting.recordings.smoother import Estimate

AT_REST = 1e-9  # 1/s: a static point approached infinitely slowly; only the sign counts
AT_ZERO = 1e-5  # contraction: a few micrometres, nearer to the length at rest than anybody sets it
SMALLEST_LOOP = 0.01  # share of the stroke that a minor loop must have to be one
SMALLEST_CYCLE = 0.08  # the same of the pressure: a port's pressure springs back when its valve closes


@dataclass
class Readings:
    """One experiment as read, SI, complete: gaps are bridged and marked in `usable`."""

    name: str
    time: np.ndarray
    pressure: np.ndarray
    contraction: np.ndarray
    measured: np.ndarray
    row: np.ndarray
    usable: np.ndarray  # False where a reading is missing or outside `valid`
    direction: np.ndarray | None = None  # +1, -1 as the `branch` column states it
    load: np.ndarray | None = None
    set_pressure: np.ndarray | None = None
    counts: Counter[str] = field(default_factory=Counter)  # samples without weight, by reason
    negligible: Negligible = field(default_factory=Negligible)  # errors of pressure and contraction that no law feels

    def leave_out(self, weight: np.ndarray, which: np.ndarray, reason: str) -> np.ndarray:
        """Weights with these samples at 0, the newly lost ones counted under `reason`."""
        self.counts[reason] += int(np.count_nonzero(which & (weight > 0)))
        return np.where(which, 0.0, weight)


def run_of(readings: Readings, test: str) -> Run:
    """The run of this kind of test."""
    kinds = {
        "loop": _loop, "isometric": _isometric, "static": _static, "isotonic": _isotonic,
        "quick release": _release, "step": _transient,
    }  # fmt: skip
    return kinds[test](readings)


def _loop(r: Readings) -> Run:
    """Length is imposed: branches go by the length, and a sample whose direction is unknown carries no weight."""
    branches = _by_length(r, rests=True)
    speed = _speed(r, r.contraction, branches)
    pressure, pressure_rate = _pressure(r, branches.edges)
    place = estimated(r.time, r.contraction, branches.edges[1:-1], r.negligible.contraction)
    weight = _weight_away_from_edges(r, branches)
    late = weightless.late_jumps(r.measured, branches.edges, signals.noise_level(r.time, r.measured))
    weight = r.leave_out(weight, late, "where the reading jumps late after a turning point")
    weight = r.leave_out(weight, weightless.clipped(r.measured, r.contraction), "reading saturated or muscle slack")
    weight = r.leave_out(weight, speed == 0, "direction of motion unknown (speed below twice its error)")
    contraction = signals.monotone(place.level, branches)
    branch = np.where(speed != 0, branches.sign, 0)
    run = _run(r, branches, pressure, pressure_rate, contraction, speed, weight, branch)
    return replace(run, contraction_variance=place.variance)


def _isometric(r: Readings) -> Run:
    """Length is held: branches go by the pressure, and the muscle does not move."""
    branches = _by_pressure(r)
    pressure, pressure_rate = _pressure(r, branches.edges)
    weight = _weight_away_from_edges(r, branches)
    weight = r.leave_out(weight, weightless.clipped(r.measured, r.pressure), "reading saturated or muscle slack")
    held = np.full_like(r.contraction, _held(r.contraction[r.usable] if r.usable.any() else r.contraction))
    return _run(r, branches, pressure, pressure_rate, held, np.zeros_like(held), weight, branches.sign)


def _held(contraction: np.ndarray) -> float:
    """The contraction at which a muscle was held; exactly 0 where it cannot be told from the length at rest.

    What goes with the contraction (a fitting that gives way) would else move the braid by nanometres this way or that,
    as the reading's error has it, and dry friction follows the sign of any motion.
    """
    held = float(np.median(contraction))
    scatter = 1.4826 * float(np.median(np.abs(contraction - held)))
    return 0.0 if abs(held) <= max(scatter, AT_ZERO) else held


def _static(r: Readings) -> Run:
    """Points without history: each is its own unit, and at most the direction of its approach is known."""
    count = np.arange(len(r.time))
    sign = np.zeros(len(r.time), dtype=int) if r.direction is None else r.direction
    branches = signals.Branches(count, count, count, sign)
    pressure = Estimate.as_read(r.pressure, 0.0)
    run = _run(r, branches, pressure, np.zeros(len(count)), r.contraction, AT_REST * sign, r.usable * 1.0, sign)
    return replace(run, loop=count)


def _isotonic(r: Readings) -> Run:
    """Pressure is swept under a hung load: branches go by the pressure, which turns nowhere else.

    A jitter of the reading would work the muscle past its friction, which the true pressure does not.
    """
    branches = _by_pressure(r)
    pressure, pressure_rate = _pressure(r, branches.edges)
    pressure = replace(pressure, level=signals.monotone(pressure.level, branches))
    speed = _speed(r, r.contraction, branches)
    weight = _weight_away_from_edges(r, branches)
    return _run(r, branches, pressure, pressure_rate, r.contraction, speed, weight, branches.sign)


def _release(r: Readings) -> Run:
    """A muscle let go at t = 0: what happens before then carries no weight."""
    run = _transient(r)
    return replace(run, weight=r.leave_out(run.weight, r.time < 0, "before t = 0"))


def _transient(r: Readings) -> Run:
    """A motion that follows its own time: every sample counts."""
    branches = _by_length(r)
    start = int(np.searchsorted(r.time, 0.0))
    edges = np.unique(np.concatenate([branches.edges, [min(start, len(r.time) - 1)]]))
    speed, _ = signals.rate(r.time, r.contraction, edges, signals.noise_level(r.time, r.contraction))
    pressure, pressure_rate = _pressure(r, edges)
    direction = np.sign(speed).astype(int)
    return _run(r, branches, pressure, pressure_rate, r.contraction, speed, r.usable * 1.0, direction)


def _by_length(r: Readings, rests: bool = False) -> signals.Branches:
    """Branches as stated, else by the turning points of the length; with `rests`, one at the end belongs to the way
    there: friction keeps its direction until the muscle moves again.
    """
    if r.direction is not None:
        return signals.branches_from_labels(r.direction)
    return signals.branches_of(r.contraction, signals.turning_threshold(r.time, r.contraction, SMALLEST_LOOP), rests)


def _by_pressure(r: Readings) -> signals.Branches:
    """Branches as stated, else by the turning points of the pressure; a held pressure belongs to the way there."""
    if r.direction is not None:
        return signals.branches_from_labels(r.direction)
    return signals.branches_of(r.pressure, signals.turning_threshold(r.time, r.pressure, SMALLEST_CYCLE), rests=True)


def _speed(r: Readings, signal: np.ndarray, branches: signals.Branches) -> np.ndarray:
    """Rate of the signal, 0 where its sign is unknown or against the branch."""
    speed, _ = signals.rate(r.time, signal, branches.edges, signals.noise_level(r.time, signal))
    return np.where(speed * branches.sign < 0, 0.0, speed)


def _pressure(r: Readings, edges: np.ndarray) -> tuple[Estimate, np.ndarray]:
    """Pressure and its rate, which is zero where the pressure is constant within its error.

    A set-point that stands in for the pressure is no reading and has no error.
    """
    commanded = r.set_pressure is not None and np.array_equal(r.pressure, r.set_pressure)
    turns = signals.turning_points(r.pressure, signals.turning_threshold(r.time, r.pressure, SMALLEST_CYCLE))
    pressure = estimated(r.time, r.pressure, turns, np.inf if commanded else r.negligible.pressure)
    if pressure.constant:
        return pressure, np.zeros(len(r.time))
    rate, _ = signals.rate(r.time, r.pressure, edges, signals.noise_level(r.time, r.pressure))
    return pressure, rate


def _weight_away_from_edges(r: Readings, branches: signals.Branches) -> np.ndarray:
    near = weightless.near_edges(branches.edges, len(r.time))
    return r.leave_out(r.usable * 1.0, near, "next to a turning point or an end of a run")


def _run(
    r: Readings,
    branches: signals.Branches,
    pressure: Estimate,
    pressure_rate: np.ndarray,
    contraction: np.ndarray,
    rate: np.ndarray,
    weight: np.ndarray,
    branch: np.ndarray,
) -> Run:
    return Run(
        r.name,
        r.time,
        pressure.level,
        contraction,
        rate,
        pressure_rate,
        r.measured,
        weight,
        branch,
        branches.loop,
        branches.half,
        r.row,
        r.load,
        r.set_pressure,
        pressure.variance,
    )
