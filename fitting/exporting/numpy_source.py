"""Python source, with numpy alone, of a function that jax has traced: the same arithmetic, written down.

jax traces a function to a list of primitive operations. Each becomes one numpy expression; what depends on no argument
is computed now, what nobody uses is left out, and what occurs twice is written once. An operation that is not known is
traced through its own implementation, and refused by name where that leads no further.
"""

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import accumulate, count
from typing import Any

import jax
import numpy as np
from jax.extend import core

from fitting.exporting.operations import expression_of
from fitting.exporting.settings import EXPORT

INSIDE = ("jaxpr", "call_jaxpr", "fun_jaxpr")  # where an operation keeps the function that it calls


class UnknownOperation(Exception):
    """An operation of jax that has no numpy expression here."""


def numpy_source(name: str, function: Callable, arguments: dict[str, Any]) -> str:
    """Source of a Python function `name` that computes what `function(*arguments)` does, and returns a tuple.

    `arguments` are example values by name: arrays or nothing else. Arguments must be given as numpy numbers, for they
    divide by zero without complaint.
    """
    scope, traced = _Scope(count()), jax.make_jaxpr(function)(*arguments.values())
    scope.bind(traced.jaxpr.invars, arguments)
    return "\n".join(_function(name, tuple(arguments), traced, scope))


def _function(name: str, arguments: Sequence[str], traced: Any, scope: "_Scope") -> list[str]:
    results = scope.run(traced)
    lines = (*scope.lines, f"return {_many(results)}")
    return [f"def {name}({', '.join(arguments)}):", *(f"    {line}" for line in lines)]


