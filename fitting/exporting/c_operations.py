"""Operations of jax in C: element by element, for every array is written out as its elements.

Arrays are numpy arrays of text, so that what only moves elements about (a slice, a transpose) is done now, by numpy,
and costs nothing in C. `MK_F(sin)` is the function of the precision in which the file is compiled.
"""

from collections.abc import Callable, Sequence
from functools import reduce
from typing import Any

import numpy as np

from fitting.exporting.operations import ALIASES

Texts = np.ndarray  # of str, in the shape of the array that it stands for

INFIX = {
    "add": "+", "add_any": "+", "sub": "-", "mul": "*", "div": "/", "lt": "<", "le": "<=", "gt": ">", "ge": ">=",
    "eq": "==", "ne": "!=", "lt_to": "<", "le_to": "<=", "eq_to": "==",
}  # fmt: skip
LOGIC = {"and": "&", "or": "|", "xor": "^"}
OF_MATH = {
    **{name: name for name in ("sin", "cos", "tan", "asin", "acos", "atan", "atan2", "sinh", "cosh", "tanh", "asinh",
                               "acosh", "atanh", "exp", "exp2", "expm1", "log", "log1p", "sqrt", "cbrt", "floor",
                               "ceil", "pow", "nextafter")},
    "abs": "fabs", "rem": "fmod",
}  # fmt: skip
OURS = {"square": "mk_square", "sign": "mk_sign", "max": "mk_max", "min": "mk_min", "is_finite": "mk_finite"}
OF_INTEGERS = {
    "abs": "({0} < 0 ? -{0} : {0})", "rem": "({0} % {1})", "max": "({0} > {1} ? {0} : {1})", "pow": None,
    "min": "({0} < {1} ? {0} : {1})", "sign": "(({0} > 0) - ({0} < 0))", "square": "({0} * {0})", "is_finite": "1",
}  # fmt: skip
REDUCTIONS = {
    "reduce_sum": "({0} + {1})", "reduce_prod": "({0} * {1})", "reduce_max": "mk_max({0}, {1})",
    "reduce_min": "mk_min({0}, {1})", "reduce_and": "({0} && {1})", "reduce_or": "({0} || {1})",
}  # fmt: skip
NEUTRAL = {("add", "0.0"), ("add_any", "0.0"), ("mul", "1.0")}  # with either operand
NEUTRAL_LAST = {("sub", "0.0"), ("div", "1.0")}

HELPERS = """static inline MK_REAL mk_square(MK_REAL x) { return x * x; }
static inline MK_REAL mk_sign(MK_REAL x) { return x > 0 ? MK_C(1) : x < 0 ? MK_C(-1) : x; }
static inline MK_REAL mk_max(MK_REAL a, MK_REAL b) { return a > b || a != a ? a : b; }
static inline MK_REAL mk_min(MK_REAL a, MK_REAL b) { return a < b || a != a ? a : b; }
static inline int mk_finite(MK_REAL x) { return x - x == 0; }
static inline MK_REAL mk_power(MK_REAL x, int n) {
    MK_REAL y = MK_C(1);
    for (int left = n < 0 ? -n : n; left; left >>= 1, x *= x)
        if (left & 1) y *= x;
    return n < 0 ? MK_C(1) / y : y;
}
"""


def c_type(dtype: Any) -> str:
    """The type of an element in C."""
    return "MK_REAL" if np.issubdtype(dtype, np.floating) else "int"


def constant(value: Any) -> Texts:
    """A number or an array as C writes it: numbers that a float cannot hold are marked."""
    array = np.asarray(value)
    return np.array([_number(each) for each in array.ravel()], object).reshape(array.shape)


def _number(value: Any) -> str:
    if not np.issubdtype(np.asarray(value).dtype, np.floating):
        return f"({int(value)})" if value < 0 else str(int(value))
    size, sign = abs(float(value)), "-" if np.signbit(value) else ""
    if np.isnan(value):
        text = "MK_C(NAN)"
    elif np.isinf(value):
        text = f"MK_C({sign}INFINITY)"
    elif 0 < size < np.finfo(np.float32).tiny or size > np.finfo(np.float32).max:
        text = f"MK_C({sign}{'MK_SMALL' if size < 1 else 'MK_LARGE'}({size!r}))"
    else:
        text = f"MK_C({sign}{size!r})"
    return text


def elements_of(eqn: Any, texts: list[Texts]) -> Texts | None:
    """The elements of an operation's result as C expressions of those of its operands; None where there is none."""
    kind, out, params = eqn.primitive.name, eqn.outvars[0].aval, eqn.params
    if kind in _SHAPES:
        return _SHAPES[kind](params, out.shape, *texts)
    if kind in REDUCTIONS:
        return _reduced(REDUCTIONS[kind], texts[0], params["axes"], out.shape)
    if kind in ("unvmap_any", "unvmap_all"):
        return _reduced(f"({{0}} {'||' if kind == 'unvmap_any' else '&&'} {{1}})", texts[0], None, out.shape)
    one = _element(kind, params, eqn.invars[0].aval.dtype, out.dtype)
    if one is None:
        return None
    spread = [np.broadcast_to(each, out.shape).ravel() for each in texts]
    return np.array([one(*each) for each in zip(*spread, strict=True)], object).reshape(out.shape)


