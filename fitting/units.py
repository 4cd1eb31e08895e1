"""Units: from text with a unit to SI. The only file that knows the units library, which is loaded on first use."""

import functools
import math
import re
from collections.abc import Callable
from typing import Any, NamedTuple

from fitting.errors import InputError, nearest

STANDARD_GRAVITY = 9.80665  # m/s2
ATMOSPHERE = 101325.0  # Pa

_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_VALUE = re.compile(rf"\s*({_NUMBER})\s*(.*?)\s*$")
_PLUS_MINUS = re.compile(r"\+/-|\+-|±")
# What a unit is made of. The units library also takes 'mm!' for mm, and works out 'mm**9**9**9' for ever.
_POWER = r"(?:\s*(?:\^|\*\*)\s*[+-]?\d{1,2}(?:\.\d{1,6})?|[⁻¹²³]+)?"
_PIECE = re.compile(rf"(?:1|%|°|[A-Za-zµμ_][A-Za-zµμ_0-9]*){_POWER}|[*/·() ]")
_LONGEST_UNIT = 60  # characters

_EXAMPLES = {
    "m": "300 mm",
    "rad": "20 deg",
    "Pa": "0.54 MPa",
    "N": "100 N",
    "kg": "20 kg",
    "s": "10 ms",
    "1": "0.3",
    "m/s": "10 mm/s",
    "N/m": "100 N/mm",
}
_USUAL = ("m", "mm", "cm", "deg", "rad", "Pa", "hPa", "kPa", "MPa", "GPa", "bar", "mbar", "psi", "N", "kN", "mN", "kgf",
          "kg", "g", "s", "ms", "us", "min", "Hz", "J", "inch", "%")  # fmt: skip
_SPELLED = {"": "1", "1": "1", "-": "1", "%": "percent", "°": "deg", "µs": "us", "barg": "bar", "psig": "psi"}
_GAUGE = re.compile(r"(bar|mbar|Pa|hPa|kPa|MPa|psi) ?\((?:g|gauge|rel)\)")  # as a gauge reads, which is presumed
_ABSOLUTE = {
    f"{unit}a".lower(): unit for unit in ("bar", "mbar", "psi", "Pa", "hPa", "kPa", "MPa")
}  # say that they are
_CASES = {"kpa": "kPa", "hpa": "hPa", "gpa": "GPa", "kgf": "kgf", "degs": "deg"}  # not mpa: it could be mPa or MPa
_ANGLES = ("radian", "degree", "turn", "arcminute", "arcsecond")
PULL_OF_MASS = {"kg": "kgf", "g": "gf", "lb": "lbf", "lbs": "lbf"}  # what hangs on a muscle, by the unit of its mass
_COUNTS = ("count", "bit", "byte")  # plain numbers to the library, but no share of anything


class Measured(NamedTuple):
    """A value and its standard uncertainty in SI; the uncertainty is None where the value is exact."""

    value: float
    error: float | None


@functools.cache
def _registry() -> Any:
    import pint

    return pint.UnitRegistry(cache_folder=None)


@functools.lru_cache(maxsize=1024)
def _unit(text: str) -> Any:
    """The unit library's object for a unit as people write it; InputError if there is no such unit."""
    written = spelled(text)
    if len(written) > _LONGEST_UNIT or _PIECE.sub("", written) or without_absolute(written):
        raise InputError(f"'{text[:_LONGEST_UNIT]}' is not a unit", cure=_spelling(text))
    try:
        unit = _registry().Unit("" if written == "1" else _in_its_case(written))
        straight = all(_registry()._units[name].converter.is_multiplicative for name in unit._units)
    except Exception:  # the library raises many kinds for nonsense; all mean the same to the user
        raise InputError(f"'{text}' is not a unit", cure=_spelling(text)) from None
    if not straight:  # decibels, degrees Celsius
        cure = "give the quantity in a unit that is 0 where the quantity is 0"
        raise InputError(f"a quantity is no multiple of '{text}'", cure=cure)
    return unit


def _in_its_case(name: str) -> str:
    """A unit's name as the units library has it: 'Newton' and 'KPA' are no names to it, 'newton' and 'kPa' are."""
    if not name.isalpha() or len(name) < 3 or name in _registry():
        return name
    lower = name.lower()
    return _CASES.get(lower, lower)


