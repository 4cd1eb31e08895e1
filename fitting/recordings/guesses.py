"""What a recording most likely holds: its columns by name, word, letter or unit, and the kind of test."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from fitting.errors import InputError, nearest
from fitting.recordings.guessed_position import HELD_PRESSURE, SIGNED, is_elsewhere, is_turned
from fitting.recordings.heads import COLUMNS, LETTERS, has_unit_of, is_second, meant_by_words, plain_name, split_head
from fitting.recordings.kinds import parts_of, recordings_in
from fitting.recordings.readings import renamed
from fitting.recordings.tables import Table, is_absolute, read_heads, read_table
from fitting.units import ATMOSPHERE, PULL_OF_MASS, dimension, is_unit

FILE_WORDS = (("release", "quick release"), ("isotonic", "isotonic"), ("isometri", "isometric"), ("step", "step"),
         ("static", "static"), ("loop", "loop"))  # fmt: skip
HUNG_LOADS = 20  # different readings of a load at most, where weights are hung on
HELD_LENGTHS = 30  # different readings of the length at most, in an isometric test without noise
VENTED, SWEPT = 0.9, ("isometric", "isotonic")  # atmospheres that a vented muscle reads at least; tests that may vent
PLACED = 0.4  # of its largest reading: a position that comes nearer to 0 is no length of a muscle
SAME_FORCE, SWEPT_PRESSURE = 0.1, 0.5  # of a force, of the largest pressure: a weight that is lifted by a sweep
FEWEST_STILL, STILL = 30, 1.5  # readings; times its noise: readings that differ by less from their mean stand
MOVED = 0.1  # of a release's way, by which a muscle may move before, and how near it may come to there again
WAY, SUDDEN = (0.1, 0.7), 0.3  # shares of its way, between which it takes less than so many seconds
STRETCHES, STANDING = 50, 0.7  # of a recording; share of them in which an isometric test leaves the length as it was


@dataclass(frozen=True)
class Guess:
    """One recording of a folder as it is guessed; a `reason` says why it is left out, where it is."""

    path: Path
    inside: dict[str, str]  # the option that says which part of the file is meant, where there are several
    test: str = ""
    columns: dict[str, str] | None = None  # what the file calls each, by the program's names
    units: dict[str, str] | None = None  # of columns whose unit is to be stated, "?" where it is not known
    unused: tuple[str, ...] = ()
    table: Table | None = None  # the readings, in N, m and Pa where no unit is given; None where they cannot be read
    problem: str = ""  # why they cannot be read
    reason: str = ""
    position_sign: int = 1  # -1 where lengthening is positive
    is_elsewhere: bool = False  # the position is not 0 where the muscle is at rest

    @property
    def moved(self) -> str | None:
        """What the file calls a position that has a sign and a zero; None where it has none."""
        return next(((self.columns or {})[name] for name in SIGNED if name in (self.columns or {})), None)

    @property
    def pressure(self) -> str:
        """The line of muscle.toml that says whether pressures are a gauge's or absolute."""
        if is_absolute((self.columns or {}).get("pressure", "")):
            return 'pressure = "absolute"    # a guess: the column calls itself so; else "gauge"'
        read = self.readable["pressure"] if self.readable and "pressure" in self.readable else np.zeros(0)
        least = float(np.min(read[np.isfinite(read)], initial=np.inf))
        if VENTED * ATMOSPHERE < least < ATMOSPHERE / VENTED and self.test in SWEPT:
            return '# pressure = "absolute"  # gauge is presumed; if the muscle was vented once, take the # away'
        return '# pressure = "absolute"  # gauge is presumed'

    @property
    def name(self) -> str:
        """The file, and the part of it that is meant."""
        return ", ".join((self.path.name, *(" ".join(option) for option in self.inside.items())))

    @property
    def named(self) -> dict[str, str]:
        """The columns that the file calls otherwise than the program does."""
        return {name: head for name, head in (self.columns or {}).items() if plain_name(head) != name}

    @property
    def readable(self) -> Table | None:
        """The readings in SI, where every unit is given."""
        return None if "?" in (self.units or {}).values() else self.table


def guesses_of(folder: Path) -> list[Guess]:
    """One guess for each recording, or for each part of one.

    A column whose readings are no lengths in one file is none in the others either: a muscle that is held at 20 mm of
    shortening shows a number that might be one.
    """
    parts = [(path, inside) for path in recordings_in(folder) for inside in parts_of(path)]
    found = [_guess(*part) for part in parts]
    moved = {(guess.columns or {}).get("displacement") for guess in found} - {None}
    again = lambda guess: (guess.columns or {}).get("length") in moved  # noqa: E731
    found = [_guess(*part, is_moved=True) if again(guess) else guess for part, guess in zip(parts, found, strict=True)]
    return _as_counted(found)


