"""Recordings that could be made: what the rig has shown it can do, a grid of candidates, each as a run to predict."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import numpy as np

from fitting.errors import InputError
from fitting.planning.protocols import Demand, Need, Protocol, Specimen
from fitting.planning.settings import GRID
from fitting.recordings.inverse_dynamics import as_force
from fitting.recordings.noise import noise_of
from fitting.recordings.records import FORCE_TESTS, Experiment, Recording, Run
from fitting.recordings.settings import CYCLES


@dataclass(frozen=True)
class RigAbilities:
    """What the data show that the rig can do, SI."""

    tests: frozenset[str]
    pressure: float  # largest
    contractions: tuple[float, float]
    speeds: tuple[float, float]  # m/s, slowest and fastest loop; NaN without loops
    ramps: tuple[float, float]  # Pa/s; NaN without isometric tests
    interval: float  # s from one reading to the next
    branches: bool  # whether static points have a direction
    force: float  # smallest, N
    noise: float  # standard deviation of one reading, N
    length: float  # m, at rest
    position: str  # what the rig reads: contraction, length or displacement


def rig_abilities(experiment: Experiment) -> RigAbilities:
    """What one data set shows that its rig can do; recordings of force count, motions where there are only those.

    Motions show pressures and contractions, where they are read as force: a mass swings beyond where any muscle holds
    it. No rig that lets go of a load can move the length at a speed one chooses.
    """
    measured = [r for r in experiment.recordings if r.test in FORCE_TESTS]
    recordings = measured or list(as_force(experiment)[0].recordings)
    if not recordings:
        cure = "record a loop, an isometric or a static test"
        raise InputError("nothing here shows what the rig can do", experiment.folder, cure=cure)
    runs = [run if measured else run.at(run.usable) for r in recordings for run in r.runs if run.weight.any()]
    every = lambda name: np.concatenate([getattr(run, name) for run in runs])  # noqa: E731
    length = float(experiment.muscle.length)
    steps = [float(np.median(np.diff(run.time))) for r in recordings if r.test != "static" for run in r.runs]
    return RigAbilities(
        frozenset(r.test for r in measured),
        float(every("pressure").max()),
        (round(max(float(every("contraction").min()), 0.0), 2), round(float(every("contraction").max()), 2)),
        _span(length * np.abs(run.rate[run.branch != 0]) for run in _of(measured, "loop")),
        _span(np.abs(run.pressure_rate) for run in _of(measured, "isometric")),
        float(np.median(steps)) if steps else 1.0,
        any(np.any(run.branch != 0) for run in _of(measured, "static")),
        float(every("measured").min()),
        float(np.median([noise_of(r) for r in recordings])),
        length,
        recordings[0].position,
    )


def _of(recordings: Sequence[Recording], test: str) -> list[Run]:
    return [run for r in recordings if r.test == test for run in r.runs]


def _span(speeds: Iterable[np.ndarray]) -> tuple[float, float]:
    """The slowest and the fastest run's median speed."""
    each = [float(np.median(speed[speed > 0])) for speed in speeds if np.any(speed > 0)]
    return (min(each), max(each)) if each else (float("nan"), float("nan"))


# ------------------------------------------------------------------------------------------------------------ the grid


def grid(can: RigAbilities) -> tuple[Protocol, ...]:
    """Candidates: every kind of force test, inside what the rig has shown and, marked, beyond it."""
    static = _static(can) if "static" in can.tests else []
    return (*_loops(can), *_isometric(can), *static)


