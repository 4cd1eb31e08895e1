"""Pictures of where a model fails: one function each, returning a matplotlib figure. Nothing else draws."""

import io
import re
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from fitting import showing
from fitting.diagnosis.record import Diagnosis
from fitting.report.settings import FIGURE
from fitting.report.text.stages import stage_text
from fitting.study.stages import Stage

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


# Okabe & Ito: told apart by every kind of colour vision
BLUE, ORANGE, GREEN, GREY, VERMILION, SKY = "#0072B2", "#E69F00", "#009E73", "#8C8C8C", "#D55E00", "#56B4E9"
INK = "#13579b"  # stands for the page's own text colour, which is light on dark or dark on light
SETTINGS: dict[Any, Any] = {
    "svg.fonttype": "none", "text.parse_math": False, "font.size": 9, "axes.titlesize": 9, "axes.labelsize": 9,
    "axes.edgecolor": INK, "axes.labelcolor": INK, "axes.titlecolor": INK, "text.color": INK, "xtick.color": INK,
    "ytick.color": INK, "xtick.labelsize": 8, "ytick.labelsize": 8, "axes.linewidth": 0.6, "xtick.major.width": 0.6,
    "ytick.major.width": 0.6, "axes.spines.top": False, "axes.spines.right": False, "figure.facecolor": "none",
    "axes.facecolor": "none", "savefig.facecolor": "none", "legend.frameon": False, "font.family": "sans-serif",
}  # fmt: skip


def waterfall(stages: Sequence[Stage], floor: float, unit: str = "N") -> "Figure":
    """How far the error has fallen, and how far it could."""
    name, size = showing.shown_in(unit, max(stage.rmse for stage in stages))
    figure, axes = _figure(6.8, 0.75 + 0.36 * len(stages))
    with settings():
        for row, stage in enumerate(stages):
            good = stage.rmse <= 1.5 * floor
            axes.barh(row, stage.rmse / size, height=0.62, color=GREEN if good else BLUE)
            if stage.held_out_rmse is not None and np.isfinite(stage.held_out_rmse):
                left = stage.held_out_rmse / size
                axes.plot([left, left], [row - 0.31, row + 0.31], color=VERMILION, linewidth=2)
            end = max(stage.rmse, stage.held_out_rmse or 0.0) / size
            marked = "" if stage.held_out_rmse is None else f" (held out {stage.held_out_rmse / size:.3g})"
            _beside(axes, end, row, f"{stage.rmse / size:.3g} {name}{marked}")
        axes.axvline(floor / size, color=INK, linestyle=(0, (3, 2)), linewidth=1)
        _beside(axes, floor / size, -0.75, f"noise {showing.figures(floor / size)} {name}")
        axes.set_yticks(range(len(stages)), [stage_text(stage) for stage in stages])
        axes.set_ylim(len(stages) - 0.5, -0.95)
        axes.set_xlim(0, 1.4 * max(max(s.rmse, s.held_out_rmse or 0.0, floor) for s in stages) / size)
        marked = any(stage.held_out_rmse is not None for stage in stages)
        axes.set_xlabel(f"RMS error [{name}]" + ("; mark: on held-out runs" if marked else ""))
        axes.tick_params(axis="y", length=0)
    return figure


def effects_picture(d: Diagnosis, floor: float, unit: str = "N") -> "Figure":
    """What the error would be with each effect added: the fewer newtons the better."""
    tested = [e for e in d.effects.values() if e.detection_limit is not None and np.isfinite(e.held_out_rmse or np.nan)]
    tested = sorted(tested, key=lambda e: e.held_out_rmse or 0.0)[: FIGURE.effects]
    name, size = showing.shown_in(unit, d.rmse)
    figure, axes = _figure(6.8, 0.9 + 0.23 * len(tested))
    with settings():
        for row, e in enumerate(tested):
            left = (e.held_out_rmse or 0.0) / size
            axes.barh(row, left, height=0.66, color=GREEN if e.adequate else SKY)
            if left < 0.97 * d.held_out_rmse / size:
                _beside(axes, left, row, f"{left:.3g}")
        for value, words in ((d.held_out_rmse, "model as it is"), (floor, "noise")):
            axes.axvline(value / size, color=INK, linestyle=(0, (3, 2)), linewidth=1)
            axes.text(value / size, -0.75, words, va="bottom", ha="center", fontsize=8)
        axes.set_yticks(range(len(tested)), [e.name for e in tested])
        axes.set_ylim(len(tested) - 0.5, -0.9)
        axes.set_xlim(0, 1.15 * max([d.held_out_rmse, *(e.held_out_rmse or 0.0 for e in tested)]) / size)
        axes.set_xlabel(f"error on held-out runs, with this effect added [{name}]; green: explains the data")
        axes.tick_params(axis="y", length=0)
    return figure


