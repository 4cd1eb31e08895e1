"""C99 source of a function that jax has traced: the same arithmetic, written down, with no memory allocated.

Every element of every array is a variable of its own; what the C compiler can simplify is left to it.
"""

import re
from collections import Counter
from collections.abc import Callable, Sequence
from itertools import count
from typing import Any

import jax
import numpy as np

from fitting.exporting.c_operations import Texts, c_type, constant, elements_of
from fitting.exporting.settings import EXPORT
from fitting.exporting.traced import Scope

NAME, MADE = re.compile(r"\bx\d+\b"), re.compile(r"\s*const \w+ (x\d+) =")


def c_source(name: str, function: Callable, arguments: dict[str, Any]) -> str:
    """Source of a C function `name` that computes what `function(*arguments)` does and writes it to `out`, flat.

    `arguments` are example values by name: numbers, which C gets by value, or arrays, which it gets flat.
    """
    scope, traced = _Scope(count()), jax.make_jaxpr(function)(*arguments.values())
    scope.bind(traced.jaxpr.invars, [_argument(key, np.shape(value)) for key, value in arguments.items()])
    results = [text for array in scope.run(traced) for text in array.ravel()]
    given = [f"{'const MK_REAL *' if np.ndim(value) else 'MK_REAL '}{key}" for key, value in arguments.items()]
    unused = "".join(f"(void){key}; " for key in (*arguments, "out"))  # no compiler is to complain
    lines = _used([unused.rstrip(), *scope.lines, *(f"out[{i}] = {_bare(text)};" for i, text in enumerate(results))])
    head = f"static inline void {name}({', '.join([*given, 'MK_REAL *out'])}) {{"
    return "\n".join([head, *(f"    {line}" for line in lines), "}"])


def _argument(name: str, shape: tuple) -> Texts:
    names = [f"{name}[{i}]" for i in range(int(np.prod(shape)))] if shape else [name]
    return np.array(names, object).reshape(shape)


def _used(lines: list[str]) -> list[str]:
    """The lines without constants that nobody reads."""
    names = Counter(name for line in lines for name in NAME.findall(line))
    kept = [line for line in lines if not (made := MADE.match(line)) or names[made[1]] > 1]
    return kept if len(kept) == len(lines) else _used(kept)


class _Scope(Scope):
    """A block of C in the making; texts are arrays of names or short expressions, one per element."""

    def constant(self, value: Any) -> Texts:
        return constant(value)

    def named_text(self, text: Texts) -> Texts:
        return text  # every element that is not short has a name already

    def write(self, eqn: Any) -> bool:
        texts = elements_of(eqn, [self.text(atom) for atom in eqn.invars])
        if texts is not None:
            self.bind(eqn.outvars, [self._short(texts, eqn.outvars[0])])
        return texts is not None

    def _short(self, texts: Texts, variable: Any) -> Texts:
        """Elements under names of their own, unless they are short and used once."""
        once, kind = self.uses[variable] == 1, c_type(variable.aval.dtype)
        short = lambda text: _simple(text) or (once and len(text) < EXPORT.width)  # noqa: E731
        named = [text if short(text) else self.name(text, kind) for text in texts.ravel()]
        return np.array(named, object).reshape(texts.shape)

    def name(self, text: str, kind: str) -> str:
        """A name for an expression; the one it has, if it has one."""
        if text not in self.named:
            self.named[text] = f"x{next(self.numbers)}"
            self.lines.append(f"const {kind} {self.named[text]} = {_bare(text)};")
        return self.named[text]

    def inner(self) -> "_Scope":
        """A block inside this one, which sees what is known here."""
        block = _Scope(self.numbers)
        block.texts, block.values, block.named = self.texts, self.values, dict(self.named)
        return block

    def inside(self, traced: Any, given: Sequence[Any], inputs: Sequence[Texts]) -> list[Texts]:
        """Write a traced function here; `given` are operands, `inputs` texts of the arguments that follow them."""
        for outer, variable in zip(given, traced.jaxpr.invars, strict=False):
            self.take(variable, outer, self)
        self.bind(traced.jaxpr.invars[len(given) :], inputs)
        return self.run(traced)

    def variables(self, atoms: Sequence[Any], start: Sequence[Texts] | None = None) -> list[Texts]:
        """Variables of C that a loop or a branch will change, for the results of an operation."""
        made = []
        for number, atom in enumerate(atoms):
            names = np.array([f"x{next(self.numbers)}" for _ in range(atom.aval.size)], object)
            first = names if start is None else start[number].ravel()
            ends = [
                f"{name};" if start is None else f"{name} = {text};" for name, text in zip(names, first, strict=True)
            ]
            self.lines += [f"{c_type(atom.aval.dtype)} {end}" for end in ends]
            made.append(names.reshape(atom.aval.shape))
        return made

    def assign(self, names: Sequence[Texts], texts: Sequence[Texts], kinds: Sequence[Any]) -> None:
        """Change variables all at once: the new values may be made of the old."""
        pairs = [
            (name, text, c_type(kind.aval.dtype))
            for some, news, kind in zip(names, texts, kinds, strict=True)
            for name, text in zip(some.ravel(), np.broadcast_to(news, some.shape).ravel(), strict=True)
            if name != text
        ]
        held = [(name, f"x{next(self.numbers)}", text, kind) for name, text, kind in pairs]
        self.lines += [f"const {kind} {new} = {_bare(text)};" for _, new, text, kind in held]
        self.lines += [f"{name} = {new};" for name, new, _, _ in held]