def _loops(can: RigAbilities) -> list[Protocol]:
    rig = () if "loop" in can.tests else (Demand(Need.LENGTH_DRIVE),)
    made = []
    for share, part, speed in product((*GRID.pressures, GRID.more_pressure), GRID.strokes, _speeds(can)):
        pressure, span = _round(share * can.pressure), _part(can.contractions, part)
        more = rig or _more_pressure(can, pressure)
        unseen = (*more, *_faster_drive(can, speed))
        beyond = bool(more or speed > 1.02 * GRID.faster * can.speeds[1])
        made.append(Protocol("loop", (pressure, pressure), span, speed / can.length, unseen=unseen, beyond=beyond))
    whole = _part(can.contractions, GRID.strokes[0])
    for share in (0.2, 0.5, 1.0):
        pressure, fast = _round(share * can.pressure), _speeds(can)[-3]
        unseen = (*rig, *_faster_drive(can, fast))
        made.append(Protocol("loop", (pressure, pressure), whole, fast / can.length, GRID.hold, unseen, bool(rig)))
    return [p for p in made if (0 if p.beyond else GRID.fewest * can.interval) <= p.branch_time < GRID.longest / 2]


def _speeds(can: RigAbilities) -> list[float]:
    """From slow to much faster than seen, m/s."""
    slow, fast = can.speeds if np.isfinite(can.speeds[0]) else (0.01, 0.01)
    between = [np.sqrt(slow * fast)] if fast > 1.5 * slow else []
    every = [
        slow / GRID.slower,
        slow,
        *between,
        *([fast] if between else []),
        GRID.faster * fast,
        GRID.much_faster * fast,
    ]
    return [_round(speed) for speed in every]


def _more_pressure(can: RigAbilities, pressure: float) -> tuple[Demand, ...]:
    """That the data show no such pressure; empty where they do."""
    return (Demand(Need.PRESSURE, pressure, can.pressure),) if pressure > 1.02 * can.pressure else ()


def _faster_drive(can: RigAbilities, speed: float) -> tuple[Demand, ...]:
    """That the drive must be faster than the data show it; empty where it need not, or none was seen."""
    return (Demand(Need.SPEED, speed, can.speeds[1]),) if speed > 1.02 * can.speeds[1] else ()


def _faster_ramp(can: RigAbilities, ramp: float) -> tuple[Demand, ...]:
    """The same of a pressure that is swept."""
    return (Demand(Need.RAMP, ramp, can.ramps[1]),) if ramp > 1.02 * can.ramps[1] else ()


def _isometric(can: RigAbilities) -> list[Protocol]:
    rig = () if "isometric" in can.tests else (Demand(Need.PRESSURE_SWEEP),)
    usual = 0.95 * can.pressure / GRID.ramp
    ramps = (usual / 4, usual * 4) if not np.isfinite(can.ramps[0]) else (can.ramps[0], GRID.faster * can.ramps[1])
    made = []
    for low, place, ramp in product((0.05, 0.5), (0.0, 0.25, 0.5, 0.75), ramps):
        held = round(float(can.contractions[0] + place * np.ptp(can.contractions)), 2)
        between = (_round(low * can.pressure), _round(can.pressure))
        unseen = (*rig, *_faster_ramp(can, ramp))
        made.append(Protocol("isometric", between, (held, held), ramp, unseen=unseen, beyond=bool(rig)))
    shortest = GRID.fewest * can.interval if can.tests - {"static"} else 0.0  # a map says nothing of a logger
    return [p for p in made if p.branch_time >= shortest]


def _static(can: RigAbilities) -> list[Protocol]:
    made = []
    for share, part in product((*GRID.pressures, GRID.more_pressure), GRID.strokes[:3]):
        pressure, span = _round(share * can.pressure), _part(can.contractions, part)
        more = _more_pressure(can, pressure)
        made.append(Protocol("static", (pressure, pressure), span, 0.0, unseen=more, beyond=bool(more)))
    return made


def _part(whole: tuple[float, float], part: tuple[float, float]) -> tuple[float, float]:
    low, high = (round(whole[0] + share * (whole[1] - whole[0]), 2) for share in part)
    return float(low), float(high)


def _round(value: float) -> float:
    """Two figures: nobody sets a regulator more finely."""
    return float(f"{value:.2g}")


# ------------------------------------------------------------------------------------------------------ runs to predict


def recording(protocols: Sequence[Protocol], can: RigAbilities) -> Recording:
    """A run for each candidate, all kinds of force test in one recording: to a model they are the same.

    Nothing is measured yet: the readings are 0, so that a residual is the prediction.
    """
    return Recording("planned", "loop", tuple(_run(p, can) for p in protocols), can.noise, position=can.position)


