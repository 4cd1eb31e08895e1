"""Where identified muscles lie: those that ship with the program, and those that a user added."""

import os
import shutil
from collections.abc import Callable
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


def shelf(on_unread: Callable[[InputError], None] = lambda _: None) -> tuple[Shelved, ...]:
    """Every identified muscle: the shipped ones first, then the user's, by name.

    One of the user's that cannot be read is passed by; `on_unread` is told why.
    """
    own = []
    for path in _records(own_folder()):
        try:
            own.append(Shelved(path.parent, False, Identified.read(path.parent)))
        except InputError as error:
            on_unread(error)
    shipped = [path.parent for path in _records(shipped_folder() / SHIPPED)]
    return (*(Shelved(folder, True, Identified.read(folder)) for folder in shipped), *own)


def _records(place: Path) -> list[Path]:
    return sorted(place.glob(f"*/{FILE}"))


def named(name: str) -> Shelved:
    """The muscle of this name, or in the folder of this path."""
    there = Path(name)
    if (there / FILE).is_file():
        return Shelved(there, False, Identified.read(there))
    found = [each for each in shelf() if each.muscle.name == name]
    if not found:
        raise unknown_name("identified muscle", name, [each.muscle.name for each in shelf()])
    if len(found) > 1:
        cure = f"name its folder: {' or '.join(str(each.folder) for each in found)}"
        raise InputError("several identified muscles have this name", value=name, cure=cure)
    return found[0]


def check_name(name: str, place: Path) -> None:
    """Refuse a name that another muscle has, or that is no name of a folder."""
    if not name or name.startswith(".") or set(name) & set('/\\:*?"<>|\n'):
        cure = "give it a short one with --name, for example --name hose_25cm"
        raise InputError("this is no name for a muscle and its folder", value=name, cure=cure)
    taken = [each.folder for each in shelf() if each.muscle.name == name]
    taken += [place / name] if (place / name).exists() else []
    if taken:
        cure = "give it another name with --name, or remove the folder"
        raise InputError("there is a muscle of this name already, and it is left alone", taken[0], cure=cure)


def put(muscle: Identified, experiment: Experiment, model: Path, place: Path) -> Path:
    """Write the folder of a muscle whole: its data, its model, its record. InputError where one is there already."""
    check_name(muscle.name, place)
    folder, files = (
        place / muscle.name,
        ["muscle.toml", *dict.fromkeys(each.stored_in for each in experiment.recordings)],
    )
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
