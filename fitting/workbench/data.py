"""Files dropped into the workbench become the folder of a data set; what their columns are is guessed."""

import re
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

from fitting.errors import InputError
from fitting.recordings.heads import COLUMNS, plain_name, split_head
from fitting.recordings.kinds import ENDINGS, INSIDE, is_recording, recordings_in
from fitting.recordings.position import AT_REST
from fitting.recordings.records import TESTS
from fitting.recordings.tables import read_heads
from fitting.recordings.template import muscle_file
from fitting.workbench.preview import ColumnPreview, previews
from fitting.writing import write_whole

IGNORED = "not used"
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
    kept: dict[str, dict[str, Any]] = field(default_factory=dict)  # file -> guesses that the form does not ask
    elsewhere: tuple[str, ...] = ()  # files in which the position is not 0 where the muscle is at rest


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


KEPT = ("pressure", "position_sign")  # what the readings show and no field of the form asks


def guess(folder: Path) -> Dropped:
    """What the files most likely are, as `mckibben init` guesses it."""
    found = tomllib.loads(muscle_file(folder)).get("recording", [])
    entries = {entry["file"]: entry for entry in reversed(found)}  # of several sheets the first
    inside = {file: {key: entry[key] for key in INSIDE if key in entry} for file, entry in entries.items()}
    kept = {file: {key: entry[key] for key in KEPT if key in entry} for file, entry in entries.items()}
    files = recordings_in(folder)
    columns = {p.name: _columns(p, entries.get(p.name, {}), inside.get(p.name, {})) for p in files}
    tests = {p.name: entries.get(p.name, {}).get("test", TESTS[0]) for p in files}
    elsewhere = tuple(file for file, entry in entries.items() if AT_REST in entry)
    shown = {p.name: previews(p, inside.get(p.name, {})) for p in files}
    return Dropped(folder, tests, columns, shown, inside, kept, elsewhere)


def _columns(path: Path, entry: dict[str, Any], inside: dict[str, str]) -> tuple[Column, ...]:
    called = {head: name for name, head in entry.get("columns", {}).items()}
    found = []
    for head in read_heads(path, inside):
        meaning = called.get(head) or (plain_name(head) if plain_name(head) in COLUMNS else IGNORED)
        found.append(Column(head, meaning, split_head(head)[1] or ""))
    return tuple(found)
