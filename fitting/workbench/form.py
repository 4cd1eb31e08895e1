"""The form for what dropped files do not say: its fields, muscle.toml written from them, and what is wrong in which."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import tomlkit

from fitting import units
from fitting.errors import InputError
from fitting.recordings.heads import COLUMNS, USUAL, split_head
from fitting.recordings.muscle_file import REQUIRED, measurement, read_muscle_table
from fitting.recordings.position import AT_REST, OF_A_SENSOR
from fitting.workbench.data import IGNORED, Column, Dropped
from fitting.writing import write_text
from mckibben_jax.muscle import Muscle, quantities

ASKED = (*REQUIRED, "wall_thickness", "shear_modulus")  # of the muscle: needed always, needed by most effects


class Size(NamedTuple):
    """A measurement of the muscle as it is filled in: its value, its standard error, and the unit of both."""

    value: str = ""
    error: str = ""
    unit: str = ""

    @property
    def text(self) -> str:
        """As muscle.toml has it; empty where no value is filled in."""
        error = f" +/- {self.error.strip()}" if self.error.strip() else ""
        return f"{self.value.strip()}{error} {self.unit.strip()}".strip() if self.value.strip() else ""


LIKE = {  # what is written into the fields, for example; the unit stands there from the start
    "length": Size("300", "1", "mm"), "radius": Size("7.0", "0.1", "mm"), "braid_angle": Size("20", "1", "deg"),
    "wall_thickness": Size("1.0", "0.1", "mm"), "shear_modulus": Size("0.5", "0.05", "MPa"),
}  # fmt: skip


@dataclass(frozen=True)
class Filled:
    """What was filled in: of the muscle, the kind of test of each file, meaning and unit of each column of each."""

    muscle: Mapping[str, Size]
    tests: Mapping[str, str]
    columns: Mapping[str, Sequence[tuple[str, str]]]
    at_rest: str = ""  # what a position sensor with a zero of its own reads at the length at rest, with its unit


def unit_hint(meaning: str) -> str:
    """What such a column is mostly given in."""
    return USUAL.get(COLUMNS.get(meaning) or "", "")


def spoken(name: str) -> str:
    """What readers call a measurement of the muscle."""
    return name.replace("_", " ")


def meaning_of(name: str) -> str:
    """What a measurement of the muscle is."""
    return quantities()[name][1]


# What is wrong, and where ---------------------------------------------------------------------------------------------


def column_field(file: str, number: int) -> str:
    """The name of the field of a column; that of a file is the file's, that of a measurement the measurement's."""
    return f"{file}/{number}"


def wrong_fields(dropped: Dropped, filled: Filled) -> dict[str, str]:
    """Field -> what is wrong with it and the cure, of everything that can be told without reading the recordings."""
    wrong = {}
    for key in ASKED:
        try:
            _check_measurement(key, filled.muscle.get(key, Size()))
        except InputError as error:
            wrong[key] = _said(error, row=None)
    if dropped.elsewhere:
        try:
            units.to_si(filled.at_rest, "m", "this reading")
        except InputError as error:
            wrong[AT_REST] = _said(error, row=None)
    for file, columns in dropped.columns.items():
        wrong |= dict(_wrong_columns(file, columns, filled.columns[file]))
    return wrong


def field_of(dropped: Dropped, error: InputError) -> dict[str, str]:
    """What is wrong in reading the recordings, at the field that it belongs to; empty where it belongs to none."""
    file = "" if error.file is None else Path(error.file).name
    if file == "muscle.toml" and error.key in ASKED:
        return {error.key: _said(error, row=None)}
    if file not in dropped.columns:
        return {}
    heads = [column.head for column in dropped.columns[file]]
    if error.column in heads:
        return {column_field(file, heads.index(error.column)): _said(error, error.row)}
    return {file: _said(error, error.row)}


def _check_measurement(key: str, size: Size) -> None:
    if not size.text:
        if key in REQUIRED or size.error.strip():
            problem = f"the value of {spoken(key)} is not filled in: {meaning_of(key)}"
            raise InputError(problem, cure=f"write it like {LIKE[key].value}")
        return
    for what, text in (("value", size.value), ("error", size.error)):
        _check_number(f"the {what} of {spoken(key)}", text.strip())
    unit = quantities()[key][0]
    if size.unit.strip():
        units.factor(size.unit.strip(), unit)
    found = measurement(key, size.text)
    if found.error is not None and found.error >= abs(found.value):
        cure = "write the standard error, in the same unit"
        raise InputError(f"the error of {spoken(key)} is as large as its value", value=size.text, cure=cure)


def _check_number(what: str, text: str) -> None:
    try:
        float(text or "0")
    except ValueError:
        cure = "write a number with a decimal point here, and its unit in the field for it"
        raise InputError(f"{what} is not a number", value=text, cure=cure) from None


def _wrong_columns(
    file: str, columns: Sequence[Column], filled: Sequence[tuple[str, str]]
) -> Iterator[tuple[str, str]]:
    first: dict[str, str] = {}
    for number, (column, (meaning, unit)) in enumerate(zip(columns, filled, strict=True)):
        if meaning == IGNORED:
            continue
        try:
            if meaning in first:
                cure = "choose another meaning for one of them"
                raise InputError(f"{first[meaning]!r} is the {meaning} already", cure=cure)
            _check_unit(meaning, unit.strip() or split_head(column.head)[1] or "")
        except InputError as error:
            yield column_field(file, number), _said(error, row=None)
        first.setdefault(meaning, column.head)


def _check_unit(meaning: str, unit: str) -> None:
    si = COLUMNS[meaning]
    if si is None:
        return
    if not unit:
        raise InputError(f"the unit of the {meaning} is not filled in", cure=f"write for example {USUAL[si]}")
    if si == "load":
        units.load_factor(unit)
    else:
        units.factor(unit, si)


def _said(error: InputError, row: int | None) -> str:
    """The message without file and column, which the field shows."""
    return str(InputError(error.problem, None, row, None, error.value, error.cure))


def muscle_of(sizes: Mapping[str, Size]) -> Muscle | str:
    """The muscle that is filled in, or what is wrong with it; nothing is said while something is missing."""
    try:
        for key in ASKED:
            _check_measurement(key, sizes.get(key, Size()))
        texts = {key: size.text for key, size in sizes.items() if size.text}
        return read_muscle_table(texts, Path("muscle.toml"), b"")[0]
    except InputError as error:
        return _said(error, row=None) if all(sizes.get(key, Size()).text for key in REQUIRED) else ""


def name_of(dropped: Dropped) -> str:
    """What the data set is called: as its first file."""
    return Path(next(iter(dropped.columns))).stem


# Written down ---------------------------------------------------------------------------------------------------------


def describe(dropped: Dropped, name: str, filled: Filled) -> Path:
    """Write muscle.toml into the folder of the recordings; of fields in which nothing is wrong."""
    document = tomlkit.document()
    document["name"] = name or "dropped data"
    document["muscle"] = {key: size.text for key, size in filled.muscle.items() if size.text}
    recordings = tomlkit.aot()
    for file in dropped.columns:
        recordings.append(_recording(dropped, file, filled))
    document["recording"] = recordings
    write_text(dropped.folder / "muscle.toml", tomlkit.dumps(document))
    return dropped.folder


def _recording(dropped: Dropped, file: str, filled: Filled) -> Any:
    table = tomlkit.table()
    table["file"], table["test"] = file, filled.tests[file]
    table.update(dropped.inside.get(file, {}) | dropped.kept.get(file, {}))
    if file in dropped.elsewhere:
        table[AT_REST] = filled.at_rest.strip()
    called, given = {}, {}
    for column, (meaning, unit) in zip(dropped.columns[file], filled.columns[file], strict=True):
        if meaning == IGNORED:
            continue
        called[meaning] = column.head
        if COLUMNS[meaning] is not None and unit.strip() and unit.strip() != (split_head(column.head)[1] or ""):
            given[meaning] = unit.strip()
    if "length" in called:  # whoever calls it so says that it is counted from nowhere else
        for key in {*OF_A_SENSOR} & {*table}:
            del table[key]
    for key, texts in (("columns", called), ("units", given)):
        if texts:
            table[key] = tomlkit.inline_table()
            table[key].update(texts)
    return table
