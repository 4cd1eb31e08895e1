"""How the error fell, as HTML: one bar per step, down to the noise; on a page each can be chosen without a script."""

import html
from collections.abc import Sequence

import numpy as np

from fitting import units
from fitting.report.settings import ERROR_TEXT
from fitting.report.text.amounts import amount
from fitting.report.text.stages import stage_text
from fitting.study.stages import Stage


def fall_html(stages: Sequence[Stage], floor: float, unit: str, choose: str = "") -> str:
    """The bars; with `choose`, the name of a group of radio buttons, each row is the label of one."""
    top = 1.45 * max(max(stage.rmse, _left(stage), floor) for stage in stages) or 1.0
    rows = "".join(_row(stage, k, len(stages), floor, top, unit, choose) for k, stage in enumerate(stages))
    name, size = units.shown_in(unit, floor)
    words = f"RMS error; dashed: the noise, {floor / size:.2g} {name}"
    words += "; orange mark: on held-out runs" if any(stage.held_out_rmse is not None for stage in stages) else ""
    return f'<fieldset class="fall"><legend>{words}</legend>{rows}</fieldset>'


def _left(stage: Stage) -> float:
    return stage.held_out_rmse if stage.held_out_rmse is not None and np.isfinite(stage.held_out_rmse) else 0.0


def _row(stage: Stage, k: int, count: int, floor: float, top: float, unit: str, choose: str) -> str:
    width, left = (100 * value / top for value in (stage.rmse, _left(stage)))
    near = " near" if stage.rmse <= ERROR_TEXT.near_floor * floor else ""
    mark = f'<span class="left" style="left:{left:.2f}%"></span>' if left else ""
    value = amount(stage.rmse, unit) + (f" (held out {amount(stage.held_out_rmse, unit)})" if left else "")
    bars = (
        f'<span class="track"><span class="bar{near}" style="width:{width:.2f}%"></span>{mark}'
        f'<span class="floor" style="left:{100 * floor / top:.2f}%"></span>'
        f'<span class="value" style="left:{max(width, left):.2f}%">{value}</span></span>'
    )
    name = html.escape(stage_text(stage))
    if not choose:
        return f'<div class="row"><span class="name">{name}</span>{bars}</div>'
    chosen = " checked" if k == count - 1 else ""
    button = f'<input type="radio" name="{choose}" id="{choose}{k}"{chosen}>'
    return f'<label class="row" for="{choose}{k}"><span class="name">{button} {name}</span>{bars}</label>'
