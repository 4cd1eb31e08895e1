"""Formulas that a user writes: read into a tree of arithmetic, checked for dimension, evaluated by walking the tree.

Python's own parser reads them (`ast.parse`, which builds a tree and runs nothing): its precedence is what users know,
it needs no further package, and it says where each part stands. Only numbers, names, + - * / ** and the functions
below are admitted; the tree is never compiled or evaluated as Python.
"""

import ast
import functools
import math
import re
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import jax.numpy as jnp

from fitting import units
from fitting.errors import InputError, unknown_name
from fitting.library.settings import FORMULA

CONSTANTS = {"pi": math.pi}
FUNCTIONS = {
    "sin": "sin", "cos": "cos", "tan": "tan", "exp": "exp", "log": "log", "tanh": "tanh", "sinh": "sinh",
    "cosh": "cosh", "asin": "arcsin", "acos": "arccos", "atan": "arctan", "arcsin": "arcsin", "arccos": "arccos",
    "arctan": "arctan",
}  # fmt: skip
KEEPING = ("abs", "sqrt", "sign", "min", "max")  # their arguments may have a unit
KNOWN_FUNCTIONS = (*FUNCTIONS, *KEEPING)
_ADMITTED = re.compile(r"[A-Za-z0-9_.+\-*/(), ]")
_OPERATIONS = (ast.Add, ast.Sub, ast.Mult, ast.Div, ast.Pow)


@dataclass(frozen=True)
class Expression:
    """A formula: its text, its tree, and the names that stand in it (without functions and `pi`)."""

    text: str
    tree: ast.expr
    names: tuple[str, ...]

    def value(self, given: Mapping[str, Any], xp: Any = jnp) -> Any:
        """The value where each name has the value given (SI, arrays of one shape); `xp` may be numpy."""
        return _value(self.tree, given, xp)

    def dimension(self, given: Mapping[str, Any]) -> Any:
        """The dimension where each name has the dimension given; None where it is zero, which has any."""
        return _dimension(self.tree, given, self.text)


def read_expression(text: str, known: Sequence[str]) -> Expression:
    """Read a formula in which these names may stand; whatever else it holds is refused with its place."""
    text = text.strip().replace("^", "**")
    if not text:
        cure = "write one, as in 'screw = A*sin(x/p), ...'"
        raise InputError("there is no formula behind the equals sign", cure=cure)
    if len(text) > FORMULA.longest:
        raise InputError(f"the formula has {len(text)} characters", cure=f"{FORMULA.longest} are allowed")
    for place, character in enumerate(text, 1):
        if not _ADMITTED.match(character):
            cure = "write it with letters, digits, + - * / ** ( ) and commas"
            raise InputError(f"character {place} of the formula cannot stand in it", value=character, cure=cure)
    if max(_nesting(text)) > FORMULA.deepest:
        raise InputError(f"the formula has brackets more than {FORMULA.deepest} deep", cure="write it simpler")
    tree = _parsed(text)
    names: dict[str, None] = {}
    _admit(tree, text, known, names, 0)
    return Expression(text, tree, tuple(names))


def _nesting(text: str) -> list[int]:
    depth, found = 0, [0]
    for character in text:
        depth += (character == "(") - (character == ")")
        found.append(depth)
    return found


def _parsed(text: str) -> ast.expr:
    if found := re.search(r"(?<![A-Za-z0-9_.])(?>(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)(?=[A-Za-z_(])", text):
        place = text[found.start() : found.end() + 1]
        raise InputError("a factor follows a number without a sign between", value=place, cure="write 2*x for 2x")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # what Python only warns of is refused below
            return ast.parse(text, mode="eval").body
    except SyntaxError as error:
        place = min(error.offset or 1, len(text))
        cure = "every bracket closed, every sign between two values, * for 'times', ** for 'to the power'?"
        raise InputError(f"the formula cannot be read at its character {place}", value=text, cure=cure) from None
    except (ValueError, MemoryError, RecursionError):
        raise InputError("the formula is too large to be read", value=text, cure="write it simpler") from None


# ------------------------------------------------------------------------------------------------------- what may stand


