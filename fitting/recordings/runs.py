"""From the readings of one experiment to a `Run`: branches, speeds and weights, for each kind of test."""

from dataclasses import replace

import numpy as np

from fitting.recordings import motion_signals as signals
from fitting.recordings import weightless
from fitting.recordings.inputs import UNKNOWN, InputErrors, as_felt, smoothed
from fitting.recordings.records import Run
from fitting.recordings.settings import CYCLES
from fitting.recordings.smoother import Estimate


def run_of(readings: Run, test: str, errors: InputErrors = UNKNOWN) -> Run:
    """A run as read, with what this kind of test tells of it: estimates, rates, branches, weights.

    `errors` is what is known of those of pressure and contraction.
    """
    kinds = {
        "loop": _loop, "isometric": _isometric, "static": _static, "isotonic": _isotonic,
        "quick release": _release, "step": _transient,
    }  # fmt: skip
    return kinds[test](readings, errors)


def _loop(r: Run, errors: InputErrors) -> Run:
    """Length is imposed: branches go by the length, and a sample whose direction is unknown carries no weight."""
    branches = _by_length(r, rests=True)
    behind = smoothed(r.time, r.contraction, branches.edges[1:-1], errors.contraction)
    speed = _speed(r, behind, branches)
    place = as_felt(r.time, r.contraction, behind, errors.contraction)
    pressure, pressure_rate = _pressure(r, branches.edges, errors)
    run = _without_edges(r, branches)
    late = weightless.late_jumps(r.measured, branches.edges, signals.noise_level(r.time, r.measured))
    run = run.leave_out(late, "where the reading jumps late after a turning point")
    run = run.leave_out(weightless.clipped_samples(r.measured, r.contraction), "reading saturated or muscle slack")
    run = run.leave_out(speed == 0, "direction of motion unknown (speed below twice its error)")
    contraction = signals.monotone(place.level, branches)
    branch = np.where(speed != 0, branches.sign, 0)
    # a sample without weight counts in what lags behind it, and friction has the direction of its branch there, too
    rate = np.where(speed != 0, speed, CYCLES.at_rest * branches.sign)
    read = _reading(r.contraction, place)
    run = replace(run, contraction=contraction, contraction_variance=place.variance, rate=rate, branch=branch,
                  contraction_reading=read)  # fmt: skip
    return _with(run, branches, pressure, pressure_rate)


def _isometric(r: Run, errors: InputErrors) -> Run:
    """Length is held: branches go by the pressure, and the muscle does not move."""
    branches = _by_pressure(r)
    pressure, pressure_rate = _pressure(r, branches.edges, errors)
    run = _without_edges(r, branches)
    run = run.leave_out(weightless.clipped_samples(r.measured, r.pressure), "reading saturated or muscle slack")
    held = np.full_like(r.contraction, _held(r.contraction[r.usable] if r.usable.any() else r.contraction))
    return _with(replace(run, contraction=held, branch=branches.sign), branches, pressure, pressure_rate)


def _held(contraction: np.ndarray) -> float:
    """The contraction at which a muscle was held; exactly 0 where it cannot be told from the length at rest.

    What goes with the contraction (a fitting that gives way) would else move the braid by nanometres this way or that,
    as the reading's error has it, and dry friction follows the sign of any motion.
    """
    held = float(np.median(contraction))
    scatter = 1.4826 * float(np.median(np.abs(contraction - held)))
    return 0.0 if abs(held) <= max(scatter, CYCLES.at_zero) else held


def _static(r: Run, errors: InputErrors) -> Run:
    """Points without history: each is its own unit, and at most the direction of its approach is known."""
    count = np.arange(len(r.time))
    return replace(r, rate=CYCLES.at_rest * r.branch, loop=count, half=count, pressure_variance=np.zeros(len(count)))


def _isotonic(r: Run, errors: InputErrors) -> Run:
    """Pressure is swept under a hung load: branches go by the pressure, which turns nowhere else.

    A jitter of the reading would work the muscle past its friction, which the true pressure does not.
    """
    branches = _by_pressure(r)
    pressure, pressure_rate = _pressure(r, branches.edges, errors)
    pressure = replace(pressure, level=signals.monotone(pressure.level, branches))
    speed = _speed(r, smoothed(r.time, r.contraction, branches.edges[1:-1], errors.contraction), branches)
    run = replace(_without_edges(r, branches), rate=speed, branch=branches.sign)
    return _with(run, branches, pressure, pressure_rate)