def _as_counted(found: Sequence[Guess]) -> list[Guess]:
    """The same with sign and zero of their positions: what one file betrays of a sensor holds for all that it made."""
    swept = [(guess.moved, guess.table) for guess in found if guess.test == "loop"]
    loops = [(head, table, _position(table)) for head, table in swept if head and table is not None]
    turned = {head for head, table, position in loops if is_turned(table, position)}
    elsewhere = {head for head, table, position in loops if is_elsewhere(table, position, head in turned)}
    return [
        replace(guess, position_sign=-1 if guess.moved in turned else 1, is_elsewhere=guess.moved in elsewhere)
        for guess in found
    ]


def _position(table: Table) -> str:
    """The position that has a sign."""
    return next((name for name in SIGNED if name in table), SIGNED[0])


def _guess(path: Path, inside: dict[str, str], is_moved: bool = False) -> Guess:
    try:
        heads = read_heads(path, inside)
    except InputError as error:
        return Guess(path, inside, reason=f"{error.problem}. Cure: {error.cure}")
    called = _columns(heads)
    if inside and not called:
        return Guess(path, inside, reason="none of its columns is known")
    if "load" in called and "force" not in called and _is_reading(path, called["load"], inside):
        called["force"] = called.pop("load")
    weighed = PULL_OF_MASS.get(split_head(called.get("force", ""))[1] or "")
    unused = tuple(head for head in heads if head not in called.values())
    units = {name: "?" for name, head in called.items() if COLUMNS[name] is not None and not split_head(head)[1]}
    any_units = {name: {"load": "N"}.get(name, str(COLUMNS[name])) for name in units}  # only whether readings differ
    if weighed is not None:  # a load cell that was calibrated with weights
        units["force"] = any_units["force"] = weighed
    named = {name: head for name, head in called.items() if plain_name(head) != name}
    table, problem = _read(path, named, any_units, inside)
    if table is not None and (is_moved or _is_no_length(table, called)):
        called, units, any_units = (renamed(each, "length", "displacement") for each in (called, units, any_units))
        named = {name: head for name, head in called.items() if plain_name(head) != name}
        table, problem = _read(path, named, any_units, inside)
    if table is not None and table.has_stamps:
        units.pop("time", None)  # they need none
    test = _test(" ".join((path.stem, *inside.values())), table, set(called), bool(unused))
    if test == "isotonic" and "load" not in called:  # a load cell reads what hangs on the muscle
        called, units = (renamed(each, "force", "load") for each in (called, units))
    return Guess(path, inside, test, called, units, unused, table, problem)


def _is_no_length(table: Table, called: dict[str, str]) -> bool:
    """Whether a 'position' cannot be a muscle's length, which shortens by half at most: it begins near 0."""
    if "length" not in table or "length" in called.get("length", "").lower():
        return False
    place = table["length"][np.isfinite(table["length"])]
    return len(place) > 0 and bool(np.min(place) < PLACED * np.max(place))


def _columns(heads: list[str]) -> dict[str, str]:
    """What the columns most likely are: by their own name, by a word in it, by a letter, by a unit of its own."""
    found: dict[str, str] = {}
    for guess in (_by_name, _by_word, _by_letter):
        for head in heads:
            name = guess(head)
            if name and head not in found.values() and not is_second(name, found):
                found[name] = head
    by_unit = dict(_by_unit([head for head in heads if head not in found.values()]))
    if found or len(by_unit) > 1:  # one column in millimetres alone may be anything
        found = {name: head for name, head in by_unit.items() if not is_second(name, found)} | found
    return {name: found[name] for name in COLUMNS if name in found}


def _by_name(head: str) -> str | None:
    return plain_name(head) if plain_name(head) in COLUMNS else nearest(plain_name(head), COLUMNS, 0.85)


def _by_word(head: str) -> str | None:
    """By a word in it, unless its unit is one of something else: an extension in mm is no tension."""
    return next((name for name in meant_by_words(split_head(head)[0]) if not _has_another_unit(head, name)), None)


def _has_another_unit(head: str, name: str) -> bool:
    """Whether a column's unit is one of something else than this; a load may be a mass."""
    unit = split_head(head)[1]
    return bool(unit and COLUMNS[name] and is_unit(unit) and not has_unit_of(unit, name))


def _by_letter(head: str) -> str | None:
    return LETTERS.get(plain_name(head))


def _by_unit(heads: list[str]) -> Iterator[tuple[str, str]]:
    """What columns are of which no name is known, where only one of them has such a unit.

    So a header in any language is read, if its units are.
    """
    for name in ("time", "pressure", "displacement", "force"):
        alike = [head for head in heads if _is_given_in(head, str(COLUMNS[name]))]
        if len(alike) == 1:
            yield name, alike[0]


