"""What `mckibben init` read in a folder, so that a wrong column, unit or sign is seen before anything is fitted."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from fitting import units
from fitting.recordings.guesses import SIGNED, Guess
from fitting.recordings.heads import COLUMNS
from fitting.recordings.tables import Table
from fitting.showing import counted

FIGURES = 4  # of a reading: enough to recognise it


def said_of_guess(guess: Guess) -> str:
    """One recording in a sentence or two: how much was read, for what it is taken, and from where to where it goes."""
    if guess.reason:
        return f"{guess.name} is left out: {guess.reason}"
    if not guess.columns:
        return f"{guess.name}: none of its columns is known ({', '.join(guess.unused)}). Name them in `columns`."
    unused = f" Not used: {', '.join(guess.unused)}." if guess.unused else ""
    if guess.table is None:
        return f"{guess.name} is taken for a test '{guess.test}', but cannot be read yet. {guess.problem}{unused}"
    return f"{_begun(guess, guess.table)}: {'; '.join(_ranges(guess, guess.table))}.{unused}"


def _begun(guess: Guess, table: Table) -> str:
    runs = len(np.unique(table["run"].astype(str))) if "run" in table else 1
    parts = f" in {runs} runs" if runs > 1 else ""
    return f"{guess.name}: {counted(len(table.row), 'row')}{parts}, taken for a test '{guess.test}'"


def _ranges(guess: Guess, table: Table) -> Iterator[str]:
    """Least and largest reading of each column, in the unit of the file."""
    for name, head in (guess.columns or {}).items():
        if name not in table or COLUMNS[name] is None:
            continue
        least, most, unit = _range(guess, table, name)
        called = "" if name not in guess.named else f" ('{head}')"
        called += ", lengthening positive," if name in SIGNED and guess.position_sign < 0 else ""
        yield f"{name.replace('_', ' ')}{called} {least:.{FIGURES}g} to {most:.{FIGURES}g} {unit or '(which unit?)'}"


def _range(guess: Guess, table: Table, name: str) -> tuple[float, float, str]:
    """Least and largest reading, and the unit that the file gives: "" where it gives none; stamps are seconds."""
    readings = table[name]
    unit = "" if (guess.units or {}).get(name) == "?" else table.units.get(name, "s")
    size = _size(name, unit) if unit else 1.0
    begin = float(np.nanmin(readings)) if name == "time" and table.has_stamps else 0.0
    return float(np.nanmin(readings) - begin) / size, float(np.nanmax(readings) - begin) / size, unit


def _size(name: str, unit: str) -> float:
    return units.load_factor(unit) if COLUMNS[name] == "load" else units.factor(unit, str(COLUMNS[name]))


def guess_result(guess: Guess) -> dict[str, Any]:
    """The same for machines; readings in the units of the file."""
    ranges = {}
    for name in guess.columns or {}:
        if guess.table is not None and name in guess.table and COLUMNS[name] is not None:
            least, most, unit = _range(guess, guess.table, name)
            ranges[name] = {"least": least, "most": most, "unit": unit or None}
    return {
        "file": guess.path.name,
        **guess.inside,
        "test": guess.test or None,
        "rows": None if guess.table is None else len(guess.table.row),
        "columns": guess.columns or {},
        "readings": ranges,
        "not_used": list(guess.unused),
        "left_out": guess.reason or None,
        "problem": guess.problem or None,
    }
