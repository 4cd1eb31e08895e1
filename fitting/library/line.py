"""An effect in one line: `screw = A*sin(2*pi*x/p), A = 1 N (-20..20), p = 12 mm (5..30)`.

The formula is a force that is added to the pull at the felt state. What stands behind it is a parameter where it has a
range (in the unit of its value), a constant where it has none.
"""

import functools
import keyword
import math
import re
from collections.abc import Callable, Mapping
from typing import Any, ClassVar, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from fitting import units
from fitting.errors import InputError
from fitting.library.expression import KNOWN_FUNCTIONS, Expression, dimension_text, read_expression
from fitting.library.settings import LINE
from mckibben_jax.effect import Pulling, name_of
from mckibben_jax.effects import LIBRARY
from mckibben_jax.laws.shape import shape
from mckibben_jax.muscle import Muscle
from mckibben_jax.parameter import parameter, parameters
from mckibben_jax.state import State

EXAMPLE = "screw = A*sin(2*pi*x/p), A = 1 N (-20..20), p = 12 mm (5..30)"
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,29}")
_EFFECT_NAME = re.compile(r"[a-z][a-z0-9_]{0,39}")
_FACTOR = r"(?:1|%|°|µ?[A-Za-z]+)(?:(?:\^|\*\*)-?\d(?:\.\d{1,3})?)?"
_UNIT = re.compile(rf"{_FACTOR}(?:\s*[*/ ]\s*{_FACTOR}){{0,5}}")
_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_RANGE = re.compile(rf"\s*({_NUMBER})\s*\.\.\s*({_NUMBER})\s*\)")


class Variable(NamedTuple):
    """A quantity that a formula may name: its SI unit, what it is, and its value at a felt state."""

    unit: str
    meaning: str
    at: Callable[[Muscle, State], jax.Array]


VARIABLES = {
    "x": Variable("m", "stroke l0 eps", lambda m, s: m.length * s.contraction),
    "eps": Variable("1", "contraction", lambda m, s: s.contraction),
    "v": Variable("m/s", "speed of shortening dx/dt", lambda m, s: m.length * s.rate),
    "P": Variable("Pa", "gauge pressure", lambda m, s: s.pressure),
    "t": Variable("s", "time within the run", lambda m, s: s.time),
    "r": Variable("m", "radius of the braid now", lambda m, s: shape(m, s).braid_radius),
    "alpha": Variable("rad", "braid angle now", lambda m, s: shape(m, s).angle),
    "S": Variable("m^2", "contact surface of the strands (eq 35)", lambda m, s: shape(m, s).contact_surface),
    "F0": Variable("N", "force of the ideal cylinder (eq 10)", lambda m, s: shape(m, s).ideal_force(s.pressure)),
}


class Defined(Pulling):
    """A force given by a formula. `line` is the definition as it was written, `constants` its fixed values in SI."""

    line: ClassVar[str]
    law: ClassVar[Expression]
    constants: ClassVar[dict[str, float]]

    def force(self, muscle: Muscle, state: State) -> jax.Array:
        """The formula's value at the felt state, N."""
        own = {p.name: getattr(self, p.name) for p in parameters(self)}
        fixed = {name: jnp.asarray(value, float) for name, value in self.constants.items()}
        felt = {name: VARIABLES[name].at(muscle, state) for name in self.law.names if name in VARIABLES}
        return self.law.value({**own, **fixed, **felt})


class Given(NamedTuple):
    """A value behind the formula, SI; a constant where it has no range."""

    value: float
    unit: str
    range: tuple[float, float] | None


def effect_from_line(line: str) -> type[Defined]:
    """The effect that one line defines. The same line gives the same class, so that it is compiled once."""
    return _defined(" ".join(str(line).split()))


def defined_name(line: str) -> str:
    """The name that a line defines, before anything else of it is looked at."""
    return line.partition("=")[0].strip()


@functools.lru_cache(maxsize=256)
def _defined(line: str) -> type[Defined]:
    name, formula, rest = _split(line)
    values: dict[str, Given] = {}
    for text in rest:
        key, given = _given(text, name)
        if key in values:
            raise InputError(f"{name}: '{key}' is given twice", value=text, cure="keep one of them")
        values[key] = given
    try:
        law = read_expression(formula, (*VARIABLES, *values))
        _check(law, values)
    except InputError as error:
        raise error.of(name) from None
    return _class(name, line, law, values)


