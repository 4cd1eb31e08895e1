"""How small an effect an oracle detects: a measure of what a recording holds, whoever reads it.

The oracle knows the family of the effect, the covariance of the noise and the accuracies of the instruments; unknown
are the size of the effect, the baseline's own parameters (free) and what the instruments err by (normal priors, a few
columns for each run). It tests the generalised likelihood ratio, which follows a chi-squared law of one degree of
freedom, noncentral by the squared length of the whitened signature that is left beside baseline and instruments. The
signatures are differences of simulated forces. White noise of gauge and ruler is not charged: these histories are
smooth, and an oracle averages it out.

By default it keeps two rules that the program's users are told: readings next to turning points judge no model, and
dry friction may differ by 2 % from run to run. `NO_RULES` says what these rules cost.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy.linalg import cholesky, solve_triangular, toeplitz
from scipy.optimize import brentq
from scipy.stats import chi2, ncx2

from .instruments import EXACT, Instruments, drifted, slipped
from .physics import Truth
from .rig import DWELL, Noise, Recording
from .study.protocols import PROTOCOLS, WHOLE
from .study.sizes import NEEDS_RUBBER, QUIET, SMALLEST, base_of, hiding, misfit, most, scaled

LEVEL, POWER = 0.01, 0.8
NUDGE = 1e-3  # of what is differentiated: contraction, pressure over 1 bar, gains
BLIND = 1e3  # N: the noise of a reading that judges nothing
WIDER = 1.4  # step of the search for a bracket, of a size
FREE = (("coulomb_friction", "f_s"), ("bladder_neo_hookean", "G"))


class OracleSize(NamedTuple):
    """The size of an effect that the oracle detects with power 0.8."""

    factor: float  # times the typical size, as `scaled` takes it
    rms: float  # N: what is left of it once the baseline has been refitted, the unit of printed detection limits


@dataclass(frozen=True)
class Run:
    """Samples of one run, or of all points of a map, in one recording; arrays over these samples."""

    part: int  # which recording of the protocol
    at: slice  # of all samples
    whites: tuple[slice, ...]  # stretches whose noise is independent
    time: np.ndarray | None
    clock: np.ndarray  # s since the session began
    pressure: np.ndarray
    stroke: np.ndarray  # m
    held: bool


class Rules(NamedTuple):
    """What the oracle leaves out: readings next to `turning` points, friction within its `spread` from run to run."""

    turning: bool
    spread: float

    def blind(self, run: Run, at: slice) -> np.ndarray:
        """Variance (samples, samples; N^2) of a stretch of a run that hides the readings by which nothing is judged."""
        return BLIND**2 * np.diag(next_to_turning(run, at) * self.turning)


THE_PROGRAMS, NO_RULES = Rules(True, 0.02), Rules(False, 0.0)


@dataclass(frozen=True)
class Scene:
    """A protocol with what the oracle does not know, whitened: `basis` spans it, with rows for the priors below."""

    protocol: str
    base: Truth
    force: np.ndarray  # N, of the baseline
    whiteners: tuple[tuple[slice, np.ndarray], ...]  # lower Cholesky factors of the noise's covariance
    basis: np.ndarray
    priors: int

    def whitened(self, change: np.ndarray) -> np.ndarray:
        """A change of force (samples, ...) in units of independent noise."""
        out = np.empty_like(change)
        for at, lower in self.whiteners:
            out[at] = solve_triangular(lower, change[at], lower=True)
        return out

    def left(self, change: np.ndarray) -> np.ndarray:
        """What baseline and instruments leave of a change of force, whitened."""
        rows = np.concatenate([self.whitened(change), np.zeros(self.priors)])
        return rows - self.basis @ (self.basis.T @ rows)

    def evidence(self, change: np.ndarray) -> float:
        """The noncentrality that a change of force brings."""
        return float(np.sum(self.left(change) ** 2))


@cache
def needed(level: float = LEVEL, power: float = POWER) -> float:
    """Noncentrality at which chi-squared of one degree of freedom exceeds its level's bound with this power."""
    bound = chi2.isf(level, 1)
    return brentq(lambda evidence: ncx2.sf(bound, 1, evidence) - power, 1e-3, 1e3)  # pyright: ignore


