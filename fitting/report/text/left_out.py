"""How well each data set is predicted by a fit of the others, in words and for machines."""

from collections.abc import Sequence
from typing import Any

from rich.console import RenderableType

from fitting import full_names
from fitting.least_squares.left_out_sets import LeftOutSet
from fitting.report.text.amounts import amount, percent
from fitting.report.text.layout import columns, line, spaced
from fitting.report.text.names import marked


def left_out_report(found: Sequence[LeftOutSet]) -> list[RenderableType]:
    """A line on what was done, and a table of the errors of each data set."""
    heads, rows = left_out_table(found)
    table = columns(*heads)
    for row in rows:
        table.add_row(*row)
    return [line("", ""), line("LEFT OUT", " ".join(left_out_texts(found))), spaced(table)]


def left_out_table(found: Sequence[LeftOutSet]) -> tuple[tuple[str, ...], tuple[tuple[str, ...], ...]]:
    """The errors of each data set: heads, and a row of cells for each."""
    sizes = _own_sizes(found)
    fitted = ("its own fitted", "of full scale") if sizes else ()
    rows = list[tuple[str, ...]]()
    for each in found:
        then = (amount(each.then, each.unit), percent(each.then_share)) if sizes else ()
        errors = (amount(error, each.unit) for error in (each.beyond, each.together))
        rows.append((each.dataset, amount(each.predicted, each.unit), percent(each.share), *then, *errors))
    return ("data set", "predicted", "of full scale", *fitted, "beyond instruments", "fit of all"), tuple(rows)


def _own_sizes(found: Sequence[LeftOutSet]) -> tuple[str, ...]:
    """The sizes that each data set has to itself, by their names."""
    return tuple(dict.fromkeys(full_names.common(name) for each in found for name in each.then_fitted))


def left_out_texts(found: Sequence[LeftOutSet]) -> list[str]:
    """What the table says, in sentences."""
    sizes = _own_sizes(found)
    words = ["Each data set was predicted by a fit of the others; the errors are root mean squares."]
    if sizes:
        words.append(f"Its own sizes were taken as stated (predicted), then fitted to it: {marked(sizes)}.")
    first = tuple(dict.fromkeys(full_names.common(name) for each in found for name in each.fitted_first))
    if first:
        words.append(f"Nothing but its own data tells of {marked(first)}: fitted to it before anything is predicted.")
    words.append("Beyond instruments: what instruments within their accuracy cannot have made of the error before it.")
    return words


def left_out_result(found: Sequence[LeftOutSet]) -> dict[str, Any]:
    """The same for machines, in SI."""
    return {
        "left_out": [
            {
                "dataset": each.dataset, "unit": each.unit, "full_scale": each.full_scale,
                "rmse_predicted": each.predicted, "rmse_own_fitted": each.then, "rmse_beyond_instruments": each.beyond,
                "rmse_of_all": each.together,
                "fitted_first": list(each.fitted_first), "then_fitted": list(each.then_fitted),
            }
            for each in found
        ]
    }  # fmt: skip
