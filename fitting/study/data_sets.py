"""Which data sets are meant, and what each is called: names of files have to differ."""

import glob
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from fitting.errors import InputError
from fitting.recordings.kinds import is_recording

WILD = "*?["


@dataclass(frozen=True)
class DataSet:
    """One data set: `name` is what its files are called."""

    name: str
    path: str  # as typed, or found by a pattern


@dataclass(frozen=True)
class Sets:
    """All that was asked for; `passed_by` counts what a pattern matched though it is no data set."""

    sets: tuple[DataSet, ...]
    passed_by: int


def data_sets(asked: Sequence[str], single: bool = False) -> Sets:
    """The data sets of paths and patterns, each once. `single` says that a pattern may mean single recordings too."""
    found: dict[Path, str] = {}
    passed_by = 0
    for text in asked:
        matches = _matches(text)
        chosen = matches if matches == [text] else [path for path in matches if _is_data(Path(path), single)]
        passed_by += len(matches) - len(chosen)
        if not chosen:
            what = "data sets (folders with muscle.toml)"
            raise InputError(f"the pattern finds no {what}", text, cure="put it in quotes, as in 'line/*'")
        for path in chosen:
            found.setdefault(Path(path).resolve(), path)
    names = _names([*found])
    return Sets(tuple(DataSet(names[place], path) for place, path in found.items()), passed_by)


def _matches(text: str) -> list[str]:
    """What a pattern finds; a path that exists, or has no wildcard, is itself."""
    if Path(text).exists() or not set(text) & set(WILD):
        return [text]
    return sorted(glob.glob(text, recursive=True))


def _is_data(path: Path, single: bool) -> bool:
    return (path / "muscle.toml").is_file() or (single and is_recording(path) and path.is_file())


def _names(places: Sequence[Path]) -> dict[Path, str]:
    """The last part of each path, and as many of those before it as it takes to tell it from the others."""
    names, depth = {place: _tail(place, 1) for place in places}, 1
    deepest = max((len(place.parts) for place in places), default=1)
    while depth < deepest:
        alike = {name for name, count in Counter(name.lower() for name in names.values()).items() if count > 1}
        if not alike:
            break
        depth += 1
        names |= {place: _tail(place, depth) for place, name in names.items() if name.lower() in alike}
    return names


def _tail(place: Path, depth: int) -> str:
    """The last parts of a path as a file's name. A single file goes without its ending."""
    parts = [*place.parts[:-1], place.name if place.is_dir() else place.stem]
    return "_".join(part.strip("/\\:") for part in parts[-depth:] if part.strip("/\\:")) or "data"