def oracle_size(
    effect: str, protocol: str, noise: Noise, instruments: Instruments = EXACT, rules: Rules = THE_PROGRAMS
) -> OracleSize | None:
    """The size at which the oracle's power is 0.8 at a level of 1 %; None where no sensible size has it."""
    scene = scene_of(protocol, noise, instruments, effect in NEEDS_RUBBER, rules)
    highest = most(effect, {})

    def excess(log_size: float) -> float:
        truth = hiding(scene.base.effects, {effect: scaled(effect, float(np.exp(log_size)), {})})
        evidence = scene.evidence(forces(protocol, truth) - scene.force)
        return np.log(max(evidence, 1e-12) / needed())

    bracket = crossing(excess, np.log(SMALLEST), np.log(highest)) if highest else None
    if bracket is None:
        return None
    factor = float(np.exp(brentq(excess, *bracket, xtol=0.005)))  # pyright: ignore
    return OracleSize(factor, misfit(protocol, {effect: scaled(effect, factor, {})}, noise.sd))


def crossing(excess, lowest: float, highest: float) -> tuple[float, float] | None:
    """A short bracket of the root of a function that grows; None where it has none between these bounds."""
    step = np.log(WIDER)
    guess = float(np.clip(-0.5 * excess(min(-1.5, highest)) + min(-1.5, highest), lowest, highest))
    low = high = guess
    while excess(low) > 0:
        if low <= lowest:
            return None
        low, step = max(low - step, lowest), 2 * step
    step = np.log(WIDER)
    while excess(high) < 0:
        if high >= highest:
            return None
        high, step = min(high + step, highest), 2 * step
    return low, high


# ------------------------------------------------------------------------------------------------ what is not known


def forces(protocol: str, truth: Truth) -> np.ndarray:
    """Force of all recordings of a protocol, exactly measured, N."""
    return np.concatenate([recording.clean for recording in PROTOCOLS[protocol].recordings(truth, QUIET)])


@cache
def scene_of(
    protocol: str, noise: Noise, instruments: Instruments, rubber: bool = False, rules: Rules = THE_PROGRAMS
) -> Scene:
    """All that the oracle needs of a protocol."""
    base = Truth(WHOLE, base_of(NEEDS_RUBBER if rubber else ()))
    recordings = PROTOCOLS[protocol].recordings(base, QUIET)
    force, runs = np.concatenate([one.clean for one in recordings]), list(runs_of(recordings))
    whiteners = tuple(
        (at, cholesky(covariance(noise, instruments, run, at, force) + rules.blind(run, at), lower=True))
        for run in runs
        for at in run.whites
    )
    bare = Scene(protocol, base, force, whiteners, np.zeros((0, 0)), 0)
    free = slopes(protocol, base, force, rubber)
    friction = free[0]
    unknown = [*nuisances(protocol, base, force, friction, runs, instruments), *geometry(protocol, base, force)]
    unknown += [max(noise.spread, rules.spread) * inside(run, friction) for run in runs]
    unknown, free = ([column for column in columns if np.any(column)] for columns in (unknown, free))
    above = bare.whitened(np.stack([*unknown, *free], axis=1)) if unknown or free else np.zeros((len(force), 0))
    below = np.eye(len(unknown), len(unknown) + len(free))
    basis = np.linalg.qr(np.vstack([above, below]))[0]
    return replace(bare, basis=basis, priors=len(unknown))


