"""Measured and model, run by run, as HTML: the axes are drawn once, and any number of models is laid over them.

That makes a picture that follows a slider within milliseconds, and a page on which one model after the other shows.
"""

import dataclasses
import html
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fitting import figures
from fitting.compare import branch_name
from fitting.showing.panels import Panel
from fitting.showing.sentences import rounded

WIDTH, HEIGHT = 2.45, 1.95  # inches of one panel
MARGIN = 0.04  # of the span, around the readings
CLASSES = {1: "up", -1: "down", 0: "flat"}


@dataclass(frozen=True)
class Frame:
    """One panel's axes and readings as SVG, and where on it a value lies."""

    panel: Panel
    opening: str
    scale: tuple[float, float]
    origin: tuple[float, float]
    window: str  # of the axes: what lies outside is cut off

    def path(self, values: np.ndarray, part: np.ndarray) -> str:
        """Points of the panel as path coordinates."""
        x = self.origin[0] + self.scale[0] * self.panel.along[part]
        y = self.origin[1] + self.scale[1] * np.clip(values[part], -1e9, 1e9)
        if self.panel.is_few:
            return "".join(f"M{a - 3:.1f} {b:.1f}h6m-3 -3v6" for a, b in zip(x, y, strict=True))
        return "M" + "L".join(f"{a:.1f} {b:.1f}" for a, b in zip(x, y, strict=True)) if len(x) else ""

    def dots(self, part: np.ndarray) -> str:
        """The readings as dots."""
        x = self.origin[0] + self.scale[0] * self.panel.along[part]
        y = self.origin[1] + self.scale[1] * self.panel.measured[part]
        return "".join(f"M{a:.1f} {b:.1f}h0" for a, b in zip(x, y, strict=True))

    def model(self, residual: np.ndarray) -> str:
        """The lines of one model."""
        values = self.panel.model(residual)
        return "".join(self._branch(branch, values) for branch in (1, -1, 0))

    def _branch(self, branch: int, values: np.ndarray) -> str:
        mine = np.where(self.panel.run.branch == branch, values, np.nan)
        path = "".join(self.path(mine, part) for part in self.panel.shown(mine))
        few = " few" if self.panel.is_few else ""
        return f'<path class="m {CLASSES[branch]}{few}" d="{path}"/>' if path else ""

    def figure(self, models: Sequence[np.ndarray], caption: str) -> str:
        """The panel with these models over it, each in a group of its own."""
        groups = "".join(f'<g class="model m{k}">{self.model(residual)}</g>' for k, residual in enumerate(models))
        words = html.escape(f"{self.panel.label}, {self.panel.ylabel} against {self.panel.xlabel}")
        svg = self.opening.replace("<svg", f'<svg role="img" aria-label="{words}"', 1)
        return f"<figure><figcaption>{caption}</figcaption>{svg}<svg {self.window}>{groups}</svg></svg></figure>"


def frame(panel: Panel, number: int, models: Sequence[np.ndarray]) -> Frame:
    """Draw the axes of a panel so that its readings and these models fit."""
    values = [panel.measured, *(panel.model(residual) for residual in models)]
    figure, axes = figures.panel_axes(WIDTH, HEIGHT, panel.xlabel, panel.ylabel)
    axes.set_xlim(*_span(panel.along))
    axes.set_ylim(*_span(np.concatenate(values)))
    svg = figures.as_svg(figure, f"p{number}")
    per_dot = 72 / figure.dpi
    (x0, y0), (x1, y1) = axes.transData.transform([(0, 0), (1, 1)]) * per_dot
    height = HEIGHT * 72
    box = axes.get_position()
    left, top = box.x0 * WIDTH * 72, (1 - box.y1) * height
    place = f"{left:.1f} {top:.1f} {box.width * WIDTH * 72:.1f} {box.height * height:.1f}"
    names = ("x", "y", "width", "height")
    window = " ".join(f'{name}="{value}"' for name, value in zip(names, place.split(), strict=True))
    window += f' viewBox="{place}"'
    opening = svg[: svg.rindex("</svg>")]
    placed = Frame(panel, opening, (x1 - x0, y0 - y1), (x0, height - y0), window)
    few = " few" if panel.is_few else ""
    dots = placed.dots(np.concatenate(panel.shown(panel.measured)))
    return dataclasses.replace(placed, opening=f'{opening}<path class="d{few}" d="{dots}"/>')


def _span(values: np.ndarray) -> tuple[float, float]:
    lower, upper = float(np.nanmin(values)), float(np.nanmax(values))
    margin = MARGIN * (upper - lower) or max(abs(upper), 1.0) * 0.05
    return lower - margin, upper + margin


def loops_html(frames: Sequence[Frame], models: Sequence[np.ndarray]) -> str:
    """All panels; the caption of each tells every model's error there, in a span that shows with it."""
    shown = []
    for one in frames:
        errors = "".join(
            f'<span class="model m{k}">{rounded(one.panel.error(r), one.panel.unit, 2)}</span>'
            for k, r in enumerate(models)
        )
        shown.append(one.figure(models, f"{html.escape(one.panel.label)}: {errors}"))
    return f'<div class="loops">{"".join(shown)}</div>'


def key(frames: Sequence[Frame]) -> str:
    """What dots and colours mean."""
    test = frames[0].panel.test if frames else "loop"
    seen = {int(b) for one in frames for b in np.unique(one.panel.run.branch[one.panel.run.weight > 0])}
    branches = [b for b in CLASSES if b in seen]
    words = ['<span><i class="dot"></i>measured</span>']
    for branch in branches:
        name = f"model, {branch_name(branch, test)}" if len(branches) > 1 else "model"
        words.append(f'<span><i class="{CLASSES[branch]}"></i>{name}</span>')
    return f'<div class="key">{"".join(words)}<span>number: rms error of the run</span></div>'


def thinned_in_words(frames: Sequence[Frame], runs: int) -> str:
    """What the picture leaves out, if anything."""
    words = [f"The {len(frames)} runs with the largest errors of {runs} are drawn."] if len(frames) < runs else []
    if any(one.panel.is_thinned for one in frames):
        words.append(
            "Thinned for drawing: every branch keeps its ends and the samples that shape it most; of many loops, some "
            "are drawn. Every number is from all samples."
        )
    return " ".join(words)