class _Scope:
    """The body of one Python function in the making."""

    def __init__(self, numbers: Iterator[int]) -> None:
        self.lines: list[str] = []
        self.numbers = numbers
        self.texts: dict[Any, str] = {}  # of variables: a name or a short expression
        self.values: dict[Any, Any] = {}  # of variables that depend on no argument
        self.named: dict[str, str] = {}  # expressions that have a name already
        self.uses: Counter[Any] = Counter()

    # what is known of a variable ---------------------------------------------------------------------------------

    def bind(self, variables: Iterable[Any], texts: Iterable[str]) -> None:
        """Say how variables are written. A function that is called twice has the same variables, with other values."""
        for variable, text in zip(variables, texts, strict=True):
            self.texts[variable] = text
            self.values.pop(variable, None)

    def text(self, atom: Any) -> str:
        """How an operand is written."""
        value = self.value(atom)
        return self.texts[atom] if value is None else constant(value)

    def value(self, atom: Any) -> Any:
        """The value of an operand that depends on no argument, else None."""
        return atom.val if isinstance(atom, core.Literal) else self.values.get(atom)

    def name(self, expression: str) -> str:
        """A name for an expression; the one it has, if it has one."""
        if expression.isidentifier():
            return expression
        if expression not in self.named:
            self.named[expression] = f"x{next(self.numbers)}"
            self.lines.append(f"{self.named[expression]} = {_bare(expression)}")
        return self.named[expression]

    # from operations to lines -------------------------------------------------------------------------------------

    def run(self, traced: Any) -> list[str]:
        """Write what a traced function computes; how its results are written."""
        jaxpr = traced.jaxpr
        self.values.update(zip(jaxpr.constvars, traced.consts, strict=True))
        needed = _needed(jaxpr)
        for eqn in needed:
            self.uses.update(a for a in eqn.invars if not isinstance(a, core.Literal))
        self.uses.update({a: 2 for a in jaxpr.outvars if not isinstance(a, core.Literal)})
        for eqn in needed:
            self._write(eqn)
        return [self.text(atom) for atom in jaxpr.outvars]

    def _write(self, eqn: Any) -> None:
        inputs = [self.value(atom) for atom in eqn.invars]
        kind, inside = eqn.primitive.name, next((eqn.params[k] for k in INSIDE if k in eqn.params), None)
        if kind in _LOOPS:
            _LOOPS[kind](self, eqn)
        elif inside is not None:
            self._inline(eqn, inside if hasattr(inside, "consts") else core.ClosedJaxpr(inside, ()))
        elif all(value is not None for value in inputs):
            found = eqn.primitive.bind(*inputs, **eqn.params)
            self.values.update(zip(eqn.outvars, found if eqn.primitive.multiple_results else [found], strict=True))
        elif kind == "sub" and self.text(eqn.invars[0]) == self.text(eqn.invars[1]):
            self.values[eqn.outvars[0]] = np.zeros(eqn.outvars[0].aval.shape)
        elif (expression := expression_of(eqn, [self.text(atom) for atom in eqn.invars])) is not None:
            self._keep(eqn.outvars[0], expression)
        else:
            self._inline(eqn, _implementation(eqn))

    def _keep(self, variable: Any, expression: str) -> None:
        short = self.uses[variable] == 1 and len(expression) < EXPORT.width and expression not in self.named
        self.bind([variable], [expression if short else self.name(expression)])

    def _inline(self, eqn: Any, traced: Any) -> None:
        for outer, inner in zip(eqn.invars, traced.jaxpr.invars, strict=True):
            self.take(inner, outer, self)
        self.run(traced)
        for outer, inner in zip(eqn.outvars, traced.jaxpr.outvars, strict=True):
            self.take(outer, inner, self)

    def call(self, name: str, traced: Any, given: Sequence[Any], inputs: Sequence[str]) -> str:
        """A call of a traced function, written as a function inside this one; `given` are operands known here."""
        inner = _Scope(self.numbers)
        for outer, variable in zip(given, traced.jaxpr.invars, strict=False):
            inner.take(variable, outer, self)
        arguments = [f"x{next(self.numbers)}" for _ in inputs]
        inner.bind(traced.jaxpr.invars[len(given) :], arguments)
        self.lines += _function(name, arguments, traced, inner)
        return f"{name}({', '.join(inputs)})"

    def take(self, variable: Any, outer: Any, scope: "_Scope") -> None:
        """Let a variable stand for an operand of this scope or of the one around it."""
        if (value := scope.value(outer)) is not None:
            self.values[variable] = value
        else:
            self.bind([variable], [scope.name(scope.text(outer))])

    def results(self, eqn: Any) -> list[str]:
        """Names for the results of an operation."""
        names = [f"x{next(self.numbers)}" for _ in eqn.outvars]
        self.bind(eqn.outvars, names)
        return names


def constant(value: Any) -> str:
    """A number or an array as Python writes it."""
    array = np.asarray(value)
    if array.ndim:
        return f"np.array([{', '.join(constant(part) for part in array)}])"
    text = repr(array.item()).replace("inf", "np.inf").replace("nan", "np.nan")
    return f"({text})" if text.startswith("-") else text


def _bare(expression: str) -> str:
    """An expression without the brackets around all of it."""
    depths = list(accumulate({"(": 1, ")": -1}.get(sign, 0) for sign in expression))
    around = expression.startswith("(") and 0 not in depths[:-1]
    return expression[1:-1] if around else expression


def _needed(jaxpr: Any) -> list[Any]:
    """The operations that a result depends on, in order."""
    wanted, kept = {atom for atom in jaxpr.outvars if not isinstance(atom, core.Literal)}, []
    for eqn in reversed(jaxpr.eqns):
        if wanted & set(eqn.outvars):
            kept.append(eqn)
            wanted |= {atom for atom in eqn.invars if not isinstance(atom, core.Literal)}
    return kept[::-1]


def _implementation(eqn: Any) -> Any:
    """What an operation that is not known does, where it is made of others."""
    shapes = [jax.ShapeDtypeStruct(atom.aval.shape, atom.aval.dtype) for atom in eqn.invars]
    try:
        traced = jax.make_jaxpr(lambda *inputs: eqn.primitive.impl(*inputs, **eqn.params))(*shapes)
    except Exception:
        raise UnknownOperation(eqn.primitive.name) from None
    if eqn.primitive.name in _operations(traced.jaxpr):
        raise UnknownOperation(eqn.primitive.name)
    return traced