def runs_of(recordings: tuple[Recording, ...]) -> Iterator[Run]:
    """The runs of all recordings, one below the other."""
    first = 0
    for part, recording in enumerate(recordings):
        columns, begun = recording.columns, 0.0
        for at in stretches(columns["run"] if "run" in columns else np.zeros(len(recording.clean))):
            where = slice(first + at.start, first + at.stop)
            if recording.test == "static":
                time, clock = None, DWELL * np.arange(at.stop - at.start)
                own = stretches(columns["branch"]) if "branch" in columns else [at]
                whites = tuple(slice(first + one.start, first + one.stop) for one in own)
            else:
                time = columns["time"][at]
                clock, begun, whites = time + begun, begun + time[-1], (where,)
            held = recording.test == "isometric"
            yield Run(part, where, whites, time, clock, columns["pressure"][at], columns["displacement"][at], held)
        first += len(recording.clean)


def stretches(labels) -> list[slice]:
    """Where a column keeps its value."""
    edges = [0, *(np.flatnonzero(labels[1:] != labels[:-1]) + 1).tolist(), len(labels)]
    return [slice(start, stop) for start, stop in pairwise(edges)]


def covariance(noise: Noise, instruments: Instruments, run: Run, at: slice, force: np.ndarray) -> np.ndarray:
    """Covariance of one run's readings of force, N^2: see `disturbed`; a map has neither memory nor wander."""
    count, mapped = at.stop - at.start, run.time is None
    shape = {None: np.ones(count), "force": np.abs(force[at]) / 350.0}
    if noise.grows == "pressure":
        shape["pressure"] = np.abs(run.pressure[at.start - run.at.start : at.stop - run.at.start] / 3.3e5) ** 1.5
    grows, lags = shape[noise.grows], np.arange(count)
    out = toeplitz((0.0 if mapped else noise.phi) ** lags) * np.outer(grows, grows) + noise.zero**2
    if not mapped:
        out = out + noise.drift**2 * toeplitz(0.99**lags)
    white = (noise.step**2 + instruments.force.resolution**2) / 12 + instruments.force.noise**2
    moved = np.zeros(count) if mapped else instruments.jitter * np.gradient(force[at], run.time)
    return noise.sd**2 * out + np.diag(white + moved**2)