def without_absolute(text: str) -> str | None:
    """'bar' of 'bara', 'bar(a)' and 'bar (abs)'; None of what does not say that it is absolute.

    To the units library 'bar(a)' would be a bar times an are.
    """
    return _ABSOLUTE.get(re.sub(r"[\s()]", "", text.lower()).replace("abs", "a"))


def _spelling(text: str) -> str:
    if re.match(r",\d", text.strip()):
        return "write the decimal mark as a point, as in '6.95 mm'"
    gauge = without_absolute(text)
    if gauge:
        return f"write '{gauge}', and for a column of absolute readings pressure = \"absolute\" in its [[recording]]"
    like = nearest(text.strip(), _USUAL, 0.7)
    return f"did you mean '{like}'?" if like else "write for example mm, deg, kPa, bar, psi, N, lbf, kg, s, inch, %"


def _is_angle(unit: Any) -> bool:
    return any(name in _ANGLES for name in unit._units)


def _is_count(unit: Any) -> bool:
    return any(name in _COUNTS for name in unit._units)


@functools.lru_cache(maxsize=1024)
def factor(unit: str, si: str) -> float:
    """What a number in `unit` is multiplied with to be in `si`; InputError if the dimensions differ.

    The units library takes angles and per cent for plain numbers; here an angle is not a contraction.
    """
    given, wanted = _unit(unit), _unit(si)
    alike = given.dimensionality == wanted.dimensionality and _is_angle(given) == _is_angle(wanted)
    if not alike or _is_count(given):
        cure = f"give it in a unit like that of '{example(si)}'"
        if si == "N" and unit in PULL_OF_MASS:
            cure = f"write {PULL_OF_MASS[unit]} for what a load cell reads in {unit}"
        raise InputError(f"'{unit}' cannot be the unit of {quantity(si)}", cure=cure)
    return _finite(lambda: _registry().Quantity(1.0, given).to(wanted).magnitude, unit)


def _finite(size: Callable[[], Any], unit: str) -> float:
    """How much one unit is; InputError where that is beyond all numbers, as of 'Gm^99'."""
    try:
        found = float(size())
    except OverflowError:
        found = math.inf
    if not math.isfinite(found) or found == 0:
        raise InputError(f"'{unit}' is beyond all numbers", cure="write a unit that things are measured in")
    return found


def dimension(unit: str) -> Any:
    """The dimension of a unit: multiplies, divides and takes powers; equal where units can be converted."""
    return _unit(unit).dimensionality


def spelled(text: str) -> str:
    """A unit as the units library spells it: 'deg' of '°', '1' of nothing, 'bar' of 'bar(g)'."""
    written = text.strip()
    gauge = _GAUGE.fullmatch(written)
    return gauge[1] if gauge else _SPELLED.get(written, written)


def bases(unit: str) -> tuple[str, ...]:
    """What a unit's name may be made of, prefixes left out: 'pascal' of 'kPa'."""
    return tuple(base for _, base, _ in _registry().parse_unit_name(spelled(unit)))


def is_unit(text: str) -> bool:
    """Whether there is such a unit."""
    try:
        _unit(text)
    except InputError:
        return False
    return True


def in_si(unit: str) -> tuple[str, float]:
    """The SI unit of the same dimension as declarations write it ("N s/m"), and how much of it one `unit` is."""
    given = _unit(unit)
    factor = _finite(lambda: _registry().Quantity(1.0, given).to_base_units().magnitude, unit)
    powers = dict(given.dimensionality)
    if not set(powers) <= {"[mass]", "[length]", "[time]"}:
        cure = "give it in units of length, mass, time, force and pressure"
        raise InputError(f"'{unit}' has no place in mechanics", cure=cure)
    if not powers and _is_angle(given):
        return "rad", factor
    for usual in ("m", "Pa", "N", "kg", "s", "1", "m/s"):
        if dimension(usual) == given.dimensionality:
            return usual, factor
    return _composed(*(float(powers.get(base, 0)) for base in ("[mass]", "[length]", "[time]"))), factor


def _composed(mass: float, length: float, time: float) -> str:
    """A unit of newtons (or kilograms), metres and seconds: 'N s/m'."""
    of_force = mass == 1
    powers = {"N" if of_force else "kg": mass, "m": length - of_force, "s": time + 2 * of_force}
    below = [name for name, power in powers.items() if power < 0]
    inverse = len(below) == 1 and len([p for p in powers.values() if p]) > 1
    above = [_to_power(name, power) for name, power in powers.items() if power > 0 or (power and not inverse)]
    return " ".join(above) + (f"/{_to_power(below[0], -powers[below[0]])}" if inverse else "")


