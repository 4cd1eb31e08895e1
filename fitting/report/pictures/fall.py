"""How the error fell, as HTML: one bar per step, down to the noise; on a page each can be chosen without a script."""

from collections.abc import Callable, Sequence

import numpy as np

from fitting import showing
from fitting.report.settings import ERROR_TEXT
from fitting.report.text.amounts import amount
from fitting.report.text.stages import stage_text
from fitting.study.stages import Stage

ROOM = 1.75  # times the longest bar, that a track is long: its value, with that on held-out runs, stands behind it


def fall_html(stages: Sequence[Stage], floor: float, unit: str, named: Callable[[str], str], choose: str = "") -> str:
    """The bars; with `choose`, each row is the label of the radio button of that name and the number of the step.

    `named` makes HTML of the names of effects.
    """
    top = ROOM * max(max(stage.rmse, _left(stage), floor) for stage in stages) or 1.0
    rows = "".join(_row(named(stage_text(s)), s, floor, top, unit, f"{choose}{k}" * bool(choose))
                   for k, s in enumerate(stages))  # fmt: skip
    name, size = showing.shown_in(unit, floor)
    words = f"RMS error; dashed: the noise, {showing.figures(floor / size)} {name}"
    words += "; orange mark: on held-out runs" if any(stage.held_out_rmse is not None for stage in stages) else ""
    return f'<fieldset class="fall"><legend>{words}</legend>{rows}</fieldset>'


def _left(stage: Stage) -> float:
    return stage.held_out_rmse if stage.held_out_rmse is not None and np.isfinite(stage.held_out_rmse) else 0.0


def _row(name: str, stage: Stage, floor: float, top: float, unit: str, button: str) -> str:
    """One step: its name as HTML, its bar, and the noise; the label of a `button` if there is one."""
    width, left = (100 * value / top for value in (stage.rmse, _left(stage)))
    near = " near" if stage.rmse <= ERROR_TEXT.near_floor * floor else ""
    mark = f'<span class="left" style="left:{left:.2f}%"></span>' if left else ""
    value = amount(stage.rmse, unit) + (f" (held out {amount(stage.held_out_rmse, unit)})" if left else "")
    bars = (
        f'<span class="track"><span class="bar{near}" style="width:{width:.2f}%"></span>{mark}'
        f'<span class="floor" style="left:{100 * floor / top:.2f}%"></span>'
        f'<span class="value" style="left:{max(width, left):.2f}%">{value}</span></span>'
    )
    row = f'<span class="name">{name}</span>{bars}'
    return f'<label class="row {button}" for="{button}">{row}</label>' if button else f'<div class="row">{row}</div>'
