"""What was the same throughout a recording, stated in muscle.toml instead of in a column: a held length, a load."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from fitting import units
from fitting.errors import InputError, concerning, unknown_name
from fitting.recordings.heads import COLUMNS
from fitting.recordings.records import FORCE_TESTS
from fitting.recordings.tables import Table

CONSTANT = ("pressure", "contraction", "length", "displacement", "load")  # a force that is the same says nothing


def with_constants(table: Table, stated: Mapping[str, Any], test: str) -> Table:
    """The table with a column for each constant `stated`, as in constant = { length = "160 mm" }."""
    for name, text in stated.items():
        with concerning("constant"):
            if name not in CONSTANT:
                raise unknown_name("column in constant:", name, CONSTANT)
            if name == "load" and test in FORCE_TESTS and (test != "static" or "force" in table):
                problem = f"constant: no load counts in a '{test}' recording, which measures the force"
                raise InputError(problem, value=text, cure="leave it out")
            if name in table:
                problem = f"constant: the recording has a column {table.heads[name]!r} for {name}"
                raise InputError(problem, value=text, cure="state it once: leave it out of constant")
            if str(text).startswith("?"):
                problem = f"constant: {name} is still to be filled in"
                raise InputError(problem, value=text, cure="write the value you measured")
            read = units.load_to_si if name == "load" else units.to_si
            value = read(text, str(COLUMNS[name]), name)
        table = replace(
            table,
            columns=table.columns | {name: np.full(len(table.row), value)},
            heads=table.heads | {name: name},
            units=table.units | {name: units.unit_of(str(text))},
        )
    return table
