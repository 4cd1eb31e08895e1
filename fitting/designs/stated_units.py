"""The units that a design file uses: its answer is given in them, as that on a recording is in those of its file."""

from collections.abc import Iterator
from typing import Any

from fitting import units
from fitting.errors import InputError
from mckibben_jax.muscle import quantities

OWN = ("Pa", "N", "m")  # of which people have units of their own
# moduli and strengths of materials, which nobody gives in bar
OF_MATERIAL = tuple(name for name, (unit, _) in quantities().items() if unit == "Pa")


def stated_units(table: dict[str, Any]) -> tuple[dict[str, str], ...]:
    """SI unit -> the unit used for it, of every value in a design file; as `Experiment.units` of recordings."""
    return tuple({si: unit} for unit in _units_in(table) for si in OWN if _converts(unit, si))


def _units_in(value: Any) -> Iterator[str]:
    """The unit of every value in a table, but those of moduli and strengths."""
    if isinstance(value, dict):
        for key, each in value.items():
            if key not in OF_MATERIAL:
                yield from _units_in(each)
    elif isinstance(value, list):
        for each in value:
            yield from _units_in(each)
    elif isinstance(value, str) and (unit := _unit_of(value)):
        yield unit


def _unit_of(text: str) -> str | None:
    """The unit of a value with one; None of a name, a file or a plain number."""
    try:
        unit = units.unit_of(text)
    except InputError:
        return None
    return unit if unit and units.is_unit(unit) else None


def _converts(unit: str, si: str) -> bool:
    return units.dimension(unit) == units.dimension(si)
