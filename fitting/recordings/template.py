"""`mckibben init`: a muscle.toml to fill in, with what can be told from the recordings of a folder."""

import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from fitting.errors import InputError, nearest
from fitting.recordings.accuracy_template import accuracy_lines
from fitting.recordings.kinds import parts_of, recordings_in
from fitting.recordings.muscle_file import REQUIRED
from fitting.recordings.records import TESTS
from fitting.recordings.tables import COLUMNS, Table, plain_name, read_heads, read_table, split_head
from fitting.showing import shown_in
from fitting.units import dimension, is_unit
from fitting.writing import FULL, refused, text_replaced
from mckibben_jax.muscle import quantities

# words in a header that betray what a column is, in English and in what loggers write
WORDS = {
    "set_pressure": ("set point", "setpoint", "command", "desired", "soll"),
    "pressure": ("pressure", "druck", "press"),
    "force": ("force", "load cell", "loadcell", "kraft", "tension", "pull"),
    "load": ("load", "mass", "weight", "last"),
    "time": ("time", "zeit", "stamp"),
    "contraction": ("contraction", "strain", "shortening ratio"),
    "displacement": ("displacement", "shortening", "stroke", "travel", "weg"),
    "length": ("length", "position", "laser"),
    "run": ("run", "trial", "experiment", "cycle no"),
    "branch": ("branch", "direction"),
}
LETTERS = {"t": "time", "p": "pressure", "f": "force", "l": "length", "eps": "contraction", "x": "displacement"}
FILE_WORDS = (("release", "quick release"), ("isotonic", "isotonic"), ("isometri", "isometric"), ("step", "step"),
         ("static", "static"), ("loop", "loop"))  # fmt: skip
TYPICAL = {
    "shear_modulus": 1e6,
    "mooney_c10": 1e6,
    "mooney_c01": 1e6,
    "strand_modulus": 1e9,
    "breaking_stress": 1e6,
}  # Pa
HUNG_LOADS = 20  # different readings of a load at most, where weights are hung on
HELD_LENGTHS = 30  # different readings of the length at most, in an isometric test without noise
STRETCHES, STANDING = 50, 0.7  # of a recording; share of them in which an isometric test leaves the length as it was


def write_muscle_file(folder: Path | str) -> Path:
    """Write muscle.toml into a folder; an existing one is left alone, with an error that says so."""
    folder = Path(folder)
    if not folder.is_dir():
        raise InputError("no such folder", folder, cure="make it and put the recordings into it")
    if not recordings_in(folder):
        cure = "put the recordings into it first: CSV, Excel (.xlsx), MATLAB (.mat), LabVIEW (.tdms) or ROS 2 (.mcap)"
        raise InputError("no recording is in this folder", folder, cure=cure)
    path = folder / "muscle.toml"
    if path.exists():
        raise InputError("the file is there already and is left alone", path, cure="edit it, or rename it")
    try:
        text_replaced(path, muscle_file(folder))
    except OSError as error:
        raise refused(path, error, "" if error.errno in FULL else "check the folder's rights") from None
    return path


def muscle_file(folder: Path) -> str:
    """The text of a muscle.toml for this folder; a question mark stands where something is to be filled in."""
    files = recordings_in(folder)
    parts = [_muscle_part(folder), *(_recording_part(file, inside) for file in files for inside in parts_of(file))]
    if not files:
        parts.append('# [[recording]]\n# file = "loops.csv"\n# test = "loop"\n')
    return "\n".join([*parts, '[source]\ncitation = ""\nlicence  = ""\n'])


def _muscle_part(folder: Path) -> str:
    return "\n".join(_muscle_lines(folder)) + "\n"


def _muscle_lines(folder: Path) -> Iterator[str]:
    yield f"name = {_quoted(folder.resolve().name)}"
    yield ""
    yield '# Write a value for every "?". A value with +/- (standard uncertainty) is fitted, one without is exact.'
    yield "[muscle]"
    known = quantities()
    for key, written in REQUIRED.items():
        assignment = f'{key} = "? {written.split()[-1]}"'
        yield f'{assignment:<28} # {known[key][1]}; for example "{written}"'
    yield "# optional:"
    for key, (unit, meaning) in known.items():
        if key not in REQUIRED:
            assignment = f'# {key} = "{f"? {shown_in(unit, TYPICAL.get(key, 0))[0]}".strip()}"'
            yield f"{assignment:<28} # {meaning}"
    yield '# hardness = "? IRHD"        # instead of shear_modulus'
    yield '# cord_length = "? mm"       # with turns = "?" instead of braid_angle: one strand and its turns'


def _recording_part(path: Path, inside: dict[str, str]) -> str:
    return "\n".join(_recording_lines(path, inside)) + "\n"