def _simple(text: str) -> bool:
    """Whether a text is a name or a constant."""
    return text.replace("[", "").replace("]", "").isidentifier() or text.isdecimal() or text.startswith("MK_C(")


def _bare(text: str) -> str:
    """An expression without the brackets around all of it."""
    depth = 0
    for place, sign in enumerate(text):
        depth += {"(": 1, ")": -1}.get(sign, 0)
        if depth == 0 and place < len(text) - 1:
            return text
    return text[1:-1] if text.startswith("(") else text


# Loops and branches --------------------------------------------------------------------------------------------------


def _while(scope: _Scope, eqn: Any) -> None:
    tests, bodies = eqn.params["cond_nconsts"], eqn.params["body_nconsts"]
    constants, start = eqn.invars[: tests + bodies], eqn.invars[tests + bodies :]
    names = scope.variables(eqn.outvars, [scope.text(each) for each in start])
    turn = scope.inner()
    (going,) = turn.inside(eqn.params["cond_jaxpr"], constants[:tests], names)
    turn.lines.append(f"if (!{going[()]}) break;")
    turn.assign(names, turn.inside(eqn.params["body_jaxpr"], constants[tests:], names), eqn.outvars)
    scope.lines += ["for (;;) {", *(f"    {line}" for line in turn.lines), "}"]
    scope.bind(eqn.outvars, names)


def _scan(scope: _Scope, eqn: Any) -> None:
    """A loop of known length that keeps no row is a loop; one that reads or keeps rows is written turn by turn."""
    p = eqn.params
    fixed, carried = eqn.invars[: p["num_consts"]], eqn.invars[p["num_consts"] : p["num_consts"] + p["num_carry"]]
    rows, start = eqn.invars[p["num_consts"] + p["num_carry"] :], [scope.text(each) for each in carried]
    kept, stacked = eqn.outvars[: p["num_carry"]], eqn.outvars[p["num_carry"] :]
    if not rows and not stacked:
        names, turn, counter = scope.variables(kept, start), scope.inner(), f"turn{next(scope.numbers)}"
        turn.assign(names, turn.inside(p["jaxpr"], fixed, names), kept)
        scope.lines += [f"for (int {counter} = 0; {counter} < {p['length']}; ++{counter}) {{"]
        scope.lines += [*(f"    {line}" for line in turn.lines), "}"]
        scope.bind(kept, names)
        return
    order, made = range(p["length"])[:: -1 if p["reverse"] else 1], {}
    arrays = [scope.text(each) for each in rows]
    for row in order:
        results = scope.inside(p["jaxpr"], fixed, [*start, *(np.asarray(a[row], object) for a in arrays)])
        start, made[row] = results[: len(kept)], results[len(kept) :]
    scope.bind(kept, start)
    scope.bind(stacked, [np.stack([made[row][i] for row in sorted(made)]) for i in range(len(stacked))])


def _cond(scope: _Scope, eqn: Any) -> None:
    which, names = scope.text(eqn.invars[0])[()], scope.variables(eqn.outvars)
    branches = eqn.params["branches"]
    for number, branch in enumerate(branches):
        block = scope.inner()
        block.assign(names, block.inside(branch, eqn.invars[1:], ()), eqn.outvars)
        head = "} else {" if number == len(branches) - 1 else f"}} else if ({which} <= {number}) {{"
        scope.lines += [head.removeprefix("} else ") if number == 0 else head, *(f"    {line}" for line in block.lines)]
    scope.lines.append("}")
    scope.bind(eqn.outvars, names)


def _pieces(scope: _Scope, eqn: Any) -> None:
    ends = np.cumsum(eqn.params["sizes"])[:-1].tolist()
    scope.bind(eqn.outvars, np.split(scope.text(eqn.invars[0]), ends, axis=eqn.params["axis"]))


_Scope.loops = {"while": _while, "scan": _scan, "cond": _cond, "split": _pieces}