def _class(name: str, line: str, law: Expression, values: Mapping[str, Given]) -> type[Defined]:
    free = {key: given for key, given in values.items() if given.range is not None}
    bent = _check_values(name, law, values)
    members: dict[str, Any] = {
        "__module__": __name__,
        "__doc__": f"{law.text}, added to the pull.",
        "__annotations__": dict.fromkeys(free, jax.Array),
        "line": line,
        "law": law,
        "constants": {key: given.value for key, given in values.items() if given.range is None},
        "source": f"defined by its user: {line}",
        "suspect": "whatever its author had in mind",
    }
    for key, given in free.items():
        assert given.range is not None
        starts = _starts(given) if key in bent else ()
        members[key] = parameter(given.value, given.unit, f"{key} of {law.text}", range=given.range, starts=starts)
    return type(name, (Defined,), members)


def _starts(given: Given) -> tuple[float, ...]:
    """Where a search for a hidden shape begins: at the value, and spread over the range."""
    assert given.range is not None
    lower, upper = given.range
    return (given.value, *(lower + share * (upper - lower) for share in LINE.spread))


# ------------------------------------------------------------------------------------------------------------ the line


def _split(line: str) -> tuple[str, str, list[str]]:
    """Name, formula, and the texts of the values behind it."""
    if not line:
        raise InputError("the definition is empty", cure=f'write --define "{EXAMPLE}"')
    if len(line) > LINE.longest:
        raise InputError(f"the definition has {len(line)} characters", cure=f"{LINE.longest} are allowed")
    name, sign, rest = line.partition("=")
    name = name.strip()
    if not sign:
        raise InputError("the definition has no equals sign", value=line, cure=f'write --define "{EXAMPLE}"')
    _check_effect_name(name)
    formula, *values = _pieces(rest)
    if len(values) > LINE.parameters:
        raise InputError(f"{name} has {len(values)} values", cure=f"{LINE.parameters} are allowed")
    return name, formula, values


def _check_effect_name(name: str) -> None:
    if name in {"muscle", *(name_of(kind) for kind in LIBRARY)}:
        raise InputError(f"'{name}' is taken: the program has it already", cure=f"call yours my_{name}")
    if not _EFFECT_NAME.fullmatch(name) or keyword.iskeyword(name):
        cure = "begin with a small letter; small letters, digits and _ may follow, 40 at most: 'screw = ...'"
        raise InputError("the effect's name cannot be used", value=name, cure=cure)


def _pieces(text: str) -> list[str]:
    """Text cut at the commas that stand in no bracket."""
    pieces, depth = [""], 0
    for character in text:
        depth += (character == "(") - (character == ")")
        if character == "," and depth <= 0:
            pieces.append("")
        else:
            pieces[-1] += character
    if depth:
        problem = "a bracket is not closed" if depth > 0 else "a bracket is closed that was not open"
        raise InputError(problem, value=text.strip(), cure="count ( and )")
    return [piece.strip() for piece in pieces]


def _given(text: str, owner: str) -> tuple[str, Given]:
    """Name and value of 'p = 12 mm (5..30)'."""
    name, sign, rest = (part.strip() for part in text.partition("="))
    if not sign or not rest:
        cure = f"write a value with its unit and range: {name or 'A'} = 1 N (-20..20)"
        raise InputError(f"{owner}: '{text}' is not a value", value=text, cure=cure)
    _check_name(name, owner)
    value, bracket, ends = rest.partition("(")
    number, unit = _measure(value.strip(), f"{owner}: {name}")
    si, factor = _factor(unit, f"{owner}: {name}")
    if not bracket:
        return name, Given(_finite(number * factor, owner, name, text), si, None)
    if not (found := _RANGE.fullmatch(ends)):
        cure = f"write two numbers in the unit of the value: {name} = {value.strip()} (lower..upper)"
        raise InputError(f"{owner}: the range of {name} cannot be read", value=f"({ends}", cure=cure)
    lower, upper = (_finite(float(end) * factor, owner, name, text) for end in found.groups())
    middle = _finite(number * factor, owner, name, text)
    if not lower < upper:
        raise InputError(f"{owner}: the range of {name} holds nothing", value=f"({ends}", cure="lower end first")
    if not lower <= middle <= upper:
        cure = f"widen the range, or give a value between {found[1]} and {found[2]}"
        raise InputError(f"{owner}: the value of {name} lies outside its range", value=text, cure=cure)
    return name, Given(middle, si, (lower, upper))


