"""Where identified muscles lie: those that ship with the program, and those that a user added."""

import os
import shutil
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from fitting.errors import InputError, unknown_name
from fitting.identified.record import FILE, Identified
from fitting.recordings.records import Experiment
from fitting.shipped import shipped_folder
from fitting.study.request import MODEL_FILE
from fitting.writing import refused, write_replacing

SHIPPED = "identified"  # among the shipped data


@dataclass(frozen=True)
class Shelved:
    """An identified muscle with the folder that holds its data and its model."""

    folder: Path
    is_shipped: bool
    muscle: Identified


def own_folder() -> Path:
    """Where a user's own muscles are kept."""
    base = os.environ.get("XDG_DATA_HOME") or (Path.home() / ".local" / "share")
    return Path(os.environ.get("MCKIBBEN_LIBRARY") or Path(base) / "mckibben" / "library")


def shelf() -> tuple[Shelved, ...]:
    """Every identified muscle: the shipped ones first, then the user's, by name."""
    return (*_in(shipped_folder() / SHIPPED, True), *_in(own_folder(), False))


def _in(place: Path, is_shipped: bool) -> Iterator[Shelved]:
    for path in sorted(place.glob(f"*/{FILE}")):
        yield Shelved(path.parent, is_shipped, Identified.read(path.parent))


def named(name: str) -> Shelved:
    """The muscle of this name, or in the folder of this path."""
    there = Path(name)
    if (there / FILE).is_file():
        return Shelved(there, False, Identified.read(there))
    found = {each.muscle.name: each for each in shelf()}
    if name not in found:
        raise unknown_name("identified muscle", name, found)
    return found[name]


def put(muscle: Identified, experiment: Experiment, model: Path, place: Path) -> Path:
    """Write the folder of a muscle whole: its data, its model, its record. InputError where one is there already."""
    folder = place / muscle.name
    if folder.exists():
        cure = "give it another name with --name, or remove the folder"
        raise InputError("there is a muscle of this name already, and it is left alone", folder, cure=cure)
    files = ["muscle.toml", *dict.fromkeys(name for each in experiment.recordings for name in each.file.split(", "))]
    for name in files:
        if Path(name).is_absolute() or ".." in Path(name).parts:
            cure = "move it beside muscle.toml, so that the folder can be sent to others"
            raise InputError("a recording lies outside of its data set", experiment.folder / name, cure=cure)

    def write(new: Path) -> None:
        for name in files:
            (new / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(experiment.folder / name, new / name)
        shutil.copyfile(model, new / MODEL_FILE)
        muscle.write(new)

    try:
        place.mkdir(parents=True, exist_ok=True)
        write_replacing(folder, write)
    except OSError as error:
        raise refused(folder, error) from None
    return folder
