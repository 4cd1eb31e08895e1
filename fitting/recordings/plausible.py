"""Whether readings can come from this muscle at all: wrong units, dead or swapped sensors, copies of a run.

Held against the ideal cylinder (eq 10), which knows no rubber, ends or friction: a real muscle may pull half as much
or twice as much, but not thirty times. What is refused here would be fitted with parameters that mean nothing. Who
knows better states `valid` limits of the force in muscle.toml; then no force is refused.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from fitting import showing
from fitting.errors import InputError, alike
from fitting.recordings.heads import POSITIONS
from fitting.recordings.ideal import ideal_pull
from fitting.recordings.records import FORCE_TESTS, Experiment, Recording, Run
from fitting.recordings.settings import PLAUSIBLE
from fitting.recordings.tables import Table
from mckibben_jax.muscle import Muscle

TINY_STROKE, LARGE_DROP = 0.005, 0.5  # a stroke of half a per cent does not take half of the force away


def check_plausible(
    parts: Sequence[Run], table: Table, test: str, muscle: Muscle, options: Mapping[str, Any]
) -> list[str]:
    """Refuse readings that this muscle cannot give; what is merely odd is returned in words."""
    column, valid = "force" if test in FORCE_TESTS else "load", options.get("valid")
    used = [part for part in parts if part.usable.any()]
    if not used or (isinstance(valid, dict) and column in valid):
        return []
    pressure = max(float(np.max(part.pressure[part.usable])) for part in used)
    if pressure < PLAUSIBLE.least_pressure:
        return []
    reach = ideal_pull(np.minimum(np.concatenate([p.contraction[p.usable] for p in used]).min(), 0.0), pressure, muscle)
    notes = _too_large(parts, table, column, float(reach))
    if test in FORCE_TESTS:
        ideal = [np.maximum(ideal_pull(part.contraction, part.pressure, muscle), 0.0) for part in parts]
        _too_small(parts, table, ideal)
        _constant(parts, table, ideal)
        _opposed(parts, table, ideal, _turned(parts, table, test, options))
        if test == "loop":
            _tiny_stroke(used, table)
            notes += [*_short_stroke(used, muscle), *_too_fast(used, muscle)]
    else:
        _at_rest(used, table)
    return notes


def _forces(part: Run) -> np.ndarray:
    return part.measured if part.load is None else part.load


def _too_large(parts: Sequence[Run], table: Table, column: str, reach: float) -> list[str]:
    values, rows = (np.concatenate([of(part)[part.usable] for part in parts]) for of in (_forces, lambda p: p.row))
    at = int(np.argmax(np.abs(values)))
    times, whole = abs(values[at]) / reach, bool(np.all(values == np.round(values)))
    most = f"{times:.3g} times what the ideal muscle of this size pulls at most ({showing.show(reach, 'N')})"
    if times > PLAUSIBLE.beyond or (
        times > PLAUSIBLE.odd and whole and len(values) >= PLAUSIBLE.fewest and np.ptp(values) > 0
    ):
        beyond = np.abs(values) > min(PLAUSIBLE.beyond, max(PLAUSIBLE.odd, 0.5 * times)) * reach
        few = np.count_nonzero(beyond) < max(3, 0.01 * len(values))
        raw = "whole numbers look like a converter's raw counts: turn them into newtons with its calibration; else "
        look = "check this reading" if few else "check the units of force and pressure, and the radius"
        mine = f'valid = {{ {column} = ["-10 N", "5 kN"] }} with your limits'
        cure = f"{raw if whole and not few else ''}{look}; if it is right, say so: {mine}"
        here = int(np.flatnonzero(table.row == rows[at])[0])
        problem = f"the {column} is {most}{alike(rows[beyond])}"
        raise table.error(problem, here, column, showing.show(values[at], "N"), cure)
    return (
        [f"the {column} reaches {most}: is its unit right, and that of the pressure?"] if times > PLAUSIBLE.odd else []
    )


def _too_small(parts: Sequence[Run], table: Table, ideal: list[np.ndarray]) -> None:
    """A load cell that is disconnected, a muscle that was slack all the time, kN for N."""
    largest = max(float(np.max(np.abs(part.measured[part.usable]), initial=0.0)) for part in parts)
    pulls = max(float(np.max(force[part.usable], initial=0.0)) for part, force in zip(parts, ideal, strict=True))
    if pulls > PLAUSIBLE.beyond * largest:
        raise InputError(
            f"the force is all but nothing where the ideal muscle of this size pulls {showing.show(pulls, 'N')}: "
            "the muscle was slack, the load cell not connected, or the unit is another",
            table.file,
            table.header_row,
            table.heads["force"],
            value=f"at most {showing.show(largest, 'N')}",
            cure="check the units of force and pressure (N or kN, kPa or bar) and the load cell's cable",
        )


def _constant(parts: Sequence[Run], table: Table, ideal: list[np.ndarray]) -> None:
    """A force that stays while length or pressure move, in every run that moves."""
    stays, moves, steady = [], [], []
    for part, force in zip(parts, ideal, strict=True):
        expected, found = (_spread(values[part.usable]) for values in (force, part.measured))
        if expected > PLAUSIBLE.least_change * force.max(initial=0.0) > 0:
            stays.append(found)
            moves.append(expected)
            steady.append(_spread(part.pressure[part.usable]) < 0.1 * np.abs(part.pressure).max())
    if moves and all(PLAUSIBLE.beyond * found < expected for found, expected in zip(stays, moves, strict=True)):
        swapped = "" if all(steady) else "check whether the columns force and pressure are exchanged; "
        raise InputError(
            "the force stays the same while the muscle moves: the ideal force changes by "
            f"{showing.show(max(moves), 'N')}. A saturated or dead load cell, or a hung load",
            table.file,
            table.header_row,
            table.heads["force"],
            value=f"changes by {showing.show(max(stays), 'N')}",
            cure=f'{swapped}check the load cell; a muscle that lifts a constant load is test = "isotonic"',
        )


def _spread(values: np.ndarray) -> float:
    """Range of all but the outermost hundredth."""
    return float(np.ptp(np.quantile(values, [0.01, 0.99]))) if len(values) >= PLAUSIBLE.fewest else 0.0


def _opposed(parts: Sequence[Run], table: Table, ideal: list[np.ndarray], cure: str) -> None:
    """A force that rises where every muscle's falls: a sign, or exchanged columns."""
    together = []
    for part, force in zip(parts, ideal, strict=True):
        expected, found = force[part.usable], part.measured[part.usable]
        if _spread(expected) > PLAUSIBLE.least_change * force.max(initial=0.0) and np.ptp(found) > 0:
            together.append(float(np.corrcoef(expected, found)[0, 1]))
    if together and max(together) < PLAUSIBLE.opposed:
        raise InputError(
            "the force rises where that of a muscle falls (with contraction, or as the pressure drops)",
            table.file,
            table.header_row,
            table.heads["force"],
            value=f"correlation {max(together):.2f} with the ideal force",
            cure=cure,
        )