def as_svg(figure: "Figure", prefix: str) -> str:
    """The figure as an SVG element to stand in a page, in the page's own text colour and font."""
    from matplotlib import rc_context

    out = io.StringIO()
    with rc_context({**SETTINGS, "svg.hashsalt": prefix}):
        figure.savefig(out, format="svg", metadata={"Date": None, "Creator": None})
    text = out.getvalue()
    text = text[text.index("<svg") :].replace(INK, "currentColor")
    text = re.sub(r'(<svg[^>]*?) height="[^"]*"', r"\1", text)
    text = re.sub(r'(<svg[^>]*?) width="[^"]*"', r'\1 width="100%"', text)
    text = re.sub(r"<metadata>.*?</metadata>", "", text, flags=re.DOTALL)
    text = re.sub(r"font-family: [^;\"]*", "font-family: system-ui, sans-serif", text)
    return re.sub(r'(\bid="|url\(#|href="#)', rf"\g<1>{prefix}-", text)


def _beside(axes: "Axes", x: float, y: float, words: str) -> None:
    """Words a little to the right of a place."""
    axes.annotate(words, (x, y), (4, 0), textcoords="offset points", va="center", fontsize=8.5)


# -------------------------------------------------------------------------------------------------------------- canvas


def settings() -> Any:
    from matplotlib import rc_context

    return rc_context(SETTINGS)


def blank(width: float, height: float) -> "Figure":
    """A figure that no window belongs to."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    with settings():
        figure = Figure(figsize=(width, height))
    FigureCanvasAgg(figure)
    return figure


def panel_axes(width: float, height: float, xlabel: str, ylabel: str) -> tuple["Figure", "Axes"]:
    """Empty axes of one small panel, with margins that do not depend on what is drawn."""
    figure = blank(width, height)
    with settings():
        axes = figure.add_axes((0.58 / width, 0.44 / height, 1 - 0.66 / width, 1 - 0.52 / height))
        _name_axes(axes, xlabel, ylabel)
    return figure, axes


def panel_and_strip(
    width: float, height: float, strip: float, xlabel: str, ylabel: str
) -> tuple["Figure", "Axes", "Axes"]:
    """Empty axes of one small panel, and of a strip below it along the same axis, -1 to 1, without numbers."""
    figure = blank(width, height)
    left, across, low, gap = 0.58 / width, 1 - 0.66 / width, 0.44 / height, 0.2 / height
    with settings():
        below = figure.add_axes((left, low, across, strip / height))
        bottom = low + strip / height + gap
        axes = figure.add_axes((left, bottom, across, 1 - bottom - 0.08 / height))
        _name_axes(axes, "", ylabel)
        _name_axes(below, xlabel, "")
        axes.tick_params(labelbottom=False)
        below.set_ylim(-1, 1)
        below.set_yticks([])
        below.axhline(0, color=INK, linewidth=0.5)
        axes.yaxis.set_label_coords(-0.42 / (width * across), 0.5)
    return figure, axes, below


def _name_axes(axes: "Axes", xlabel: str, ylabel: str) -> None:
    axes.set_xlabel(xlabel, labelpad=2)
    axes.set_ylabel(ylabel, labelpad=2)
    axes.locator_params(nbins=4)


def _figure(width: float, height: float) -> tuple["Figure", "Axes"]:
    figure = blank(width, height)
    with settings():
        axes = figure.add_subplot()
        figure.set_layout_engine("tight", pad=0.4)
    return figure, axes
