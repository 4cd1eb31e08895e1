"""What reading the data noted, each thing once: what several files have in common is said of them together."""

import re
from collections.abc import Iterable, Sequence

from fitting.recordings.records import Experiment

NAMED = 3  # files by their names; of more, the first ones and a count
NUMBER = re.compile(r"(?<![\w.])\d[\d,]*(?:\.\d+)?(?:e-?\d+)?(?!\w)")
OF_ROWS = "(row"  # a note that says where in its file something stands is said of that file alone

Noted = tuple[str, str]  # the file, and what was noted of it


def notes_of(experiments: Sequence[Experiment]) -> tuple[str, ...]:
    """Notes on data sets as a whole, and then on their files, which are named where there are several."""
    several = sum(bool(e.recordings) for e in experiments) > 1
    notes = _one_muscle(experiments)
    for e in experiments:
        notes += [f"{e.name}: {note}" if several else note for note in e.notes]
        notes += [f"{e.name}, {note}" if several else note for note in _of_files(e, several)]
    return tuple(notes)


def _one_muscle(experiments: Sequence[Experiment]) -> list[str]:
    """Notes on data sets whose muscles are stated alike: each gets a geometry of its own, which one muscle has not."""
    alike: dict[tuple, list[str]] = {}
    for e in experiments:
        sizes = map(float, (e.muscle.length, e.muscle.radius, e.muscle.braid_angle))
        alike.setdefault((*sizes, *sorted(e.priors.items())), []).append(e.name)
    return [
        f"{_listed(names, 'data sets')}: the same sizes are stated, and each data set gets a geometry of its own; if "
        "this is one muscle, name all its recordings in one muscle.toml"
        for names in alike.values()
        if len(names) > 1
    ]


def _of_files(experiment: Experiment, named: bool) -> list[str]:
    """Notes on the files of one data set; a single file is called by its name if it is to be `named`."""
    files = list(dict.fromkeys(each.file for each in experiment.recordings))
    noted = [(each.file, note) for each in experiment.recordings for note in each.notes]
    if len(files) == 1 and not named:
        return [note for _, note in noted]
    return said_of(noted, files)


def said_of(noted: Sequence[Noted], files: Sequence[str]) -> list[str]:
    """Notes behind the names of those of the `files` of a data set that they are about."""
    return [f"{_called(of, files)}: {note}" for of, note in _together(noted)]


def _together(noted: Iterable[Noted]) -> list[tuple[list[str], str]]:
    """Files and what is noted of all of them, in the order of the first; notes may differ in numbers alone."""
    alike: dict[tuple[str, int], list[Noted]] = {}
    for file, note in noted:
        kind = note if OF_ROWS in note or file in note else NUMBER.sub("#", note)
        times = 0  # a file may have several of a kind: the first go together, the second, and so on
        while any(other == file for other, _ in alike.get((kind, times), ())):
            times += 1
        alike.setdefault((kind, times), []).append((file, note))
    return [([file for file, _ in group], _merged([note for _, note in group])) for group in alike.values()]


def _merged(notes: Sequence[str]) -> str:
    """One note for several that differ in numbers alone: the least and the largest of each."""
    found = [NUMBER.findall(note) for note in notes]
    spans = iter([_span(numbers) for numbers in zip(*found, strict=True)])
    return NUMBER.sub(lambda _: next(spans), notes[0])


def _span(numbers: Sequence[str]) -> str:
    order = sorted(numbers, key=lambda number: float(number.replace(",", "")))
    return order[0] if order[0] == order[-1] else f"{order[0]} to {order[-1]}"


def _called(some: Sequence[str], files: Sequence[str]) -> str:
    """How some of the files of a data set are called."""
    if len(some) == len(files) > 1:
        return "every file"
    return _listed(some, "files")


def _listed(names: Sequence[str], what: str) -> str:
    if len(names) <= NAMED:
        return ", ".join(names)
    return f"{', '.join(names[: NAMED - 1])} and {len(names) - NAMED + 1} more {what}"