def _turned(parts: Sequence[Run], table: Table, test: str, options: Mapping[str, Any]) -> str:
    """How a force or a position is turned that has the wrong sign, the likelier of the two first.

    A length that is held, or that is read as one, has no sign that could be wrong.
    """
    signs = [f"leave {name} out" for name in ("position_sign", "force_sign") if options.get(name) == -1]
    if not signs:
        force = "if the rig counts pulling as negative write force_sign = -1"
        position = "if it counts lengthening as positive (positive is shorter) write position_sign = -1"
        pulls = float(np.median(np.concatenate([part.measured[part.usable] for part in parts]))) > 0
        signs = [position, force] if pulls else [force, position]
        signs = [force] if "length" in table or test == "isometric" else signs
    return f"{'; '.join(signs)}; else check whether two columns are exchanged"


def _fall(force: np.ndarray) -> float:
    """By which share of its largest size a force changes; 0 of none."""
    return float(np.ptp(force) / max(np.max(np.abs(force)), 1e-300))


def _tiny_stroke(parts: Sequence[Run], table: Table) -> None:
    """Millimetres for metres, 1 for per cent: the force falls by half while the muscle hardly moves."""
    strokes = [float(np.ptp(part.contraction[part.usable])) for part in parts]
    drops = [_fall(part.measured[part.usable]) for part in parts]
    if max(strokes) < TINY_STROKE and min(drops) > LARGE_DROP:
        position = next(name for name in POSITIONS if name in table)
        raise InputError(
            f"the force falls by {100 * min(drops):.0f} % while the muscle shortens by {100 * max(strokes):.2g} % only",
            table.file,
            table.header_row,
            table.heads[position],
            value=f"contraction {100 * max(strokes):.2g} %",
            cure="check the unit of this column, and the muscle's length in muscle.toml",
        )


