"""The review's equations in words."""

from collections.abc import Callable, Sequence
from typing import Any

from rich.console import RenderableType
from rich.table import Table
from rich.text import Text

from fitting.errors import InputError
from fitting.report.text.layout import line, lines
from mckibben_jax.laws.review import EQUATIONS, Equation, lookup

STATUS = {"ok": "", "misprint": "misprint", "questionable": "questionable", "addition": "not in the review"}


def equations_numbered(numbers: Sequence[str]) -> tuple[Equation, ...]:
    """The equations of these numbers, or all."""
    try:
        return tuple(lookup(number) for number in numbers) or EQUATIONS
    except ValueError as error:
        raise InputError(str(error), cure="'mckibben equations' lists them") from None


def equations_report(equations: Sequence[Equation]) -> list[RenderableType]:
    """A line for each."""
    table = Table.grid(padding=(0, 2))
    for equation in equations:
        status = Text(STATUS[equation.status], style="yellow")
        table.add_row(Text(equation.number, style="bold"), Text(equation.quantity), status)
    return [table, Text(), Text("'mckibben equations NUMBER' explains one.")]


def equation_report(equation: Equation) -> list[RenderableType]:
    """One equation in full."""
    shown: list[RenderableType] = [Text(f"{equation.number}: {equation.quantity}", style="bold")]
    shown.append(line("FORMULA", equation.formula + (", as printed" if equation.formula_printed else "")))
    shown.append(line("SYMBOLS", equation.symbols))
    shown.append(line("IN PRINT", STATUS[equation.status] or "correct"))
    shown += lines("NOTE", [equation.correction] if equation.correction else [])
    shown += [line(label, function_name(function)) for label, function in _functions(equation).items()]
    return [*shown, Text()]


def _functions(equation: Equation) -> dict[str, Callable]:
    """What computes the formula, and its sound or printed counterpart where there is one."""
    sound, printed = equation.function, equation.printed
    if printed is None:
        return {"CALL": sound}
    return {"CALL": printed, "SOUND": sound} if equation.formula_printed else {"CALL": sound, "PRINTED": printed}


def function_name(function: Callable) -> str:
    """How a function is reached from Python."""
    return f"{function.__module__}.{function.__name__}"


def equations_result(equations: Sequence[Equation]) -> dict[str, Any]:
    """The same for machines."""
    return {
        e.number: {
            "quantity": e.quantity,
            "formula": e.formula,
            "formula_printed": e.formula_printed,
            "symbols": e.symbols,
            "status": e.status,
            "correction": e.correction,
            "function": function_name(e.function),
            "printed": function_name(e.printed) if e.printed else None,
        }
        for e in equations
    }