def _admit(node: ast.expr, text: str, known: Sequence[str], names: dict[str, None], depth: int) -> None:
    """Refuse every part of the tree that is not arithmetic; collect the names."""
    if depth > FORMULA.deepest:
        raise InputError(f"the formula is more than {FORMULA.deepest} operations deep", cure="write it simpler")
    match node:
        case ast.Constant(value=int() | float() as number) if not isinstance(number, bool):
            if not math.isfinite(_as_float(number)):
                raise InputError("a number is too large", value=_part(node, text), cure="write it below 1e300")
        case ast.Name(id=name):
            _admit_name(name, known)
            if name not in CONSTANTS:
                names[name] = None
        case ast.UnaryOp(op=ast.UAdd() | ast.USub(), operand=inner):
            _admit(inner, text, known, names, depth + 1)
        case ast.BinOp(left=left, op=op, right=right) if isinstance(op, _OPERATIONS):
            _admit(left, text, known, names, depth + 1)
            _admit(right, text, known, names, depth + 1)
            if isinstance(op, ast.Pow) and abs(_literal(right) or 0) > FORMULA.power:
                raise InputError("the power is too high", value=_part(node, text), cure=f"{FORMULA.power} at most")
        case ast.Call(func=ast.Name(id=name), args=arguments, keywords=[]):
            _admit_call(name, len(arguments), text, node)
            for argument in arguments:
                _admit(argument, text, known, names, depth + 1)
        case _:
            cure = f"numbers, names, + - * / ** and {', '.join(KNOWN_FUNCTIONS)} may"
            raise InputError("this cannot stand in a formula", value=_part(node, text), cure=cure)


def _admit_name(name: str, known: Sequence[str]) -> None:
    if name in KNOWN_FUNCTIONS:
        raise InputError(f"the function '{name}' has no argument", cure=f"write {name}(...)")
    if name not in known and name not in CONSTANTS:
        error = unknown_name("name", name, (*known, *CONSTANTS))
        error.cure += f"; or give its value behind the formula: {name} = 1 N (0..10)"
        raise error


def _admit_call(name: str, count: int, text: str, node: ast.expr) -> None:
    if name not in KNOWN_FUNCTIONS:
        error = unknown_name("function", name, KNOWN_FUNCTIONS)
        error.value = _part(node, text)
        raise error
    least, most = (2, 8) if name in ("min", "max") else (1, 1)
    if not least <= count <= most:
        wanted = "two or more arguments" if most > 1 else "one argument"
        raise InputError(f"{name} takes {wanted}, not {count}", value=_part(node, text), cure=f"write {name}(...)")


def _part(node: ast.expr, text: str) -> str:
    return ast.get_source_segment(text, node) or text


def _as_float(number: Any) -> float:
    try:
        return float(number)
    except OverflowError:
        return math.inf


def _literal(node: ast.expr) -> float | None:
    """The value of a part that is made of numbers alone, like the 1/2 of x**(1/2)."""
    match node:
        case ast.Constant(value=number):
            return _as_float(number)
        case ast.UnaryOp(op=op, operand=inner):
            value = _literal(inner)
            return value if value is None or isinstance(op, ast.UAdd) else -value
        case ast.BinOp(left=left, op=ast.Div(), right=right):
            above, below = _literal(left), _literal(right)
            return None if above is None or not below else above / below
    return None


# -------------------------------------------------------------------------------------------------------------- values


def _value(node: ast.expr, given: Mapping[str, Any], xp: Any) -> Any:
    match node:
        case ast.Constant(value=number):
            return xp.asarray(_as_float(number), float)
        case ast.Name(id=name):
            return xp.asarray(CONSTANTS[name], float) if name in CONSTANTS else given[name]
        case ast.UnaryOp(op=op, operand=inner):
            value = _value(inner, given, xp)
            return -value if isinstance(op, ast.USub) else value
        case ast.BinOp(left=left, op=ast.Pow(), right=right):
            power = _literal(right)
            return _power(_value(left, given, xp), _value(right, given, xp) if power is None else power, xp)
        case ast.BinOp(left=left, op=op, right=right):
            return _combined(op, _value(left, given, xp), _value(right, given, xp))
        case ast.Call(func=ast.Name(id=name), args=arguments):
            return _applied(name, [_value(argument, given, xp) for argument in arguments], xp)
    raise AssertionError(ast.dump(node))  # `_admit` has refused everything else


