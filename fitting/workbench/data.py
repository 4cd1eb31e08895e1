"""Files dropped into the workbench become the folder of a data set; what the headers do not say is asked for."""

import re
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import tomlkit

from fitting.errors import InputError
from fitting.recordings.kinds import ENDINGS, INSIDE, is_recording, recordings_in
from fitting.recordings.muscle_file import REQUIRED
from fitting.recordings.records import TESTS
from fitting.recordings.tables import COLUMNS, USUAL, plain_name, read_heads, split_head
from fitting.recordings.template import muscle_file
from fitting.units import example
from fitting.workbench.preview import ColumnPreview, previews
from fitting.writing import write_text, write_whole
from mckibben_jax.muscle import quantities

IGNORED = "not used"
ASKED = (*REQUIRED, "wall_thickness", "shear_modulus")  # of the muscle: needed always, needed by most effects
WRITTEN = {  # as a caliper's reading is written, with its standard error
    "length": "300 +/- 1 mm", "radius": "7.0 +/- 0.1 mm", "braid_angle": "20 +/- 1 deg",
    "wall_thickness": "1.0 +/- 0.1 mm",
}  # fmt: skip
SUFFIXES = (*ENDINGS, ".toml")
PLACE = "mckibben_workbench_"  # how the folder begins in which a session keeps what is dropped


@dataclass(frozen=True)
class Column:
    """One column of a dropped file: what it is called there, what it most likely is, and its unit."""

    head: str
    meaning: str  # a name of the program's, or IGNORED
    unit: str


@dataclass(frozen=True)
class Dropped:
    """A folder of recordings that lacks a muscle.toml, with guesses for what is asked and what the files hold."""

    folder: Path
    tests: dict[str, str]  # file -> most likely kind of test
    columns: dict[str, tuple[Column, ...]]
    previews: dict[str, tuple[ColumnPreview, ...]]
    inside: dict[str, dict[str, str]] = field(default_factory=dict)  # file -> which sheet, variable or topic of it


def keep(files: Sequence[tuple[str, bytes]], folder: Path) -> Path:
    """Write dropped files into an empty folder, by their plain names; nothing but tables and toml is taken."""
    names = [Path(name.replace("\\", "/")).name for name, _ in files]
    for name in names:
        if Path(name).suffix.lower() not in SUFFIXES:
            cure = f"drop the files of one data set: muscle.toml and {', '.join(ENDINGS)}"
            raise InputError("this is no recording and no muscle.toml", name, cure=cure)
    for name in {name for name in names if names.count(name) > 1}:
        raise InputError("two of the files have one name", name, cure="drop one data set at a time")
    for name, (_, content) in zip(names, files, strict=True):
        write_whole(folder / name, partial(_write_bytes, content=content))
    if not any(is_recording(Path(name)) for name in names):
        raise InputError("there is no recording among them", ", ".join(names), cure="drop the recordings as well")
    return folder


def _write_bytes(path: Path, content: bytes) -> None:
    path.write_bytes(content)


def without_place(text: str, place: str) -> str:
    """A message in which dropped files have their plain names: where they are kept is nobody's concern."""
    return re.sub(rf"{re.escape(place)}[\\/][^\\/]+[\\/]", "", text)


def is_dropped(folder: Path) -> bool:
    """Whether a session keeps these data, and not their owner."""
    return folder.resolve().parent.name.startswith(PLACE)


def is_described(folder: Path) -> bool:
    """Whether the folder says what was measured."""
    return (folder / "muscle.toml").is_file()


def guess(folder: Path) -> Dropped:
    """What the files most likely are, as `mckibben init` guesses it."""
    found = tomllib.loads(muscle_file(folder)).get("recording", [])
    entries = {entry["file"]: entry for entry in reversed(found)}  # of several sheets the first
    inside = {file: {key: entry[key] for key in INSIDE if key in entry} for file, entry in entries.items()}
    files = recordings_in(folder)
    columns = {p.name: _columns(p, entries.get(p.name, {}), inside.get(p.name, {})) for p in files}
    tests = {p.name: entries.get(p.name, {}).get("test", TESTS[0]) for p in files}
    return Dropped(folder, tests, columns, {p.name: previews(p, inside.get(p.name, {})) for p in files}, inside)


def _columns(path: Path, entry: dict[str, Any], inside: dict[str, str]) -> tuple[Column, ...]:
    called = {head: name for name, head in entry.get("columns", {}).items()}
    found = []
    for head in read_heads(path, inside):
        meaning = called.get(head) or (plain_name(head) if plain_name(head) in COLUMNS else IGNORED)
        found.append(Column(head, meaning, split_head(head)[1] or ""))
    return tuple(found)


def unit_hint(meaning: str) -> str:
    """What such a column is mostly given in."""
    return USUAL.get(COLUMNS.get(meaning) or "", "")


def muscle_hint(name: str) -> tuple[str, str]:
    """What a measurement of the muscle means, and how one writes it."""
    unit, meaning = quantities()[name]
    return meaning, WRITTEN.get(name, example(unit))


def describe(
    dropped: Dropped,
    name: str,
    muscle: Mapping[str, str],
    tests: Mapping[str, str],
    columns: Mapping[str, Sequence[tuple[str, str]]],
) -> Path:
    """Write muscle.toml from what was filled in: values of the muscle, and of each column its meaning and unit."""
    document = tomlkit.document()
    document["name"] = name or "dropped data"
    for key in REQUIRED:
        if not muscle.get(key, "").strip():
            meaning, how = muscle_hint(key)
            raise InputError(f"{key} is not filled in: {meaning}", cure=f"write it like {how}")
    document["muscle"] = {key: text.strip() for key, text in muscle.items() if text.strip()}
    recordings = tomlkit.aot()
    for file, found in dropped.columns.items():
        recordings.append(_recording(file, tests[file], found, columns[file], dropped.inside.get(file, {})))
    document["recording"] = recordings
    write_text(dropped.folder / "muscle.toml", tomlkit.dumps(document))
    return dropped.folder


def _recording(
    file: str, test: str, found: Sequence[Column], filled: Sequence[tuple[str, str]], inside: Mapping[str, str]
) -> Any:
    table = tomlkit.table()
    table["file"], table["test"] = file, test
    table.update(inside)
    called, given = {}, {}
    for column, (meaning, unit) in zip(found, filled, strict=True):
        if meaning == IGNORED:
            continue
        if meaning in called:
            cure = "choose another meaning for one of them"
            raise InputError(f"two columns are the {meaning}", file, column=column.head, cure=cure)
        called[meaning] = column.head
        if COLUMNS[meaning] is not None and unit.strip() and unit.strip() != (split_head(column.head)[1] or ""):
            given[meaning] = unit.strip()
    if called:
        table["columns"] = tomlkit.inline_table()
        table["columns"].update(called)
    if given:
        table["units"] = tomlkit.inline_table()
        table["units"].update(given)
    return table
