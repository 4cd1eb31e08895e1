"""From what a position sensor reads to how far the muscle has shortened."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from fitting import units
from fitting.errors import InputError, concerning
from fitting.recordings.tables import Table

AT_REST = "position_at_rest"
OF_A_SENSOR = ("position_sign", AT_REST)  # keys that say how a displacement or a contraction was counted


def shortening(table: Table, options: Mapping[str, Any], position: str) -> np.ndarray:
    """The readings of the column `position`, counted from rest, shorter positive; a length as it is.

    `position_at_rest` is what the sensor reads there: a laser, an encoder or a crosshead has its zero anywhere.
    """
    if position == "length":
        for key in OF_A_SENSOR:
            if key in options:
                problem = f"{key} belongs to a displacement or a contraction, not to a length"
                raise InputError(problem, table.file, table.header_row, table.heads[position], cure=f"leave {key} out")
        return table[position]
    at_rest = 0.0
    if AT_REST in options:
        si = "1" if position == "contraction" else "m"
        with concerning(AT_REST):
            at_rest = units.to_si(options[AT_REST], si, AT_REST)
    return (table[position] - at_rest) * options.get("position_sign", 1)
