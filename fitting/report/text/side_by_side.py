"""Several models side by side: their errors, and each parameter with its error."""

from collections.abc import Sequence

from fitting import showing
from fitting.least_squares.record import Fit
from fitting.report.results import shown_names
from fitting.report.text.amounts import amount
from fitting.report.text.bounds import allowed_note
from fitting.report.text.names import mark
from fitting.report.text.stages import tested_text
from fitting.report.text.stated_sizes import measured_cells
from fitting.study.stages import Stage

MEASURED = "measured"


def side_by_side(called: Sequence[str], stages: Sequence[Stage]) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Heads and rows of a table with one column a model; `called` are the names of the models.

    Every stage needs its comparison. A cell is empty where a model has no such parameter.
    """
    compared = [stage.comparison for stage in stages if stage.comparison is not None]
    fits = [c.fit for c in compared]
    errors = [
        ("error, root mean square", "", *(amount(c.rmse, c.unit) for c in compared)),
        ("on held-out runs", "", *(amount(s.held_out_rmse, c.unit) for s, c in zip(stages, compared, strict=True))),
        ("p in the test that nothing is missing", "", *(tested_text(stage.p_value) for stage in stages)),
    ]
    names = dict.fromkeys(name for fit in fits for name in shown_names(fit))
    rows = [(mark(name), _measured(fits, name), *(_value(fit, name) for fit in fits)) for name in names]
    return ("", MEASURED, *called), errors + rows


def _value(fit: Fit, name: str) -> str:
    if name not in fit.values:
        return ""
    unit, note = fit.layout.entry(name).unit, allowed_note(fit, name)
    return (
        f"{amount(fit.values[name], unit)}, {note}" if note else showing.show(fit.values[name], unit, fit.error(name))
    )


def _measured(fits: Sequence[Fit], name: str) -> str:
    """What was measured of a size of the muscle; it is the same for every model."""
    return next((measured_cells(fit, name)[0] for fit in fits if name in fit.values), "")