def _operations(jaxpr: Any) -> set[str]:
    """The names of the operations of a traced function, to any depth."""
    names = {eqn.primitive.name for eqn in jaxpr.eqns}
    inside = (eqn.params[key] for eqn in jaxpr.eqns for key in INSIDE if key in eqn.params)
    return names.union(*(_operations(getattr(each, "jaxpr", each)) for each in inside))


# Loops and branches --------------------------------------------------------------------------------------------------


def _while(scope: _Scope, eqn: Any) -> None:
    test, body, carried = _split(scope, eqn, eqn.params["cond_nconsts"], eqn.params["body_nconsts"])
    names, loop = scope.results(eqn), f"loop{next(scope.numbers)}"
    scope.lines.append(f"{_many(names)} = {_many(map(scope.text, carried))}")
    going = scope.call(f"{loop}_goes_on", eqn.params["cond_jaxpr"], test, names)
    turn = scope.call(f"{loop}_turn", eqn.params["body_jaxpr"], body, names)
    scope.lines += [f"while {going}[0]:", f"    {_many(names)} = {turn}"]


def _scan(scope: _Scope, eqn: Any) -> None:
    p = eqn.params
    constants, carried, rows = _split(scope, eqn, p["num_consts"], p["num_carry"])
    names, loop = scope.results(eqn), f"loop{next(scope.numbers)}"
    kept, stacked = names[: p["num_carry"]], names[p["num_carry"] :]
    parts, row = [f"{name}_now" for name in stacked], [f"{scope.name(scope.text(each))}[{loop}]" for each in rows]
    turn = scope.call(f"{loop}_turn", p["jaxpr"], constants, [*kept, *row])
    order = f"reversed(range({p['length']}))" if p["reverse"] else f"range({p['length']})"
    scope.lines += [f"{name} = {scope.text(each)}" for name, each in zip(kept, carried, strict=True)]
    scope.lines += [f"{name} = []" for name in stacked]
    scope.lines += [f"for {loop} in {order}:", f"    {_many([*kept, *parts])} = {turn}"]
    scope.lines += [f"    {name}.append({part})" for name, part in zip(stacked, parts, strict=True)]
    scope.lines += [f"{name} = np.stack({name}{'[::-1]' if p['reverse'] else ''})" for name in stacked]


def _cond(scope: _Scope, eqn: Any) -> None:
    which, names, label = scope.name(scope.text(eqn.invars[0])), scope.results(eqn), f"branch{next(scope.numbers)}"
    branches = eqn.params["branches"]
    calls = [scope.call(f"{label}_{i}", each, eqn.invars[1:], ()) for i, each in enumerate(branches)]
    for i, call in enumerate(calls):
        last = "else:" if i == len(calls) - 1 else f"elif {which} <= {i}:"
        scope.lines += [last if i else f"if {which} <= 0:", f"    {_many(names)} = {call}"]


def _pieces(scope: _Scope, eqn: Any) -> None:
    ends = np.cumsum(eqn.params["sizes"])[:-1].tolist()
    names, whole = scope.results(eqn), scope.text(eqn.invars[0])
    scope.lines.append(f"{_many(names)} = np.split({whole}, {ends}, axis={eqn.params['axis']})")


def _split(scope: _Scope, eqn: Any, first: int, second: int) -> tuple[list[Any], list[Any], list[Any]]:
    return eqn.invars[:first], eqn.invars[first : first + second], eqn.invars[first + second :]


def _many(names: Iterable[str]) -> str:
    names = tuple(names)
    return ", ".join(names) + ("," if len(names) == 1 else "") or "()"


_LOOPS: dict[str, Callable[[_Scope, Any], None]] = {"while": _while, "scan": _scan, "cond": _cond, "split": _pieces}
