"""`mckibben init`: a muscle.toml to fill in, with what can be told from the recordings of a folder."""

import json
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from fitting.errors import InputError
from fitting.recordings.accuracy_template import accuracy_lines
from fitting.recordings.guesses import Guess, guesses_of
from fitting.recordings.heads import POSITIONS
from fitting.recordings.kinds import recordings_in
from fitting.recordings.muscle_file import REQUIRED
from fitting.recordings.readings import HELD
from fitting.recordings.records import TESTS
from fitting.showing import shown_in
from fitting.writing import FULL, refused, text_replaced
from mckibben_jax.muscle import quantities

POSITION_SIGN = "position_sign = -1       # a guess: this reading grows as the muscle lengthens"
AT_REST = (
    'position_at_rest = "? mm"   # what this sensor reads where the muscle has its length at rest: that is not 0 here'
)
TYPICAL = {
    "shear_modulus": 1e6,
    "mooney_c10": 1e6,
    "mooney_c01": 1e6,
    "strand_modulus": 1e9,
    "breaking_stress": 1e6,
}  # Pa


def write_muscle_file(folder: Path | str) -> Path:
    """Write muscle.toml into a folder; an existing one is left alone, with an error that says so."""
    return write_guessed(folder)[0]


def write_guessed(folder: Path | str) -> tuple[Path, list[Guess]]:
    """The muscle.toml that was written, and what was guessed of each recording."""
    folder = Path(folder)
    if not folder.is_dir():
        raise InputError("no such folder", folder, cure="make it and put the recordings into it")
    if not recordings_in(folder):
        cure = (
            "put the recordings into it first: tables as text (.csv, .txt, .lvm), Excel (.xlsx), MATLAB (.mat), "
            "LabVIEW (.tdms) or ROS 2 (.mcap)"
        )
        raise InputError("no recording is in this folder", folder, cure=cure)
    path = folder / "muscle.toml"
    if path.exists():
        raise InputError("the file is there already and is left alone", path, cure="edit it, or rename it")
    guesses = guesses_of(folder)
    try:
        text_replaced(path, _text(folder, guesses))
    except OSError as error:
        raise refused(path, error, "" if error.errno in FULL else "check the folder's rights") from None
    return path, guesses


def muscle_file(folder: Path) -> str:
    """The text of a muscle.toml for this folder; a question mark stands where something is to be filled in."""
    return _text(folder, guesses_of(folder))


def _text(folder: Path, guesses: Sequence[Guess]) -> str:
    shared = _shared(guesses)
    parts = [_muscle_part(folder), *_shared_part(shared)]
    parts += [_recording_part(guess, shared) for guess in guesses]
    if not guesses:
        parts.append('# [[recording]]\n# file = "loops.csv"\n# test = "loop"\n')
    return "\n".join([*parts, '[source]\ncitation = ""\nlicence  = ""\n'])


def _muscle_part(folder: Path) -> str:
    return "\n".join(_muscle_lines(folder)) + "\n"


def _muscle_lines(folder: Path) -> Iterator[str]:
    yield f"name = {_quoted(folder.resolve().name)}"
    yield '# hose = "?"   # where several muscles are cut from one hose, its name: they share its sizes'
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


def _shared(guesses: Sequence[Guess]) -> list[Guess]:
    """The recordings that one rig seems to have made: all that are like the first; none where that is alone."""
    read = [guess for guess in guesses if not guess.reason]
    like_first = [guess for guess in read if _kind(guess) == _kind(read[0])]
    return like_first if len(like_first) > 1 else []


def _kind(guess: Guess) -> tuple[str, frozenset[str]]:
    return guess.test, frozenset(guess.columns or {})


def _shared_part(shared: Sequence[Guess]) -> list[str]:
    """What the instruments of these recordings may err by, stated once; full scale is that of the largest pressure."""
    if not shared:
        return []
    readable = [guess.readable for guess in shared if guess.readable is not None and "pressure" in guess.readable]
    largest = max(readable, key=lambda table: float(np.nanmax(np.abs(table["pressure"]))), default=None)
    return ["\n".join(accuracy_lines(largest, shared[0].test, shared[0].columns or {}, "[accuracy]")) + "\n"]


def _recording_part(guess: Guess, shared: Sequence[Guess]) -> str:
    return "\n".join(_recording_lines(guess, shared)) + "\n"


def _recording_lines(guess: Guess, shared: Sequence[Guess]) -> Iterator[str]:
    """One [[recording]]: the kind of test and the columns as far as they can be told."""
    if guess.reason:
        yield f"# {guess.name}{',' * bool(guess.inside)} is left out: {guess.reason}"
        return
    yield "[[recording]]"
    yield f"file = {_quoted(guess.path.name)}"
    yield from (f"{option} = {_quoted(name)}" for option, name in guess.inside.items())
    yield f'test = "{guess.test}"   # a guess: {", ".join(TESTS)}'
    if guess.named:
        yield f"columns = {_table(guess.named)}   # a guess"
    if guess.columns and guess.test == "quick release" and "load" not in guess.columns:
        yield 'constant = { load = "? kg" }   # no column says what hung on the muscle when it was let go'
    if guess.columns and guess.test in HELD and not {*POSITIONS} & {*guess.columns}:
        yield 'constant = { length = "? mm" }   # no column says how long the muscle was; was it held at one length?'
    if guess.units:
        yield f"units = {_table(guess.units)}"
    if guess.unused:
        named = ", ".join(_quoted(head) for head in guess.unused)
        yield f"# not used: {named}; if one is needed, name it in `columns`"
    if any(guess is each for each in shared[1:]):
        yield from _what_differs(guess)
        return
    yield '# noise = "0.5 N"        # standard deviation of one reading, if known'
    yield guess.pressure
    yield "# force_sign = -1        # where the rig counts pulling as negative"
    yield from _position_lines(guess)
    if guess.position_sign > 0 and guess.moved:
        yield "# position_sign = -1     # where the rig counts lengthening as positive, as an extension"
    if not guess.is_elsewhere and "displacement" in (guess.columns or {}):
        yield '# position_at_rest = "0 mm"   # what the sensor reads where the muscle has its length at rest'
    if not any(guess is each for each in shared):
        yield from accuracy_lines(guess.readable, guess.test, guess.columns or {})


def _position_lines(guess: Guess) -> Iterator[str]:
    """What is in force of the way in which a position is counted."""
    if guess.position_sign < 0:
        yield POSITION_SIGN
    if guess.is_elsewhere:
        yield AT_REST


def _what_differs(guess: Guess) -> Iterator[str]:
    """Of a recording that is like one above: what is in force, and that the rest may stand here too."""
    if not guess.pressure.startswith("#"):
        yield guess.pressure
    yield from _position_lines(guess)
    yield "# noise, force_sign and so on, as above; [recording.accuracy] where its instruments are others"


def _table(entries: dict[str, str]) -> str:
    return "{ " + ", ".join(f"{name} = {_quoted(text)}" for name, text in entries.items()) + " }"


def _quoted(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)  # a JSON string is a TOML string
