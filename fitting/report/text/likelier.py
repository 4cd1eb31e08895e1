"""The values that are likelier than those of the curve of least error, where instruments may err."""

from collections.abc import Iterator
from typing import Any

from rich.console import RenderableType
from rich.text import Text

from fitting.least_squares.record import Fit
from fitting.report.settings import LIKELIER
from fitting.report.text.amounts import amount
from fitting.report.text.layout import columns, line, spaced
from fitting.report.text.names import mark
from fitting.report.text.values import value_cells

HEADS = ("parameter", "likelier value", "+/- robust")
OPTION = "--through-instruments"


def likelier_text(fit: Fit) -> str:
    """What the likelier values are; empty where there are none, or where they are known hardly better."""
    if not _known_better(fit):
        return ""
    assert fit.through is not None  # else nothing is known better
    unit = "N" if any(block.of_force for block in fit.problem.blocks) else "m"
    return (
        f"The curve of least error ({amount(fit.rmse, unit)}) follows the errors of the instruments, too, and leaves "
        "hardly more than these and noise. If the instruments may err as far as their accuracy goes, and nothing is "
        "missing, the likelier values are those of the second table; with them the model errs by "
        f"{amount(fit.through.rmse, unit)}. Take them for the constants of the muscle, and the curve of least error to "
        "predict what this rig reads."
    )


def likelier_rows(fit: Fit) -> Iterator[tuple[str, str, str]]:
    """The name, the likelier value and its error of every parameter that was fitted."""
    if fit.through is not None:
        for name in fit.free:
            shown, robust, _ = value_cells(fit.through, name)
            yield mark(name), shown, robust


def likelier_report(fit: Fit) -> list[RenderableType]:
    """Both for the terminal, with the option that saves these values; nothing where there are none."""
    text = likelier_text(fit)
    if not text:
        return []
    table = columns(*HEADS)
    for row in likelier_rows(fit):
        table.add_row(*row)
    return [line("LIKELIER", f"{text} {OPTION} saves them."), spaced(table), Text()]


def likelier_result(fit: Fit, name: str) -> dict[str, Any] | None:
    """A parameter's likelier value and its error for machines; None where there is none."""
    if fit.through is None or name not in fit.free:
        return None
    return {"value": fit.through.values[name], "robust_error": fit.through.error(name)}


def _known_better(fit: Fit) -> bool:
    """Whether any parameter has a much smaller standard error where instruments may err."""
    through = fit.through
    return through is not None and any(through.error(n) < LIKELIER.sharper * fit.error(n) for n in fit.free)