def _is_given_in(head: str, si: str) -> bool:
    """Whether a column has a unit of this dimension; a mass is none of a force here, for nothing names the column."""
    unit = split_head(head)[1]
    return bool(unit) and is_unit(unit) and dimension(unit) == dimension(si)


def _test(name: str, table: Table | None, names: set[str], more: bool) -> str:
    """The kind of test: by the name of file or sheet, by the columns, by whether the length moves.

    `more` says whether there are columns that nobody knows: the position may be one of them.
    """
    words = name.lower().replace("_", " ")
    for word, test in FILE_WORDS:
        if word in words and not (test == "step" and "force" in names):  # steps of pressure, read by a load cell
            return test
    if "load" in names and "force" not in names:
        return "step" if "set_pressure" in names else "isotonic" if "time" in names else "static"
    if "time" not in names:
        return "static"
    if table is not None and not more and not names & {"contraction", "length", "displacement"}:
        return "isometric"  # whoever lets the length move records it
    if table is not None and _is_let_go(table):
        return "quick release"
    if table is not None and _length_is_held(table):
        return "isometric"
    return "isotonic" if table is not None and _lifts_a_weight(table) else "loop"


def _lifts_a_weight(table: Table) -> bool:
    """Whether a force that pulls stays nearly the same while the pressure is swept: then a weight hangs there."""
    if not {"force", "pressure"} <= {*table.columns}:
        return False
    force, pressure = (table[name][np.isfinite(table[name])] for name in ("force", "pressure"))
    if not len(force) or not len(pressure):
        return False
    swept = np.ptp(np.quantile(pressure, [0.01, 0.99])) > SWEPT_PRESSURE * np.max(np.abs(pressure))
    return bool(swept and np.std(force) < SAME_FORCE * np.median(force))


def _is_let_go(table: Table) -> bool:
    """Whether a muscle stands, jumps to another length at one pressure and stays there: nobody moved it that fast."""
    position = next((table[name] for name in ("contraction", "length", "displacement") if name in table), None)
    if position is None or not {"time", "pressure"} <= {*table.columns}:
        return False
    time, place, pressure = np.stack([table["time"], position, table["pressure"]])
    known = np.isfinite(time) & np.isfinite(place) & np.isfinite(pressure)
    time, place, pressure = time[known], place[known], pressure[known]
    if len(place) < FEWEST_STILL or np.ptp(pressure) > HELD_PRESSURE * np.max(np.abs(pressure)):
        return False
    begin, end = place[: len(place) // 20 + 1], place[-(len(place) // 4) :]
    way = np.median(end) - np.median(begin)
    if way == 0:
        return False
    if np.ptp(begin) > MOVED * abs(way) or np.min((end - np.median(begin)) * np.sign(way)) < MOVED * abs(way):
        return False  # it moved from the beginning, or came back, as in a loop; a mass on a muscle may swing long
    gone = (place - np.median(begin)) / way
    first, last = np.argmax(gone > WAY[0]), np.argmax(gone > WAY[1])
    return bool(time[last] - time[first] < SUDDEN)


def _is_reading(path: Path, head: str, inside: dict[str, str]) -> bool:
    """Whether a column called load is what a load cell reads: weights that are hung on have few values."""
    table, _ = _read(path, {"load": head}, {} if split_head(head)[1] else {"load": "N"}, inside)
    return table is not None and len(np.unique(table["load"])) > HUNG_LOADS


def _read(path: Path, named: dict[str, str], units: dict[str, str], inside: dict[str, str]) -> tuple[Table | None, str]:
    """The readings, or why they cannot be read."""
    try:
        return read_table(path, named, units, inside), ""
    except InputError as error:
        return None, str(error)


def _length_is_held(table: Table) -> bool:
    position = next((table[name] for name in ("contraction", "length", "displacement") if name in table), None)
    if position is None:
        return False
    return len(np.unique(position)) <= min(HELD_LENGTHS, len(position) // 5) or _stands(position)


def _stands(position: np.ndarray) -> bool:
    """Whether a noisy reading mostly stands: from stretch to stretch its median moves by less than the noise."""
    # of a motion that is read a few times in each cycle neighbours differ as much, but second differences do not
    noise = 1.48 * np.median(np.abs(np.diff(position, 2))) / np.sqrt(6)
    if len(position) >= FEWEST_STILL and np.std(position) < STILL * noise:
        return True
    if len(position) < 2 * STRETCHES:
        return False
    noise = 1.48 * np.median(np.abs(np.diff(position))) / np.sqrt(2)
    medians = [np.median(part) for part in np.array_split(position, STRETCHES)]
    return bool(np.mean(np.abs(np.diff(medians)) <= noise) >= STANDING)
