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

# words in a header that betray what a column is: in English, in what loggers write, and in other languages of Europe
WORDS = {
    "set_pressure": ("set point", "setpoint", "command", "desired", "soll", "consigne", "consigna"),
    "pressure": ("pressure", "druck", "press", "presión", "presion"),
    "force": ("force", "load cell", "loadcell", "kraft", "tension", "pull", "forza", "fuerza", "effort"),
    "load": ("load", "mass", "weight", "last", "gewicht", "carico", "carga"),
    "time": ("time", "zeit", "stamp", "millis", "micros", "tiempo", "x value"),  # the last as LabVIEW writes it
    "contraction": ("contraction", "strain", "shortening ratio", "kontraktion", "contrazione", "contracci"),
    "displacement": ("displacement", "shortening", "stroke", "travel", "weg", "extension", "crosshead", "elongation",
                     "déplacement", "deplacement", "spostamento", "desplazamiento"),
    "length": ("length", "position", "laser", "länge", "laenge", "longueur", "lunghezza", "longitud"),
    "run": ("run", "trial", "experiment", "cycle no"),
    "branch": ("branch", "direction"),
}  # fmt: skip
# the same in Japanese, Chinese and Korean; a single letter for pressure would be in the word for voltage, too
EASTERN = {
    "set_pressure": ("目標", "指令", "设定", "目标", "목표"),
    "pressure": ("圧力", "内圧", "空気圧", "压力", "气压", "압력"),
    "force": ("張力", "引張力", "収縮力", "拉力", "张力", "收缩力", "장력"),
    "load": ("荷重", "質量", "负载", "质量", "하중", "질량"),
    "time": ("時刻", "時間", "时间", "시간"),
    "contraction": ("収縮率", "收缩率", "수축률"),
    "displacement": ("変位", "収縮量", "位移", "변위"),
    "length": ("長さ", "位置", "长度", "길이"),
}
LETTERS = {"t": "time", "p": "pressure", "f": "force", "l": "length", "eps": "contraction", "x": "displacement",
           "力": "force", "힘": "force"}  # fmt: skip
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
    return (meant for meant, words in WORDS.items() if any(word in text for word in (*words, *EASTERN.get(meant, ()))))


def known_words(text: str) -> int:
    """How many Japanese, Chinese and Korean words for columns stand in a text; none, if it was decoded wrongly."""
    return sum(word in text for words in EASTERN.values() for word in words)


def is_second(name: str, found: Iterable[str]) -> bool:
    """Whether a column of this name would be the second of its kind: a recording has one position, in whatever form."""
    return any(name in kind and not kind.isdisjoint(found) for kind in ({name}, {*POSITIONS}))


def has_unit_of(unit: str, name: str) -> bool:
    """Whether a unit is one of what a column holds; a load may be a mass, and so may what a load cell reads."""
    si = COLUMNS[name]
    kinds = ("N", "kg") if name in ("load", "force") else (si,) if si else ()
    return is_unit(unit) and dimension(unit) in map(dimension, kinds)
