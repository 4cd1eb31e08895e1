"""The form between a model and a language: jax's trace of a function, walked once, the same for every language.

What depends on no argument is computed now, what nobody uses is left out. An operation that the language has no form
for is traced through its own implementation, and refused by name where that leads no further.
"""

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any, Self

import jax
import numpy as np
from jax.extend import core

INSIDE = ("jaxpr", "call_jaxpr", "fun_jaxpr")  # where an operation keeps the function that it calls


class UnknownOperation(Exception):
    """An operation of jax that has no expression in the language to be written."""


class Scope:
    """The body of one function in the making; a language says how operands, operations and loops are written.

    A text is how a variable is written: whatever the language chooses, a name or an expression.
    """

    loops: Mapping[str, Callable[[Any, Any], None]] = {}  # operations of jax that become more than an expression

    def __init__(self, numbers: Iterator[int]) -> None:
        self.lines: list[str] = []
        self.numbers = numbers
        self.texts: dict[Any, Any] = {}  # of variables: a name or a short expression
        self.values: dict[Any, Any] = {}  # of variables that depend on no argument
        self.named: dict[Any, str] = {}  # expressions that have a name already
        self.uses: Counter[Any] = Counter()

    # what a language says --------------------------------------------------------------------------------------------

    def constant(self, value: Any) -> Any:
        """The text of a number or an array."""
        raise NotImplementedError

    def named_text(self, text: Any) -> Any:
        """A text that is a name, for a variable that may be used anywhere below."""
        raise NotImplementedError

    def write(self, eqn: Any) -> bool:
        """Write one operation; False where the language has none for it."""
        raise NotImplementedError

    # what is known of a variable -------------------------------------------------------------------------------------

    def bind(self, variables: Iterable[Any], texts: Iterable[Any]) -> None:
        """Say how variables are written. A function that is called twice has the same variables, with other values."""
        for variable, text in zip(variables, texts, strict=True):
            self.texts[variable] = text
            self.values.pop(variable, None)

    def text(self, atom: Any) -> Any:
        """How an operand is written."""
        value = self.value(atom)
        return self.texts[atom] if value is None else self.constant(value)

    def value(self, atom: Any) -> Any:
        """The value of an operand that depends on no argument, else None."""
        return atom.val if isinstance(atom, core.Literal) else self.values.get(atom)

    def take(self, variable: Any, outer: Any, scope: Self) -> None:
        """Let a variable stand for an operand of this scope or of the one around it."""
        if (value := scope.value(outer)) is not None:
            self.values[variable] = value
        else:
            self.bind([variable], [scope.named_text(scope.text(outer))])

    # from operations to lines ----------------------------------------------------------------------------------------

    def run(self, traced: Any) -> list[Any]:
        """Write what a traced function computes; how its results are written."""
        jaxpr = traced.jaxpr
        self.values.update(zip(jaxpr.constvars, traced.consts, strict=True))
        needed = _needed(jaxpr)
        for eqn in needed:
            self.uses.update(a for a in eqn.invars if not isinstance(a, core.Literal))
        self.uses.update({a: 2 for a in jaxpr.outvars if not isinstance(a, core.Literal)})
        for eqn in needed:
            self._walk(eqn)
        return [self.text(atom) for atom in jaxpr.outvars]

    def _walk(self, eqn: Any) -> None:
        inputs = [self.value(atom) for atom in eqn.invars]
        kind, inside = eqn.primitive.name, next((eqn.params[k] for k in INSIDE if k in eqn.params), None)
        if kind in self.loops:
            self.loops[kind](self, eqn)
        elif inside is not None:
            self._inline(eqn, inside if hasattr(inside, "consts") else core.ClosedJaxpr(inside, ()))
        elif all(value is not None for value in inputs):
            found = eqn.primitive.bind(*inputs, **eqn.params)
            self.values.update(zip(eqn.outvars, found if eqn.primitive.multiple_results else [found], strict=True))
        elif kind == "sub" and np.array_equal(self.text(eqn.invars[0]), self.text(eqn.invars[1])):
            self.values[eqn.outvars[0]] = np.zeros(eqn.outvars[0].aval.shape)
        elif not self.write(eqn):
            self._inline(eqn, _implementation(eqn))

    def _inline(self, eqn: Any, traced: Any) -> None:
        for outer, inner in zip(eqn.invars, traced.jaxpr.invars, strict=True):
            self.take(inner, outer, self)
        self.run(traced)
        for outer, inner in zip(eqn.outvars, traced.jaxpr.outvars, strict=True):
            self.take(outer, inner, self)


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
