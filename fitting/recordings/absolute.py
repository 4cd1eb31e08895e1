"""Pressures that a gauge counts from vacuum: what is taken off them, and what their columns say of it."""

from collections.abc import Mapping
from typing import Any

from fitting import showing, units
from fitting.errors import InputError
from fitting.recordings.checks import PRESSURES
from fitting.recordings.tables import Table, is_absolute

ABSOLUTE, GAUGE = "absolute", "gauge"
AMBIENTS = (0.4e5, 1.2e5)  # Pa; of every laboratory, however high it lies
UNKNOWN_AMBIENT = 2e3  # Pa, one standard deviation: weather and some 100 m of height; chosen


def ambient_of(options: Mapping[str, Any]) -> float:
    """The pressure of the air that is taken off the readings of a recording, Pa: 0 where they are a gauge's."""
    if options.get("pressure") != ABSOLUTE:
        return 0.0
    return units.ATMOSPHERE if "ambient" not in options else units.to_si(options["ambient"], "Pa", "ambient")


def is_presumed(options: Mapping[str, Any]) -> bool:
    """Whether pressures are absolute and nobody said what the air's was."""
    return options.get("pressure") == ABSOLUTE and "ambient" not in options


def check_absolute(table: Table, options: Mapping[str, Any]) -> None:
    """Refuse a column whose unit says that it is absolute where the recording does not, and an impossible ambient."""
    stated = options.get("pressure")
    for name in table.absolute if stated != ABSOLUTE else ():
        cure = 'write pressure = "absolute" in its [[recording]]'
        if stated == GAUGE:
            cure = f'write units = {{ {name} = "{table.units[name]}" }} if the readings are a gauge\'s, else {cure}'
        problem = "the unit of this column says that its pressures are absolute"
        raise InputError(problem, table.file, table.header_row, table.heads[name], cure=cure)
    if "ambient" in options and stated != ABSOLUTE:
        cure = 'write pressure = "absolute" too, or leave ambient out'
        raise InputError("ambient belongs to absolute pressures", table.file, value=options["ambient"], cure=cure)
    ambient = ambient_of(options)
    if stated == ABSOLUTE and not AMBIENTS[0] <= ambient <= AMBIENTS[1]:
        cure = 'write what a barometer read in the laboratory: ambient = "1005 hPa"'
        raise InputError("no air has this pressure", table.file, value=showing.show(ambient, "Pa"), cure=cure)


def absolute_notes(table: Table, options: Mapping[str, Any]) -> list[str]:
    """What was taken off absolute pressures; a question where a column calls itself so and is read as a gauge's."""
    if is_presumed(options):
        return [
            f"{showing.show(units.ATMOSPHERE, 'Pa', unit='hPa', digits=5)} were taken off the absolute pressures. The "
            'air changes by 20 hPa with the weather and by 12 hPa with 100 m of height: ambient = "1005 hPa" in the '
            "[[recording]] says what a barometer read"
        ]
    heads = [table.heads[name] for name in PRESSURES if name in table.heads]
    if "pressure" in options:
        return []
    return [
        f"the column {head!r} is read as pressure above the atmosphere (gauge): if it is absolute, as it is called, "
        'write pressure = "absolute" in its [[recording]]; if not, write pressure = "gauge"'
        for head in heads
        if is_absolute(head)
    ]