def _run(p: Protocol, can: RigAbilities) -> Run:
    return _points(p, can) if p.test == "static" else _cycles(p)


def _cycles(p: Protocol) -> Run:
    """Between the turning points at a constant speed; these themselves, and holds there, carry no weight."""
    way, rate = [0.0], [p.rate]
    half, time, weight = [0], [0.0], [0.0]
    places = np.append((np.arange(GRID.nodes) + 0.5) / GRID.nodes, 1.0)
    for branch in range(2 * GRID.cycles):
        rising = branch % 2 == 0
        way += list(places if rising else 1 - places)
        time += list(time[-1] + places * p.branch_time)
        rate += [p.rate if rising else -p.rate] * len(places)
        weight += [1.0] * GRID.nodes + [0.0]
        half += [branch] * len(places)
        if p.hold:
            way, rate, weight, half = [*way, way[-1]], [*rate, 0.0], [*weight, 0.0], [*half, branch]
            time.append(time[-1] + p.hold)
    share, moving, halves = np.array(way), np.array(rate), np.array(half)
    isometric, still = p.test == "isometric", np.zeros(len(way))
    low, high = p.pressures if isometric else p.contractions
    course = low + share * (high - low)
    return _unmeasured(
        np.array(time),
        pressure=course if isometric else still + p.pressures[0],
        contraction=still + p.contractions[0] if isometric else course,
        rate=still if isometric else moving,
        pressure_rate=moving if isometric else still,
        weight=np.array(weight),
        branch=np.where(halves % 2 == 0, 1, -1),
        half=halves,
        loop=halves // 2,
    )


def _points(p: Protocol, can: RigAbilities) -> Run:
    """Points without history, on both branches where the data have branches."""
    signs = np.repeat([1, -1] if can.branches else [0, 0], GRID.nodes // 2)
    along = np.tile(np.linspace(*p.contractions, GRID.nodes // 2), 2)
    count = np.arange(GRID.cycles * len(along))
    branch, still = np.tile(signs, GRID.cycles), np.zeros(len(count))
    return _unmeasured(
        count.astype(float),
        pressure=still + p.pressures[0],
        contraction=np.tile(along, GRID.cycles),
        rate=CYCLES.at_rest * branch,
        pressure_rate=still,
        weight=still + 1.0,
        branch=branch,
        half=count,
        loop=count,
    )


def _unmeasured(time: np.ndarray, **known: Any) -> Run:
    return Run(name="planned", time=time, measured=np.zeros(len(time)), row=np.arange(len(time)), **known)


# -------------------------------------------------------------------------------------------------------- other muscles


def specimens(experiment: Experiment) -> tuple[Experiment, ...]:
    """Muscles of the same make that could be built: half as long, twice as long, with a wall twice as thick."""
    muscle = experiment.muscle
    made = [(Specimen.HALF_AS_LONG, replace(muscle, length=muscle.length / 2))]
    made.append((Specimen.TWICE_AS_LONG, replace(muscle, length=muscle.length * 2)))
    wall = muscle.wall_thickness
    if wall is not None and float(2 * wall) < float(muscle.outer_radius):
        made.append((Specimen.THICK_WALL, replace(muscle, wall_thickness=2 * wall)))
    return tuple(replace(experiment, name=kind, muscle=other, recordings=()) for kind, other in made)


def on_specimen(can: RigAbilities, specimen: Specimen) -> tuple[Protocol, ...]:
    """What to record on another muscle: whole loops (or static maps) at a few pressures."""
    whole = [p for p in (_static(can) if can.tests == {"static"} else _loops(can)) if not p.hold]
    whole = [p for p in whole if p.contractions == _part(can.contractions, GRID.strokes[0])]
    whole = [p for p in whole if not p.beyond] or whole
    speed = min((p.rate for p in whole), key=lambda v: abs(np.log(max(v, 1e-12) * can.length / 0.01)))
    return tuple(replace(p, specimen=specimen) for p in whole if p.rate == speed)
