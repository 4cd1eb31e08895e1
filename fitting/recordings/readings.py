"""From a table to the readings of each run: which columns a test needs, the program's conventions, runs."""

from collections import Counter
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from fitting import units
from fitting.errors import InputError, concerning, nearest, unknown_name
from fitting.recordings.absolute import ambient_of, check_absolute
from fitting.recordings.checks import PRESSURES, check_ranges, check_run
from fitting.recordings.gaps import pressure_levels
from fitting.recordings.heads import COLUMNS, POSITIONS, USUAL, plain_name
from fitting.recordings.held_lengths import held_stretches
from fitting.recordings.position import shortening
from fitting.recordings.records import FORCE_TESTS, Run
from fitting.recordings.settings import TABLES
from fitting.recordings.tables import Table
from fitting.showing import numbered_rows
from mckibben_jax.muscle import Muscle

HELD = ("isometric", "static")  # tests in which a muscle may have one length throughout
# 'up', 'down', 'loading': of the length, the force or the pressure? They are not in it.
DIRECTIONS = {"contraction": 1, "inflate": 1, "elongation": -1, "deflate": -1,
              "contracting": 1, "shortening": 1, "inflating": 1, "inflation": 1,
              "elongating": -1, "lengthening": -1, "deflating": -1, "deflation": -1}  # fmt: skip
NO_DIRECTION = (
    "write 'contraction' where the muscle became shorter before the reading, or the pressure rose in an isometric "
    "test, and 'elongation' where it became longer, or the pressure fell"
)
EXAMPLES = {"length": "160 mm", "load": "10 kg", "pressure": "3 bar"}  # of what may be the same throughout a recording
TYPING_ERROR = 0.88  # likeness of a word to one that was meant
FEWEST_SAMPLES = TABLES.fewest_samples  # of a run


def with_hung_load(table: Table, test: str) -> Table:
    """The table of a static test in which weights were hung on: at rest a muscle pulls with what hangs on it.

    And that of an isotonic test in which a load cell read what hangs there.
    """
    if test == "isotonic" and "force" in table and "load" not in table:
        parts = (renamed(each, "force", "load") for each in (table.columns, table.heads, table.units))
        return replace(table, **dict(zip(("columns", "heads", "units"), parts, strict=True)))
    if test != "static" or "force" in table or "load" not in table:
        return table
    columns, heads, given = (renamed(each, "load", "force") for each in (table.columns, table.heads, table.units))
    unit = table.units["load"]
    is_mass = units.dimension(unit) == units.dimension("kg")
    stated = given | {"force": units.PULL_OF_MASS.get(unit, "N") if is_mass else unit}
    return replace(table, columns=columns, heads=heads, units=stated)


def renamed(given: Mapping[str, Any], old: str, new: str) -> dict[str, Any]:
    """The same by name, of which one is another."""
    return {new if name == old else name: value for name, value in given.items()}


def read_runs(table: Table, test: str, muscle: Muscle, options: dict[str, Any], counts: Counter[str]) -> list[Run]:
    """The readings of every run, checked; `counts` gains the samples that are set aside, by reason."""
    position = _check_columns(table, test)
    check_absolute(table, options)
    readings = _all_readings(table, test, muscle, options, position, counts)
    check_ranges(readings, table, test, options, position)
    parts = [_part(readings, at, label) for label, at in _runs(readings, table, test, counts)]
    for part in parts:
        check_run(part, table, test)
    return parts


# ----------------------------------------------------------------------------------------------------- what is needed


def _check_columns(table: Table, test: str) -> str:
    """Check that all columns of this test are there; the name of the one that says where the muscle is."""
    needed = ["pressure"] + ["time"] * (test != "static") + (["force"] if test in FORCE_TESTS else ["load"])
    for name in needed:
        if name not in table and not (test == "step" and name == "pressure" and "set_pressure" in table):
            raise _lacks(table, test, name, (name,))
    if test == "quick release" and table.has_stamps:
        problem = "stamps do not tell when the muscle is let go, which is where its time is 0"
        raise table.error(problem, 0, "time", cure="write the time in seconds from there, negative before it")
    found = [name for name in POSITIONS if name in table]
    if not found:
        raise _lacks(table, test, "contraction, length or displacement", POSITIONS)
    if len(found) > 1:
        raise InputError(
            f"{' and '.join(found)} say the same twice", table.file, table.header_row, cure="keep one of these columns"
        )
    return found[0]


def _lacks(table: Table, test: str, what: str, names: tuple[str, ...]) -> InputError:
    """The error for a missing column: a misspelt one is named, else the cure is a mapping."""
    problem = f"a '{test}' recording needs a column {what}"
    for head in table.unused:
        like = nearest(plain_name(head), names)
        if like:
            return InputError(problem, table.file, table.header_row, head, cure=f"did you mean '{like}'?")
    unit = USUAL[str(COLUMNS[names[0]])]
    held = test in HELD or not {*names} & {*POSITIONS}  # else the muscle moves
    constant = next((f'{name} = "{EXAMPLES[name]}"' for name in names if name in EXAMPLES and held), "")
    same = f"; or say it there if it was the same throughout: constant = {{ {constant} }}" if constant else ""
    rename = "" if table.header_row is None else f"head it '{names[0]} [{unit}]', or "
    return InputError(
        problem,
        table.file,
        table.header_row,
        value=", ".join([*table.heads.values(), *table.unused]),
        cure=f'{rename}say in muscle.toml which column it is: columns = {{ {names[0]} = "its name" }}{same}',
    )


# ------------------------------------------------------------------------------------------------- the program's words


