"""Operations of jax as numpy writes them: one expression for each, from how its operands are written."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

INFIX = {
    "add": "+", "add_any": "+", "sub": "-", "mul": "*", "div": "/", "pow": "**", "lt": "<", "le": "<=", "gt": ">",
    "ge": ">=", "eq": "==", "ne": "!=", "and": "&", "or": "|", "xor": "^", "lt_to": "<", "le_to": "<=", "eq_to": "==",
}  # fmt: skip
CALLS = {
    "sin": "sin", "cos": "cos", "tan": "tan", "asin": "arcsin", "acos": "arccos", "atan": "arctan", "atan2": "arctan2",
    "sinh": "sinh", "cosh": "cosh", "tanh": "tanh", "asinh": "arcsinh", "acosh": "arccosh", "atanh": "arctanh",
    "exp": "exp", "exp2": "exp2", "expm1": "expm1", "log": "log", "log1p": "log1p", "sqrt": "sqrt", "cbrt": "cbrt",
    "square": "square", "abs": "abs", "sign": "sign", "floor": "floor", "ceil": "ceil", "neg": "negative",
    "max": "maximum", "min": "minimum", "rem": "fmod", "nextafter": "nextafter", "is_finite": "isfinite",
    "not": "logical_not", "select_if_vmap": "where", "unvmap_any": "any", "unvmap_all": "all",
}  # fmt: skip
REDUCTIONS = {
    "reduce_sum": "sum", "reduce_prod": "prod", "reduce_max": "max", "reduce_min": "min", "reduce_and": "all",
    "reduce_or": "any",
}  # fmt: skip
ALIASES = ("copy", "copy_p", "stop_gradient", "nonbatchable", "nondifferentiable", "nondifferentiable_backward",
           "optimization_barrier", "reduce_precision")  # fmt: skip
NEUTRAL = {  # operations that change nothing: which, the other operand, and whether that is the last
    *((kind, "0.0", last) for kind in ("add", "add_any") for last in (True, False)),
    *((kind, one, last) for kind, one in (("mul", "1.0"), ("and", "True"), ("or", "False")) for last in (True, False)),
    ("div", "1.0", True),
    ("sub", "0.0", True),
}


def expression_of(eqn: Any, texts: Sequence[str]) -> str | None:
    """The operation of an equation as a numpy expression of its operands; None where there is none."""
    kind, out = eqn.primitive.name, eqn.outvars[0].aval
    same = [atom.aval.shape == out.shape and atom.aval.dtype == out.dtype for atom in eqn.invars]
    for text, other, alike in zip(texts, texts[::-1], same, strict=True):
        if alike and len(texts) < 3 and (kind, other, other == texts[-1]) in NEUTRAL:
            return text
    if kind in INFIX and not (kind == "div" and np.issubdtype(out.dtype, np.integer)):
        return f"({texts[0]} {INFIX[kind]} {texts[1]})"
    if kind in CALLS:
        return f"np.{CALLS[kind]}({', '.join(texts)})"
    if kind in REDUCTIONS and eqn.params["axes"]:
        return f"np.{REDUCTIONS[kind]}({texts[0]}, axis={tuple(map(int, eqn.params['axes']))})"
    if kind in ALIASES or (kind in _SHAPES and same[0]):
        return texts[0]
    return _OTHERS[kind](eqn.params, out.shape, *texts) if kind in _OTHERS else None


# Operations that need their parameters -------------------------------------------------------------------------------


def _converted(params: dict, shape: tuple, x: str) -> str:
    return f"np.asarray({x}, np.{np.dtype(params['new_dtype']).name})"


def _broadcast(params: dict, shape: tuple, x: str) -> str:
    kept, there = params["broadcast_dimensions"], tuple(range(len(shape)))
    axes = ", ".join(":" if axis in kept else "None" for axis in there)
    last = not kept or kept == there[-len(kept) :]  # then numpy does the same by itself
    return f"np.broadcast_to({x if last else f'{x}[{axes}]'}, {shape})"


def _reshaped(params: dict, shape: tuple, x: str) -> str:
    return f"np.reshape({x}, {shape})"


def _sliced(params: dict, shape: tuple, x: str) -> str:
    strides = params["strides"] or (1,) * len(params["start_indices"])
    ends = zip(params["start_indices"], params["limit_indices"], strides, strict=True)
    return f"{x}[{', '.join(f'{a}:{b}:{s}' for a, b, s in ends)}]"


def _dynamic(params: dict, shape: tuple, x: str, *starts: str) -> str:
    sizes = params["slice_sizes"]
    first = (f"np.clip({a}, 0, np.shape({x})[{i}] - {n})" for i, (a, n) in enumerate(zip(starts, sizes, strict=True)))
    return f"{x}[np.ix_({', '.join(f'{a} + np.arange({n})' for a, n in zip(first, sizes, strict=True))})]"


def _selected(params: dict, shape: tuple, which: str, *cases: str) -> str:
    if len(cases) == 2:
        return f"np.where({which}, {cases[1]}, {cases[0]})"
    return f"np.choose({which}, [{', '.join(cases)}])"


def _contracted(params: dict, shape: tuple, a: str, b: str) -> str | None:
    axes, batch = params["dimension_numbers"]
    return None if any(batch) else f"np.tensordot({a}, {b}, {tuple(map(tuple, axes))})"


_SHAPES = ("broadcast_in_dim", "reshape", "squeeze", "expand_dims", "convert_element_type", *REDUCTIONS)
_OTHERS: dict[str, Callable[..., str | None]] = {
    "dot_general": _contracted,
    "convert_element_type": _converted,
    "broadcast_in_dim": _broadcast,
    "reshape": _reshaped,
    "squeeze": _reshaped,
    "expand_dims": _reshaped,
    "slice": _sliced,
    "dynamic_slice": _dynamic,
    "select_n": _selected,
    "integer_pow": lambda params, shape, x: f"({x} ** {params['y']})",
    "rsqrt": lambda params, shape, x: f"(1 / np.sqrt({x}))",
    "logistic": lambda params, shape, x: f"(1 / (1 + np.exp(-{x})))",
    "clamp": lambda params, shape, low, x, high: f"np.minimum(np.maximum({x}, {low}), {high})",
    "concatenate": lambda params, shape, *xs: f"np.concatenate([{', '.join(xs)}], axis={params['dimension']})",
    "stack": lambda params, shape, *xs: f"np.stack([{', '.join(xs)}], axis={params.get('axis', 0)})",
    "transpose": lambda params, shape, x: f"np.transpose({x}, {tuple(params['permutation'])})",
    "rev": lambda params, shape, x: f"np.flip({x}, {tuple(params['dimensions'])})",
}
