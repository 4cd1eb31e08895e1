"""Readings that no muscle gives, and runs that are no recording: refused with the row and what to do."""

from typing import Any

import numpy as np

from fitting import showing, units
from fitting.errors import InputError, alike
from fitting.recordings.heads import COLUMNS
from fitting.recordings.held_lengths import wanders
from fitting.recordings.records import Run
from fitting.recordings.settings import LISTED, TABLES
from fitting.recordings.tables import Table
from fitting.showing import numbered_rows

PRESSURES = ("pressure", "set_pressure")


def check_ranges(r: Run, table: Table, test: str, options: dict[str, Any], position: str) -> None:
    """Readings that no muscle gives betray a wrong unit, sign or length."""
    low, high = TABLES.contractions
    _refuse(
        table,
        r.usable & ((r.contraction < low) | (r.contraction > high)),
        position,
        f"contraction outside {low} .. {high}",
        r.contraction,
        _position_cure(position),
    )
    for name, pressure in (("pressure", r.pressure), ("set_pressure", r.set_pressure)):
        if pressure is None or name not in table:
            continue
        _refuse(
            table,
            r.usable & (pressure > TABLES.largest_pressure),
            name,
            f"pressure above {showing.show(TABLES.largest_pressure, 'Pa')}",
            pressure,
            "check the column's unit",
            showing.shown_in("Pa", TABLES.largest_pressure)[0],
        )
        _refuse(
            table,
            r.usable & (pressure < -1.02 * units.ATMOSPHERE),
            name,
            "pressure below vacuum",
            pressure,
            "check the unit, and whether it is gauge or absolute",
        )
    top = float(np.max(r.pressure[r.usable], initial=-np.inf))
    if test == "loop" and 0 < top < TABLES.loop_pressure and "pressure" not in options.get("valid", {}):
        least = showing.show(TABLES.loop_pressure, "Pa")
        said = f'valid = {{ pressure = ["-{least}", "{least}"] }}'
        raise InputError(
            f"the pressure never reaches {least}",
            table.file,
            column=table.heads["pressure"],
            value=f"at most {showing.show(top, 'Pa', digits=3)}",
            cure=f"check the column's unit; if the muscle was vented, say so: {said}",
        )


def _refuse(
    table: Table, bad: np.ndarray, column: str, problem: str, values: np.ndarray, cure: str, unit: str | None = None
) -> None:
    """Refuse a table with `bad` readings, naming the first of them (a pressure in `unit`, if it is given)."""
    if bad.any():
        at = int(np.argmax(bad))
        raise table.error(
            problem + alike(table.row[bad]),
            at,
            column,
            showing.show(values[at], str(COLUMNS[column]) if column in PRESSURES else "1", unit=unit),
            cure,
        )


def _position_cure(position: str) -> str:
    return {
        "contraction": "check whether the unit is [1] or [%]; positive is shorter",
        "length": "check the unit, and the muscle's length in muscle.toml",
        "displacement": "check the unit and the sign: positive is shorter than the muscle's length in muscle.toml; "
        "where the rig counts lengthening as positive write position_sign = -1, and where its 0 lies elsewhere "
        'position_at_rest = "what it reads at rest"',
    }[position]


def check_run(r: Run, table: Table, test: str) -> None:
    """Enough samples, and time that rises."""
    fewest = 1 if test == "static" else TABLES.fewest_samples
    if len(r.time) < fewest:
        have = f"run {r.name} has" if "run" in table else "there are"
        raise InputError(
            f"{have} only {len(r.time)} samples, {fewest} are needed",
            table.file,
            int(table.row[0] if not len(r.row) else r.row[0]),
            cure="record more, or delete the run",
        )
    if test == "static":
        return
    step = np.diff(r.time)
    if (step <= 0).any():
        at = int(np.argmax(step <= 0)) + 1
        back = step[at - 1] < 0
        cure = "if another experiment begins here, add a column 'run' that numbers the experiments"
        cure = "give each experiment its own number in the column 'run'" if "run" in table else cure
        same = numbered_rows(r.row[1:][step == 0], LISTED)
        raise InputError(
            "time goes back" if back else "two samples have the same time",
            table.file,
            int(r.row[at]),
            table.heads["time"],
            f"{r.time[at]:.9g} s after {r.time[at - 1]:.9g} s",
            cure if back else f"write the time with more digits, or delete {same}, or begin the line with '#'",
        )
    if test == "isometric" and wanders(r.contraction[r.usable]):
        where = f"run {r.name}: " if "run" in table else ""
        raise InputError(
            f"{where}the length is not held",
            table.file,
            int(r.row[0]),
            cure='a recording in which the length moves is test = "loop"',
        )
