"""What a header cell says of its column: a name, a unit, and what the name most likely means."""

import re
from collections.abc import Iterable, Iterator

from fitting.units import dimension, is_unit

# SI unit of every column; None: a label, "load": newtons or a mass
COLUMNS = {"run": None, "time": "s", "pressure": "Pa", "set_pressure": "Pa", "contraction": "1", "length": "m",
           "displacement": "m", "force": "N", "load": "load", "branch": None}  # fmt: skip
USUAL = {"s": "s", "Pa": "kPa", "1": "1", "m": "mm", "N": "N", "load": "kg"}  # what such a column is mostly given in
POSITIONS = ("contraction", "length", "displacement")  # a recording has one of them
PULLS = ("force", "load")
_HEADER = re.compile(r"^(.*?)\s*(?:\[([^\]]*)\]|\(([^)]*)\))?$", re.DOTALL)

# words in a header that betray what a column is, in English and in what loggers write
WORDS = {
    "set_pressure": ("set point", "setpoint", "command", "desired", "soll"),
    "pressure": ("pressure", "druck", "press"),
    "force": ("force", "load cell", "loadcell", "kraft", "tension", "pull"),
    "load": ("load", "mass", "weight", "last"),
    "time": ("time", "zeit", "stamp", "millis", "micros"),
    "contraction": ("contraction", "strain", "shortening ratio"),
    "displacement": ("displacement", "shortening", "stroke", "travel", "weg", "extension", "crosshead", "elongation"),
    "length": ("length", "position", "laser"),
    "run": ("run", "trial", "experiment", "cycle no"),
    "branch": ("branch", "direction"),
}
LETTERS = {"t": "time", "p": "pressure", "f": "force", "l": "length", "eps": "contraction", "x": "displacement"}
CLOCKS = {"millis": "ms", "micros": "us"}  # as an Arduino calls its time since it was switched on
# units that are written behind a name, as in travel_mm; a single letter only where the name says what it measures
SUFFIXES = ("mm", "cm", "bar", "mbar", "psi", "kPa", "kpa", "MPa", "Pa", "hPa", "kN", "mN", "kg", "kgf", "gf", "lbf",
            "ms", "us", "inch", "N", "m", "s", "g")  # fmt: skip


def split_head(head: str) -> tuple[str, str | None]:
    """Name and unit of a header cell 'name [unit]', 'name (unit)' or 'name_unit'; None where there is no unit."""
    name, unit = split_brackets(head)
    return _split_name(name) if unit is None else (name, unit)


def split_brackets(head: str) -> tuple[str, str | None]:
    """The same of a header cell whose unit stands in brackets; None where there are none."""
    match = _HEADER.match(head.strip())
    assert match is not None  # the pattern matches every text
    return match[1].strip(), match[2] if match[2] is not None else match[3]


def has_suffix(head: str) -> bool:
    """Whether a header cell has its unit behind its name, where it may be part of the name."""
    return split_brackets(head)[1] is None and split_head(head)[1] is not None


def _split_name(name: str) -> tuple[str, str | None]:
    """A name and the unit behind it, where it is one of what the name means: p_psi, load_g, but not p_g or p_s."""
    if name.lower() in CLOCKS:
        return name, CLOCKS[name.lower()]
    front, _, unit = name.rpartition("_")
    if not front or unit not in SUFFIXES:
        return name, None
    meant = meant_by(front)
    fits = any(has_unit_of(unit, each) for each in meant) if meant else len(unit) > 1
    return (front, unit) if fits else (name, None)


def plain_name(head: str) -> str:
    """'Set pressure [bar]' -> 'set_pressure'."""
    return _plain(split_head(head)[0])


def _plain(name: str) -> str:
    return re.sub(r"[\s\-]+", "_", name.lower())


def meant_by(name: str) -> tuple[str, ...]:
    """What a column of this name may be: by the name itself, else by words in it and a letter; none: nobody knows."""
    plain = _plain(name)
    if plain in COLUMNS:
        return (plain,)
    return (*meant_by_words(name), *([LETTERS[plain]] if plain in LETTERS else []))


def meant_by_words(name: str) -> Iterator[str]:
    """What a column may be by the words in its name, the likeliest first."""
    text = name.lower().replace("_", " ")
    return (meant for meant, words in WORDS.items() if any(word in text for word in words))


def is_second(name: str, found: Iterable[str]) -> bool:
    """Whether a column of this name would be the second of its kind: a recording has one position, in whatever form."""
    return any(name in kind and not kind.isdisjoint(found) for kind in ({name}, {*POSITIONS}))


def has_unit_of(unit: str, name: str) -> bool:
    """Whether a unit is one of what a column holds; a load may be a mass, and so may what a load cell reads."""
    si = COLUMNS[name]
    kinds = ("N", "kg") if name in ("load", "force") else (si,) if si else ()
    return is_unit(unit) and dimension(unit) in map(dimension, kinds)