def _all_readings(
    table: Table, test: str, muscle: Muscle, options: dict[str, Any], position: str, counts: Counter[str]
) -> Run:
    """The whole file: gauge pressure, contraction, pulling positive; what is missing or not valid is marked."""
    atmosphere = ambient_of(options)
    columns = {name: values for name, values in table.columns.items() if COLUMNS[name] is not None}
    for name in PRESSURES:
        if name in columns and (name in table.absolute or not table.absolute):  # a regulator may be set above the air
            columns[name] = columns[name] - atmosphere
    if "force" in columns:
        columns["force"] = columns["force"] * options.get("force_sign", 1)
    columns[position] = shortening(table, options, position)
    length = float(muscle.length)
    moved = columns[position]
    contraction = {"contraction": moved, "length": (length - moved) / length, "displacement": moved / length}[position]
    usable = _usable(columns, options.get("valid", {}), table, counts)
    set_pressure = columns.get("set_pressure") if test == "step" else None
    return Run.as_read(
        name="",
        time=columns.get("time", np.arange(float(len(table.row)))),
        pressure=columns.get("pressure", set_pressure),  # type: ignore[arg-type]
        contraction=contraction,
        measured=columns["force"] if test in FORCE_TESTS else contraction * length,
        row=table.row,
        usable=usable,
        direction=_directions(table) if "branch" in table else None,
        load=None if test in FORCE_TESTS else columns["load"],
        set_pressure=set_pressure,
    )


def _usable(columns: dict[str, np.ndarray], valid: dict[str, Any], table: Table, counts: Counter[str]) -> np.ndarray:
    """Which samples have all their readings, and these inside `valid`; the others are counted by reason."""
    usable = np.ones(len(table.row), dtype=bool)
    for name, values in columns.items():
        missing = np.isnan(values)
        lost = table.row[missing & usable]
        if len(lost):
            counts[f"no reading in '{table.heads[name]}' ({numbered_rows(lost)})"] += len(lost)
        usable &= ~missing
    for written, limits in valid.items():
        name = "force" if written == "load" and "load" not in columns else written  # weights that hang at rest
        if name not in columns:
            raise unknown_name("column in valid:", name, columns, table.file)
        with concerning("valid"):
            low, high = _limits(written, limits)
        outside = usable & ~((columns[name] >= low) & (columns[name] <= high))
        counts[f"{name} outside {limits[0]} .. {limits[1]}"] += int(np.count_nonzero(outside))
        usable &= ~outside
    return usable


def _limits(name: str, limits: Any) -> tuple[float, float]:
    if not isinstance(limits, list) or len(limits) != 2:
        raise InputError(
            f"valid: {name} is not a pair of values", value=limits, cure='write valid = { force = ["5 N", "5000 N"] }'
        )
    convert = units.load_to_si if name == "load" else units.to_si
    low, high = (convert(limit, str(COLUMNS[name]), f"valid: {name}") for limit in limits)
    if low >= high:
        raise InputError(f"valid: {name} holds nothing", value=limits, cure="write the lower limit first")
    return low, high


def _directions(table: Table) -> np.ndarray:
    """The branch column as +1 (contraction, inflate) and -1 (elongation, deflate)."""
    labels = table["branch"]
    known, which = np.unique(labels.astype(str), return_inverse=True)
    for number, label in enumerate(known):
        if label.lower() not in DIRECTIONS:
            like = nearest(label.lower(), DIRECTIONS, TYPING_ERROR)  # a word that is only alike may mean the opposite
            cure = f"did you mean '{like}'? Else {NO_DIRECTION}" if like else NO_DIRECTION
            raise table.error("not a branch", int(np.argmax(which == number)), "branch", label, cure)
    return np.array([DIRECTIONS[label.lower()] for label in known])[which]


# --------------------------------------------------------------------------------------------------------------- runs


def _runs(r: Run, table: Table, test: str, counts: Counter[str]) -> list[tuple[str, np.ndarray]]:
    """Label and rows of every run, in the order of the file; rows without a time are in none."""
    timed = ~np.isnan(r.time)
    if "run" in table:
        labels = table["run"].astype(str)
        names, first = np.unique(labels, return_index=True)
        return [(str(names[k]), np.flatnonzero((labels == names[k]) & timed)) for k in np.argsort(first)]
    if test == "isometric":
        return _held_lengths(r, timed, counts)
    if test == "loop":
        rows = np.flatnonzero(timed)
        parts = pressure_levels(r.time[rows], r.pressure[rows])
        return [(str(number), rows[part]) for number, part in enumerate(parts, 1)]
    return [("1", np.flatnonzero(timed))]


def _held_lengths(r: Run, timed: np.ndarray, counts: Counter[str]) -> list[tuple[str, np.ndarray]]:
    """Stretches of one length, each a run."""
    rows = np.flatnonzero(timed & ~np.isnan(r.contraction))
    parts = [rows[at] for at in held_stretches(r.contraction[rows], r.pressure[rows])]
    counts["between two lengths"] += len(rows) - sum(map(len, parts))
    return [(str(number), part) for number, part in enumerate(parts, 1)]


def _part(r: Run, at: np.ndarray, name: str) -> Run:
    """These rows as readings of their own, gaps bridged."""
    gaps = ("pressure", "contraction", "measured", "load", "set_pressure")
    bridged: dict[str, Any] = {key: _bridge(values[at]) for key in gaps if (values := getattr(r, key)) is not None}
    return replace(r.at(at), name=name, **bridged)


def _bridge(values: np.ndarray) -> np.ndarray:
    """Missing readings interpolated: they carry no weight, but memory runs through them."""
    missing = np.isnan(values)
    if not missing.any() or missing.all():
        return np.nan_to_num(values)
    place = np.arange(len(values))
    return np.interp(place, place[~missing], values[~missing])