def _short_stroke(parts: Sequence[Run], muscle: Muscle) -> list[str]:
    """A length that is ten times too large: in every run the force falls far more than the ideal muscle's would.

    Where the pressure is low, or far below that of other runs, rubber and friction are as large as the pull, and
    nothing is asked.
    """
    falls, ideal, strokes = [], [], []
    pressures = [float(np.max(part.pressure[part.usable])) for part in parts]
    for part, pressure in zip(parts, pressures, strict=True):
        place, force = part.contraction[part.usable], part.measured[part.usable]
        if pressure >= max(PLAUSIBLE.pulls, max(pressures) / 2) and force.any():
            falls.append(_fall(force))
            ideal.append(_fall(ideal_pull(place, pressure, muscle)))
            strokes.append(float(np.ptp(place)))
    steep = [fall >= max(PLAUSIBLE.falls, PLAUSIBLE.steeper * of) for fall, of in zip(falls, ideal, strict=True)]
    if not steep or not all(steep):
        return []
    at = int(np.argmin(falls))
    return [
        f"the force falls by {100 * falls[at]:.0f} % while the muscle shortens by {100 * strokes[at]:.2g} %, on which "
        f"the ideal muscle's force falls by {100 * ideal[at]:.2g} % only: is the muscle's length of "
        f"{showing.show(float(muscle.length), 'm')} right, and the unit of the position?"
    ]


def _too_fast(parts: Sequence[Run], muscle: Muscle) -> list[str]:
    """Seconds that are called milliseconds: loops faster than muscles are. On average, for noise then counts little."""
    used = [(part.contraction[part.usable], part.time[part.usable]) for part in parts]
    ways = [np.sum(np.abs(np.diff(place))) * float(muscle.length) for place, _ in used]
    speed = max(way / max(np.ptp(time), 1e-9) for way, (_, time) in zip(ways, used, strict=True))
    if speed < PLAUSIBLE.fast:
        return []
    return [f"the muscle moves at {speed:.3g} m/s on average: is the unit of the time right?"]


def _at_rest(parts: Sequence[Run], table: Table) -> None:
    """A position test in which nothing moves."""
    stroke = max(float(np.ptp(part.contraction[part.usable])) for part in parts)
    if stroke < PLAUSIBLE.standstill:
        position = next(name for name in POSITIONS if name in table)
        raise InputError(
            "the muscle does not move in any run",
            table.file,
            table.header_row,
            table.heads[position],
            value=f"contraction {100 * stroke:.2g} %",
            cure="check the unit of this column and the position sensor, or leave the recording out",
        )


# ------------------------------------------------------------------------------------------------------------- copies


def without_copies(experiment: Experiment) -> Experiment:
    """The same without the weight of runs that are copies of another, reading by reading: a copy is no repeat."""
    seen: dict[bytes, str] = {}
    recordings = []
    for recording in experiment.recordings:
        copies = {} if recording.test == "static" else _copies(recording, seen)
        runs = tuple(replace(r, weight=0.0 * r.weight) if r.name in copies else r for r in recording.runs)
        if not any(run.weight.any() for run in runs):
            problem = f"{[*copies.values()][-1]}: it has no weight, and so is all that this recording holds"
            cure = "leave one of the two [[recording]] out"
            raise InputError(problem, experiment.folder / recording.stored_in, cure=cure)
        notes = (*recording.notes, *(f"{copy}: it has no weight" for copy in copies.values()))
        recordings.append(replace(recording, runs=runs, notes=notes))
    return replace(experiment, recordings=tuple(recordings))


def _copies(recording: Recording, seen: dict[bytes, str]) -> dict[str, str]:
    """Runs of a recording that copy one seen before, by name: what each is a copy of. `seen` gains the others."""
    copies = {}
    for run in recording.runs:
        hung = np.zeros(len(run)) if run.load is None else run.load
        key = np.stack([run.measured, run.contraction, run.pressure, run.time - run.time[0], hung]).tobytes()
        own = f"run {run.name} of {recording.file}"
        first = seen.setdefault(key, own)
        if first != own and np.ptp(run.measured) > 0:
            copies[run.name] = f"{own} is a copy of {first}, reading by reading"
    return copies