def _to_power(name: str, power: float) -> str:
    return name if power == 1 else f"{name}^{power:.6g}"


def load_factor(unit: str) -> float:
    """Newtons per `unit` of a hung load: a mass is weighed at standard gravity."""
    mass = _unit(unit).dimensionality == _unit("kg").dimensionality
    return factor(unit, "kg") * STANDARD_GRAVITY if mass else factor(unit, "N")


def quantity(si: str) -> str:
    """What is measured in this SI unit, in words."""
    words = {"m": "a length", "rad": "an angle", "Pa": "a pressure", "N": "a force", "kg": "a mass", "s": "a time",
             "1": "a plain number (1 or %)"}  # fmt: skip
    return words.get(si, f"a quantity in {si}")


def example(si: str) -> str:
    """A value as one would write it, for messages."""
    return _EXAMPLES.get(si, f"1 {si}")


def split_value(text: str, what: str = "value") -> tuple[float, str]:
    """Number and unit of '300 mm'."""
    match = _VALUE.match(text)
    if not match:
        cure = "write a number, then the unit: '300 mm'"
        raise InputError(f"{what} is not a number with a unit", value=text, cure=cure)
    return float(match[1]), match[2]


def unit_of(text: str) -> str:
    """Unit of a value as it is written: 'mm' of '300 mm' and of '7.0 +/- 0.1 mm'."""
    return split_value(_PLUS_MINUS.split(text)[-1])[1]


def to_si(text: Any, si: str, what: str = "value") -> float:
    """A value as written ('300 mm') in the SI unit `si` ('m'); plain numbers are taken only where `si` is '1'."""
    if isinstance(text, bool) or not isinstance(text, (str, int, float)):
        raise InputError(f"{what} is not a value with a unit", value=text, cure=f'write it as "{example(si)}"')
    number, unit = split_value(str(text), what)
    if si != "1" and not unit:
        cure = f'write the unit behind the number, as in "{example(si)}"'
        raise InputError(f"{what} has no unit", value=text, cure=cure)
    try:
        size = factor(unit or "1", si)
    except InputError as error:
        raise InputError(f"{what}: {error.problem}", value=text, cure=error.cure) from None
    return _checked(number * size, si, text, what)


def _checked(value: float, si: str, text: Any, what: str) -> float:
    if not math.isfinite(value):
        raise InputError(f"{what} is not finite", value=text, cure=f'write it as "{example(si)}"')
    return value


def load_to_si(text: Any, si: str, what: str = "load") -> float:
    """A load as written ('20 kg' or '200 N') in newtons; `si` is there to be called like `to_si`."""
    number, unit = split_value(str(text), what)
    return _checked(number * load_factor(unit), "N", text, what) if unit else to_si(text, "N", what)


def list_to_si(text: str, unit: str, what: str, read: Callable[..., float] = to_si) -> list[float]:
    """Values (SI) separated by commas; a unit at the end stands for all that have none. `read` reads one of them."""
    parts = [part.strip() for part in text.split(",") if part.strip()]
    if not parts:
        raise InputError(f"{what} is empty", cure=f"write for example {example(unit)}")
    last = split_value(parts[-1], what)[1]
    whole = [part if split_value(part, what)[1] else f"{part} {last}".strip() for part in parts]
    return [read(part, unit, what) for part in whole]


def measured(text: Any, si: str, what: str = "value") -> Measured:
    """Value and standard uncertainty of '7.0 +/- 0.1 mm' (one unit for both, or each its own) in SI."""
    parts = _PLUS_MINUS.split(text) if isinstance(text, str) else [text]
    if len(parts) == 1:
        return Measured(to_si(text, si, what), None)
    if len(parts) != 2:
        raise InputError(f"{what} has more than one '+/-'", value=text, cure="write '7.0 +/- 0.1 mm'")
    _, unit = split_value(parts[1], what)
    centre = parts[0] if split_value(parts[0], what)[1] else f"{parts[0].strip()} {unit}"
    error = to_si(parts[1], si, f"the uncertainty of {what}")
    if error <= 0:
        cure = "leave '+/-' out for an exact value"
        raise InputError(f"the uncertainty of {what} is not positive", value=text, cure=cure)
    return Measured(to_si(centre, si, what), error)