def _element(kind: str, params: dict, given: Any, out: Any) -> Callable[..., str] | None:
    """How one element is written, by the texts of its operands; None where that is not known."""
    whole = not np.issubdtype(given, np.floating)
    if whole and kind in OF_INTEGERS:
        return OF_INTEGERS[kind] and OF_INTEGERS[kind].format
    if kind in INFIX:
        return lambda a, b: _infix(kind, a, b)
    if kind in LOGIC:
        return lambda a, b: f"({a} {LOGIC[kind]} {b})"
    if kind in OF_MATH:
        return lambda *xs: f"MK_F({OF_MATH[kind]})({', '.join(xs)})"
    if kind in OURS:
        return lambda *xs: f"{OURS[kind]}({', '.join(xs)})"
    if kind in ALIASES:
        return lambda x: x
    return _others(params, given, out).get(kind)


def _infix(kind: str, a: str, b: str) -> str:
    first, last = (_plain(text) for text in (a, b))
    if (kind, last) in NEUTRAL | NEUTRAL_LAST:
        return a
    return b if (kind, first) in NEUTRAL else f"({a} {INFIX[kind]} {b})"


def _plain(text: str) -> str:
    return text.removeprefix("MK_C(").removesuffix(")")


def _others(params: dict, given: Any, out: Any) -> dict[str, Callable[..., str]]:
    return {
        "neg": lambda x: f"(-{x})",
        "not": lambda x: f"(!{x})" if given == np.bool_ else f"(~{x})",
        "select_if_vmap": lambda which, a, b: f"({which} ? {a} : {b})",
        "select_n": _selected,
        "clamp": lambda low, x, high: f"mk_min(mk_max({x}, {low}), {high})",
        "integer_pow": lambda x: f"mk_power({x}, {params['y']})",
        "rsqrt": lambda x: f"(MK_C(1) / MK_F(sqrt)({x}))",
        "logistic": lambda x: f"(MK_C(1) / (MK_C(1) + MK_F(exp)(-{x})))",
        "convert_element_type": lambda x: _converted(x, given, out),
    }


def _selected(which: str, *cases: str) -> str:
    """A case by its number; of two, the second where the condition holds."""
    if len(cases) == 2:
        return f"({which} ? {cases[1]} : {cases[0]})"
    return _numbered(which, cases)


def _numbered(which: str, cases: Sequence[str]) -> str:
    """A case by its number, the last for every number above."""
    numbers = range(len(cases) - 1)[::-1]
    return reduce(lambda last, number: f"({which} <= {number} ? {cases[number]} : {last})", numbers, cases[-1])


def _converted(x: str, given: Any, out: Any) -> str:
    if c_type(given) == c_type(out) and out != np.bool_:
        return x
    return f"({x} != 0)" if out == np.bool_ else f"(({c_type(out)}){x})"


# Operations that move elements about, or bring them together ---------------------------------------------------------


def _reduced(pair: str, texts: Texts, axes: Any, shape: tuple) -> Texts:
    axes = tuple(range(texts.ndim)) if axes is None else tuple(axes)
    rows = np.moveaxis(texts, axes, range(len(axes))).reshape(-1, int(np.prod(shape, dtype=int)))
    return np.array([reduce(pair.format, column) for column in rows.T], object).reshape(shape)


def _broadcast(params: dict, shape: tuple, x: Texts) -> Texts:
    kept = params["broadcast_dimensions"]
    axes = tuple(x.shape[kept.index(axis)] if axis in kept else 1 for axis in range(len(shape)))
    return np.broadcast_to(x.reshape(axes), shape)


def _sliced(params: dict, shape: tuple, x: Texts) -> Texts:
    strides = params["strides"] or (1,) * len(params["start_indices"])
    ends = zip(params["start_indices"], params["limit_indices"], strides, strict=True)
    return x[tuple(slice(*each) for each in ends)]


def _dynamic(params: dict, shape: tuple, x: Texts, *starts: Texts) -> Texts | None:
    """Elements from a place that is known only when the program runs: a choice among all places."""
    if x.ndim != 1:
        return None
    (size,), first, places = params["slice_sizes"], str(starts[0][()]), len(x) - params["slice_sizes"][0]
    cases = [[str(x[start + k]) for start in range(places + 1)] for k in range(size)]
    return np.array([_numbered(first, each) for each in cases], object)


def _contracted(params: dict, shape: tuple, a: Texts, b: Texts) -> Texts | None:
    (left, right), batch = params["dimension_numbers"]
    if any(batch):
        return None
    rows = np.moveaxis(a, left, range(a.ndim - len(left), a.ndim)).reshape(-1, int(np.prod([a.shape[i] for i in left])))
    columns = np.moveaxis(b, right, range(len(right))).reshape(rows.shape[1], -1)
    summed = lambda row, column: "(" + " + ".join(f"{x} * {y}" for x, y in zip(row, column, strict=True)) + ")"  # noqa: E731
    return np.array([summed(row, column) for row in rows for column in columns.T], object).reshape(shape)


def _reshaped(params: dict, shape: tuple, x: Texts) -> Texts:
    return x.reshape(shape)


_SHAPES: dict[str, Callable[..., Texts | None]] = {
    "dot_general": _contracted,
    "broadcast_in_dim": _broadcast,
    "reshape": _reshaped,
    "squeeze": _reshaped,
    "expand_dims": _reshaped,
    "slice": _sliced,
    "dynamic_slice": _dynamic,
    "concatenate": lambda params, shape, *xs: np.concatenate(xs, axis=params["dimension"]),
    "stack": lambda params, shape, *xs: np.stack(xs, axis=params.get("axis", 0)),
    "transpose": lambda params, shape, x: np.transpose(x, params["permutation"]),
    "rev": lambda params, shape, x: np.flip(x, params["dimensions"]),
}