def _combined(op: ast.operator, left: Any, right: Any) -> Any:
    if isinstance(op, ast.Add):
        return left + right
    if isinstance(op, ast.Sub):
        return left - right
    return left * right if isinstance(op, ast.Mult) else left / right


def _applied(name: str, values: list[Any], xp: Any) -> Any:
    if name == "sqrt":
        return _power(values[0], 0.5, xp)
    if name in ("min", "max"):
        return functools.reduce(xp.minimum if name == "min" else xp.maximum, values)
    return getattr(xp, FUNCTIONS.get(name, name))(*values)


def _power(base: Any, power: Any, xp: Any) -> Any:
    """Powers; a broken one of what is not positive is 0, with finite slopes: gauge pressures dip below zero."""
    if isinstance(power, float) and power.is_integer():
        return base ** int(power)
    positive = base > 0
    safe = xp.where(positive, base, 1.0)
    return xp.where(positive, xp.sqrt(safe) if isinstance(power, float) and power == 0.5 else safe**power, 0.0)


# ---------------------------------------------------------------------------------------------------------- dimensions


def _dimension(node: ast.expr, given: Mapping[str, Any], text: str) -> Any:
    match node:
        case ast.Constant(value=number):
            return None if number == 0 else units.dimension("1")
        case ast.Name(id=name):
            return units.dimension("1") if name in CONSTANTS else given[name]
        case ast.UnaryOp(operand=inner):
            return _dimension(inner, given, text)
        case ast.BinOp(left=left, op=ast.Pow(), right=right):
            return _dimension_of_power(left, right, given, text)
        case ast.BinOp(left=left, op=op, right=right):
            parts = [_dimension(left, given, text), _dimension(right, given, text)]
            if isinstance(op, (ast.Add, ast.Sub)):
                return _same(parts, node, text)
            if None in parts:
                return None
            return parts[0] * parts[1] if isinstance(op, ast.Mult) else parts[0] / parts[1]
        case ast.Call(func=ast.Name(id=name), args=arguments):
            parts = [_dimension(argument, given, text) for argument in arguments]
            if name in ("abs", "min", "max"):
                return _same(parts, node, text)
            if name == "sqrt":
                return None if parts[0] is None else parts[0] ** 0.5
            return units.dimension("1") if name == "sign" else _plain(parts[0], node, text)
    raise AssertionError(ast.dump(node))


def _dimension_of_power(base: ast.expr, power: ast.expr, given: Mapping[str, Any], text: str) -> Any:
    of_base, literal = _dimension(base, given, text), _literal(power)
    if of_base is None or (literal is not None and literal.is_integer() and literal == 0):
        return None if of_base is None else units.dimension("1")
    if literal is not None:
        return of_base**literal
    _plain(_dimension(power, given, text), power, text)
    return _plain(of_base, base, text)


def _same(parts: Sequence[Any], node: ast.expr, text: str) -> Any:
    """The dimension that all parts share."""
    stated = [part for part in parts if part is not None]
    for part in stated[1:]:
        if part != stated[0]:
            both = f"{dimension_text(stated[0])} and {dimension_text(part)}"
            problem = f"quantities of different units are put together ({both})"
            raise InputError(problem, value=_part(node, text), cure="give a factor the unit that makes them alike")
    return stated[0] if stated else None


def _plain(part: Any, node: ast.expr, text: str) -> Any:
    if part is not None and part != units.dimension("1"):
        cure = "divide by a parameter of the same unit, as in sin(x/p) with p = 12 mm (5..30)"
        raise InputError(
            f"a plain number is needed, this is in {dimension_text(part)}", value=_part(node, text), cure=cure
        )
    return units.dimension("1")


def dimension_text(dimension: Any) -> str:
    """A dimension by its SI unit, for messages."""
    if not dimension:
        return "plain numbers"
    try:
        return units.in_si(dimension_unit(dimension))[0]
    except InputError:  # powers that no unit has
        return dimension_unit(dimension)


def dimension_unit(dimension: Any) -> str:
    """A unit of this dimension, in base units."""
    symbols = {"[mass]": "kg", "[length]": "m", "[time]": "s"}
    return " * ".join(f"{symbols[base]} ** {float(power):.6g}" for base, power in dimension.items())