def _recording_lines(path: Path, inside: dict[str, str]) -> Iterator[str]:
    """One [[recording]]: the kind of test and the columns as far as they can be told."""
    try:
        heads = read_heads(path, inside)
    except InputError as error:
        yield f"# {path.name} is left out: {error.problem}. {error.cure}"
        return
    called = _columns(heads)
    if inside and not called:
        yield f"# {path.name}, {' '.join((*inside, *inside.values()))}, is left out: none of its columns is known"
        return
    if "load" in called and "force" not in called and _is_reading(path, called["load"], inside):
        called["force"] = called.pop("load")
    unused = [head for head in heads if head not in called.values()]
    named = {name: head for name, head in called.items() if plain_name(head) != name}
    units = {name: "?" for name, head in called.items() if COLUMNS[name] is not None and not split_head(head)[1]}
    any_units = {name: {"load": "N"}.get(name, str(COLUMNS[name])) for name in units}  # only whether readings differ
    table = _table_of(path, named, any_units, inside)
    if table is not None and table.has_stamps:
        units.pop("time", None)  # they need none
    test = _test(" ".join((path.stem, *inside.values())), table, set(called))
    yield "[[recording]]"
    yield f"file = {_quoted(path.name)}"
    yield from (f"{option} = {_quoted(name)}" for option, name in inside.items())
    yield f'test = "{test}"   # a guess: {", ".join(TESTS)}'
    if named:
        yield f"columns = {_table(named)}   # a guess"
    if units:
        yield f"units = {_table(units)}"
    if unused:
        yield f"# not used: {', '.join(_quoted(head) for head in unused)}; if one is needed, name it in `columns`"
    yield '# noise = "0.5 N"        # standard deviation of one reading, if known'
    yield '# pressure = "absolute"  # gauge is presumed'
    yield "# force_sign = -1        # where the rig counts pulling as negative"
    yield from accuracy_lines(_table_of(path, named, units, inside), test, called)


def _table(entries: dict[str, str]) -> str:
    return "{ " + ", ".join(f"{name} = {_quoted(text)}" for name, text in entries.items()) + " }"


def _quoted(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)  # a JSON string is a TOML string


def _columns(heads: list[str]) -> dict[str, str]:
    """What the columns most likely are: by their own name, by a word in it, by a letter, by a unit of its own."""
    found: dict[str, str] = {}
    for guess in (_by_name, _by_word, _by_letter):
        for head in heads:
            name = guess(head)
            if name and name not in found and head not in found.values() and not _second_position(name, found):
                found[name] = head
    for name, head in _by_unit([head for head in heads if found and head not in found.values()]):
        if name not in found and not _second_position(name, found):
            found[name] = head
    return {name: found[name] for name in COLUMNS if name in found}


def _second_position(name: str, found: dict[str, str]) -> bool:
    positions = ("contraction", "length", "displacement")
    return name in positions and any(other in found for other in positions)


def _by_name(head: str) -> str | None:
    return plain_name(head) if plain_name(head) in COLUMNS else nearest(plain_name(head), COLUMNS, 0.85)


def _by_word(head: str) -> str | None:
    text = split_head(head)[0].lower().replace("_", " ")
    return next((name for name, words in WORDS.items() if any(word in text for word in words)), None)


def _by_letter(head: str) -> str | None:
    return LETTERS.get(plain_name(head))


def _by_unit(heads: list[str]) -> Iterator[tuple[str, str]]:
    """What columns are of which no name is known, where only one of them has such a unit."""
    for name in ("time", "pressure", "displacement", "force"):
        alike = [head for head in heads if _has_unit_of(head, str(COLUMNS[name]))]
        if len(alike) == 1:
            yield name, alike[0]


def _has_unit_of(head: str, si: str) -> bool:
    unit = split_head(head)[1]
    return bool(unit) and is_unit(unit) and dimension(unit) == dimension(si)


def _test(name: str, table: Table | None, names: set[str]) -> str:
    """The kind of test: by the name of file or sheet, by the columns, by whether the length moves."""
    words = name.lower().replace("_", " ")
    for word, test in FILE_WORDS:
        if word in words:
            return test
    if "load" in names and "force" not in names:
        return "step" if "set_pressure" in names else "isotonic"
    if "time" not in names:
        return "static"
    return "isometric" if table is not None and _length_is_held(table) else "loop"


def _is_reading(path: Path, head: str, inside: dict[str, str]) -> bool:
    """Whether a column called load is what a load cell reads: weights that are hung on have few values."""
    table = _table_of(path, {"load": head}, {} if split_head(head)[1] else {"load": "N"}, inside)
    return table is not None and len(np.unique(table["load"])) > HUNG_LOADS


def _table_of(path: Path, named: dict[str, str], units: dict[str, str], inside: dict[str, str]) -> Table | None:
    """The readings, where they can be read."""
    try:
        return read_table(path, named, units, inside)
    except InputError:
        return None


def _length_is_held(table: Table) -> bool:
    position = next((table[name] for name in ("contraction", "length", "displacement") if name in table), None)
    if position is None:
        return False
    return len(np.unique(position)) <= min(HELD_LENGTHS, len(position) // 5) or _stands(position)


def _stands(position: np.ndarray) -> bool:
    """Whether a noisy reading mostly stands: from stretch to stretch its median moves by less than the noise."""
    if len(position) < 2 * STRETCHES:
        return False
    noise = 1.48 * np.median(np.abs(np.diff(position))) / np.sqrt(2)
    medians = [np.median(part) for part in np.array_split(position, STRETCHES)]
    return bool(np.mean(np.abs(np.diff(medians)) <= noise) >= STANDING)