def _release(r: Run, errors: InputErrors) -> Run:
    """A muscle let go at t = 0: what happens before then carries no weight."""
    return _transient(r, errors).leave_out(r.time < 0, "before t = 0")


def _transient(r: Run, errors: InputErrors) -> Run:
    """A motion that follows its own time: every sample counts."""
    branches = _by_length(r)
    start = int(np.searchsorted(r.time, 0.0))
    edges = np.unique(np.concatenate([branches.edges, [min(start, len(r.time) - 1)]]))
    speed = _rate(r.time, r.contraction, smoothed(r.time, r.contraction, edges[1:-1], errors.contraction), edges)
    pressure, pressure_rate = _pressure(r, edges, errors)
    run = replace(r, rate=speed, branch=np.sign(speed).astype(int))
    return _with(run, branches, pressure, pressure_rate)


def _by_length(r: Run, rests: bool = False) -> signals.Branches:
    """Branches as stated, else by the turning points of the length; with `rests`, one at the end belongs to the way
    there: friction keeps its direction until the muscle moves again.
    """
    if r.branch.any():
        return signals.branches_from_labels(r.branch)
    return signals.branches_of(
        r.contraction, signals.turning_threshold(r.time, r.contraction, CYCLES.smallest_loop), rests
    )


def _by_pressure(r: Run) -> signals.Branches:
    """Branches as stated, else by the turning points of the pressure; a held pressure belongs to the way there."""
    if r.branch.any():
        return signals.branches_from_labels(r.branch)
    return signals.branches_of(
        r.pressure, signals.turning_threshold(r.time, r.pressure, CYCLES.smallest_cycle), rests=True
    )


def _speed(r: Run, behind: Estimate, branches: signals.Branches) -> np.ndarray:
    """Rate of the signal `behind` the contraction, 0 where its sign is unknown or against the branch."""
    speed = _rate(r.time, r.contraction, behind, branches.edges)
    return np.where(speed * branches.sign < 0, 0.0, speed)


def _rate(time: np.ndarray, reading: np.ndarray, behind: Estimate, edges: np.ndarray) -> np.ndarray:
    """Time derivative of the signal `behind` a reading, 0 where its sign is unknown.

    Local polynomials scatter from sample to sample: a law of speed, whitened for slow noise, would see that and not the
    effect. An exact reading is its own signal: then they are cut at the `edges`, where it turns between samples.
    """
    if behind.slope is None or behind.slope_variance is None:
        return signals.rate(time, reading, edges, signals.noise_level(time, reading))[0]
    return signals.without_doubt(time, behind.slope, np.sqrt(behind.slope_variance), behind.error)


def _pressure(r: Run, edges: np.ndarray, errors: InputErrors) -> tuple[Estimate, np.ndarray]:
    """Pressure and its rate, which is zero where the pressure is constant within its error.

    A set-point that stands in for the pressure is no reading and has no error.
    """
    commanded = r.set_pressure is not None and np.array_equal(r.pressure, r.set_pressure)
    turns = signals.turning_points(r.pressure, signals.turning_threshold(r.time, r.pressure, CYCLES.smallest_cycle))
    if commanded:
        behind = pressure = Estimate.as_read(r.pressure, signals.noise_level(r.time, r.pressure))
    else:  # one smoother gives both: a lag of the supply could else explain the error of one by that of the other
        behind = smoothed(r.time, r.pressure, turns, errors.pressure)
        pressure = as_felt(r.time, r.pressure, behind, errors.pressure)
    if pressure.constant:
        return pressure, np.zeros(len(r.time))
    return pressure, _rate(r.time, r.pressure, behind, edges)


def _without_edges(r: Run, branches: signals.Branches) -> Run:
    near = weightless.near_edges(branches.edges, len(r.time))
    return r.leave_out(near, "next to a turning point or an end of a run")


def _with(r: Run, branches: signals.Branches, pressure: Estimate, pressure_rate: np.ndarray) -> Run:
    """The run with its branches numbered and its pressure estimated."""
    return replace(
        r,
        pressure=pressure.level,
        pressure_variance=pressure.variance,
        pressure_reading=_reading(r.pressure, pressure),
        pressure_rate=pressure_rate,
        loop=branches.loop,
        half=branches.half,
    )


def _reading(reading: np.ndarray, behind: Estimate) -> np.ndarray | None:
    """The reading, where the signal behind it was estimated; else None."""
    return None if np.array_equal(behind.level, reading) else reading