def next_to_turning(run: Run, at: slice) -> np.ndarray:
    """1 for the samples of a stretch within three of a turning point or an end, or a tenth of a branch if that is less.

    Turning points of the length, or of the pressure where the length is held. A map has none.
    """
    out = np.zeros(at.stop - at.start)
    if run.time is None:
        return out
    imposed = (run.pressure if run.held else run.stroke)[at.start - run.at.start : at.stop - run.at.start]
    direction = np.sign(np.diff(imposed))
    edges = [0, *(np.flatnonzero(direction[1:] * direction[:-1] < 0) + 1).tolist(), len(out) - 1]
    for first, last in pairwise(edges):
        reach = min(3, (last - first + 1) // 10)
        out[first : first + reach + 1] = out[last - reach : last + 1] = 1.0
    return out


def slopes(protocol: str, base: Truth, force: np.ndarray, rubber: bool) -> list[np.ndarray]:
    """Change of force by each free parameter of the baseline, of its own size, N."""
    out = []
    for name, key in FREE[: 1 + rubber]:
        given = base.effects[name]
        more = {**base.effects, name: {**given, key: (1 + NUDGE) * given[key]}}
        out.append((forces(protocol, Truth(WHOLE, more)) - force) / NUDGE)
    return out


def geometry(protocol: str, base: Truth, force: np.ndarray) -> Iterator[np.ndarray]:
    """Change of force by a standard error of each length or angle that is not known exactly, N."""
    for key, error in PROTOCOLS[protocol].errors.items():
        other = replace(WHOLE, **{key: getattr(WHOLE, key) + 0.1 * error})
        plan = PROTOCOLS[protocol].stretched(other.length / WHOLE.length)
        made = plan.recordings(Truth(other, base.effects), QUIET)
        yield (np.concatenate([one.clean for one in made]) - force) / 0.1


def nuisances(
    protocol: str, base: Truth, force: np.ndarray, friction: np.ndarray, runs: list[Run], errs: Instruments
) -> Iterator[np.ndarray]:
    """Change of force by a standard deviation of each thing that an instrument may err by, N (arrays over samples)."""

    def sensed(name: str, key: str, size: float, unit: float) -> np.ndarray:
        nudged = {**base.effects, name: {key: unit + size}}
        return (forces(protocol, Truth(WHOLE, nudged)) - force) / size

    by_pressure, by_gain = (
        sensed("pressure_offset", "P_off", 1e5 * NUDGE, 0.0),
        sensed("pressure_gain", "g", NUDGE, 0.0),
    )
    by_place = sensed("contraction_offset", "eps_off", NUDGE, 0.0) / WHOLE.length
    by_stroke = sensed("tip", "k", NUDGE, 1.0)
    for run in runs:
        held = np.hypot(errs.position.zero_per_run, errs.held_length) if run.held else errs.position.zero_per_run
        yield inside(run, np.full_like(force, errs.force.zero_per_run))
        yield inside(run, errs.force.gain_per_run * force)
        yield inside(run, errs.pressure.zero_per_run * by_pressure)
        yield inside(run, errs.pressure.gain_per_run * by_gain)
        yield inside(run, held * by_place)
        yield inside(run, errs.position.gain_per_run * by_stroke)
        yield delayed(run, force, errs.skew)
    for part in sorted({run.part for run in runs}):
        mine = [run for run in runs if run.part == part]
        lasting = [np.full_like(force, errs.force.zero), errs.force.gain * force, errs.pressure.zero * by_pressure]
        lasting += [errs.pressure.gain * by_gain, errs.position.zero * by_place, errs.position.gain * by_stroke]
        lasting += [by_clock(mine, force, errs), by_memory(mine, force, errs), by_warmth(mine, friction, errs)]
        lasting += [*by_ripple(mine, by_pressure, errs)]
        yield from (sum((inside(run, column) for run in mine), np.zeros_like(force)) for column in lasting)


def inside(run: Run, column: np.ndarray) -> np.ndarray:
    """A column that is zero outside one run."""
    out = np.zeros_like(column)
    out[run.at] = column[run.at]
    return out


def delayed(run: Run, force: np.ndarray, skew: float) -> np.ndarray:
    """What reading the force later by `skew` s changes, N; nothing in a map."""
    out = np.zeros_like(force)
    if skew and run.time is not None:
        out[run.at] = np.interp(run.time - skew, run.time, force[run.at]) - force[run.at]
    return out


def by_clock(runs: list[Run], force: np.ndarray, errs: Instruments) -> np.ndarray:
    """The drift of the load cell's zero, N."""
    out = np.zeros_like(force)
    for run in runs:
        out[run.at] = errs.force.drift * drifted(run.clock, errs.force.settling)
    return out


def by_memory(runs: list[Run], force: np.ndarray, errs: Instruments) -> np.ndarray:
    """The load cell's hysteresis, N."""
    out, scale = np.zeros_like(force), errs.force.full_scale
    for run in runs if errs.force.hysteresis else []:
        for at in run.whites:
            out[at] = -errs.force.hysteresis * scale / 2 * slipped(force[at], scale, 1.0)
    return out


def by_warmth(runs: list[Run], friction: np.ndarray, errs: Instruments) -> np.ndarray:
    """Friction that has warmed, N."""
    out = np.zeros_like(friction)
    for run in runs:
        out[run.at] = -errs.warming * np.expm1(-run.clock / errs.warm_after) * friction[run.at]
    return out


def by_ripple(runs: list[Run], by_pressure: np.ndarray, errs: Instruments) -> Iterator[np.ndarray]:
    """The unseen ripple of the pressure, of unknown phase, N."""
    for wave in (np.sin, np.cos):
        out = np.zeros_like(by_pressure)
        for run in runs:
            shape = wave(2 * np.pi * run.stroke / errs.ripple_pitch)
            out[run.at] = errs.ripple / np.sqrt(2) * (shape - np.mean(shape)) * by_pressure[run.at]
        yield out
