"""Python source, with numpy alone, of a function that jax has traced: the same arithmetic, written down.

jax traces a function to a list of primitive operations. Each becomes one numpy expression, and what occurs twice is
written once.
"""

from collections.abc import Callable, Iterable, Sequence
from itertools import accumulate, count
from typing import Any

import jax
import numpy as np

from fitting.exporting.operations import expression_of
from fitting.exporting.settings import EXPORT
from fitting.exporting.traced import Scope


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


class _Scope(Scope):
    """The body of one Python function in the making; texts are names or short expressions."""

    def constant(self, value: Any) -> str:
        return constant(value)

    def named_text(self, text: Any) -> str:
        return self.name(text)

    def write(self, eqn: Any) -> bool:
        expression = expression_of(eqn, [self.text(atom) for atom in eqn.invars])
        if expression is not None:
            self._keep(eqn.outvars[0], expression)
        return expression is not None

    def name(self, expression: str) -> str:
        """A name for an expression; the one it has, if it has one."""
        if expression.isidentifier():
            return expression
        if expression not in self.named:
            self.named[expression] = f"x{next(self.numbers)}"
            self.lines.append(f"{self.named[expression]} = {_bare(expression)}")
        return self.named[expression]

    def _keep(self, variable: Any, expression: str) -> None:
        short = self.uses[variable] == 1 and len(expression) < EXPORT.width and expression not in self.named
        self.bind([variable], [expression if short else self.name(expression)])

    def call(self, name: str, traced: Any, given: Sequence[Any], inputs: Sequence[str]) -> str:
        """A call of a traced function, written as a function inside this one; `given` are operands known here."""
        inner = _Scope(self.numbers)
        for outer, variable in zip(given, traced.jaxpr.invars, strict=False):
            inner.take(variable, outer, self)
        arguments = [f"x{next(self.numbers)}" for _ in inputs]
        inner.bind(traced.jaxpr.invars[len(given) :], arguments)
        self.lines += _function(name, arguments, traced, inner)
        return f"{name}({', '.join(inputs)})"

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


_Scope.loops = {"while": _while, "scan": _scan, "cond": _cond, "split": _pieces}