def _check_name(name: str, owner: str) -> None:
    if not _NAME.fullmatch(name) or keyword.iskeyword(name):
        cure = "begin with a letter; letters, digits and _ may follow, 30 at most"
        raise InputError(f"{owner}: a parameter cannot be called this", value=name, cure=cure)
    if name in VARIABLES:
        meaning = VARIABLES[name].meaning
        raise InputError(f"{owner}: '{name}' means the {meaning}", value=name, cure=f"call the parameter {name}_1")
    if name in (*KNOWN_FUNCTIONS, "pi", "name", "define") or hasattr(Defined, name) or name in ("line", "law"):
        raise InputError(f"{owner}: '{name}' means something already", value=name, cure=f"call the parameter {name}_1")


def _measure(text: str, what: str) -> tuple[float, str]:
    number, unit = units.split_value(text, what)
    if unit and not _UNIT.fullmatch(unit):
        raise InputError(f"{what}: '{unit}' is not a unit", value=text, cure="write it like mm, kPa, N/mm, N s/m, 1/s")
    return number, unit or "1"


def _factor(unit: str, what: str) -> tuple[str, float]:
    try:
        return units.in_si(unit)
    except InputError as error:
        raise error.of(what) from None


def _finite(value: float, owner: str, name: str, text: str) -> float:
    if not math.isfinite(value) or abs(value) > 1e100:
        raise InputError(f"{owner}: {name} is too large", value=text, cure="give a value that can be measured")
    return value


# ----------------------------------------------------------------------------------------------------------- the checks


def _check(law: Expression, values: Mapping[str, Given]) -> None:
    """Every value is used, and the formula is a force."""
    for name in values:
        if name not in law.names:
            raise InputError(f"'{name}' does not stand in the formula", value=law.text, cure="use it, or leave it out")
    known = {name: units.dimension(variable.unit) for name, variable in VARIABLES.items()}
    known |= {name: units.dimension(given.unit) for name, given in values.items()}
    found = law.dimension(known)
    if found is not None and found != units.dimension("N"):
        cure = "give a factor the unit that makes it a force, as in A = 1 N (-20..20)"
        raise InputError(
            f"the formula is no force: it is in {dimension_text(found)}, not in N", value=law.text, cure=cure
        )


def _check_values(name: str, law: Expression, values: Mapping[str, Given]) -> tuple[str, ...]:
    """Refuse a formula that gives no number, or nothing but zero; return the parameters that bend it.

    A law that is linear in a parameter is found from anywhere; a hidden shape needs several starts.
    """
    at = {key: np.asarray(given.value) for key, given in values.items()}
    force = _tried(law, at)
    if not np.any(np.isfinite(force)):
        cure = "see that nothing is divided by zero and no logarithm is of a negative number"
        raise InputError(f"{name}: the formula gives no finite number anywhere", value=law.text, cure=cure)
    size = np.max(np.abs(force[np.isfinite(force)]))
    if size == 0:
        cure = "give typical values, not zero: the search begins there"
        raise InputError(f"{name}: the force is zero everywhere with these values", value=law.text, cure=cure)
    return tuple(key for key, given in values.items() if given.range and _bends(law, at, key, given.range))


def _bends(law: Expression, at: Mapping[str, Any], key: str, ends: tuple[float, float]) -> bool:
    places = (ends[0], (ends[0] + ends[1]) / 2, ends[1])
    lower, middle, upper = (_tried(law, {**at, key: np.asarray(place)}) for place in places)
    with np.errstate(all="ignore"):
        off, size = lower - 2 * middle + upper, np.abs(lower) + np.abs(middle) + np.abs(upper)
        return bool(np.any(np.abs(off) > 1e-9 * size))


def _tried(law: Expression, values: Mapping[str, Any]) -> np.ndarray:
    """The formula's value at states all over the range of a usual muscle, N."""
    with np.errstate(all="ignore"):
        value = law.value({**_usual_states(), **values}, np)
        return np.broadcast_to(np.asarray(value, float), (len(_usual_states()["x"]),))


@functools.cache
def _usual_states() -> dict[str, np.ndarray]:
    random = np.random.default_rng(0)
    eps, pressure, rate, time = random.uniform((-0.05, 0, -3, 0), (0.4, 1e6, 3, 1e3), (400, 4)).T
    muscle = Muscle(*map(jnp.asarray, (0.3, 0.007, math.radians(20.0))))
    states = State(jnp.asarray(eps), jnp.asarray(pressure), rate=jnp.asarray(rate), time=jnp.asarray(time))
    return {name: np.asarray(variable.at(muscle, states), float) for name, variable in VARIABLES.items()}
