"""Measured and model, run by run, as HTML: the axes are drawn once, and any number of models is laid over them.

Below each loop a strip shows the misfit on a scale of its own: next to hundreds of newtons a few are not to be seen.
That makes a picture that follows a slider within milliseconds, and a page on which one model after the other shows.
"""

import dataclasses
import html
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from fitting.comparison.compare import branch_name
from fitting.report.pictures import figures
from fitting.report.pictures.panels import Panel
from fitting.report.settings import FIGURE
from fitting.report.text.amounts import amount

if TYPE_CHECKING:
    from matplotlib.axes import Axes

WIDTH, HEIGHT, STRIP = 3.1, 2.75, 0.62  # inches of one panel, and of the strip of misfit that is a part of it
CLASSES = {1: "up", -1: "down", 0: "flat"}


@dataclass(frozen=True)
class Window:
    """Axes on a panel: where a value lies, and the rectangle beyond which lines are cut off."""

    scale: tuple[float, float]
    origin: tuple[float, float]
    place: tuple[float, float, float, float]  # left, top, width, height

    @property
    def opening(self) -> str:
        """An SVG element that shows nothing beyond the axes."""
        names = ("x", "y", "width", "height")
        words = " ".join(f'{name}="{value:.1f}"' for name, value in zip(names, self.place, strict=True))
        return f'<svg {words} viewBox="{" ".join(f"{value:.1f}" for value in self.place)}">'

    def points(self, x: np.ndarray, y: np.ndarray) -> list[tuple[float, float]]:
        """Where these values lie."""
        across = self.origin[0] + self.scale[0] * x
        down = self.origin[1] + self.scale[1] * np.clip(y, -1e9, 1e9)
        return list(zip(across, down, strict=True))


@dataclass(frozen=True)
class Frame:
    """One panel's axes and readings as SVG, and where on it values lie: on the axes, and on the strip of misfit."""

    panel: Panel
    opening: str
    window: Window
    strip: Window

    def path(self, values: np.ndarray, part: np.ndarray) -> str:
        """Points of the panel as path coordinates: a line, or crosses where there are few."""
        at = self.window.points(self.panel.along[part], values[part])
        if self.panel.is_few:
            return "".join(f"M{a - 3:.1f} {b:.1f}h6m-3 -3v6" for a, b in at)
        if not at:
            return ""
        gaps = np.cumsum(np.isnan(values))[part]  # a line stops where there is no model, and goes on behind
        pens = ["M", *("L" if here == before else "M" for before, here in pairwise(gaps))]
        return "".join(f"{pen}{a:.1f} {b:.1f}" for pen, (a, b) in zip(pens, at, strict=True))

    def dots(self, part: np.ndarray) -> str:
        """The readings as dots."""
        return _dots(self.window.points(self.panel.along[part], self.panel.measured[part]))

    def model(self, residual: np.ndarray) -> str:
        """The lines of one model, and below them what it misses."""
        values = self.panel.model(residual)
        lines = "".join(self._branch(branch, values) for branch in CLASSES)
        return f"{self.window.opening}{lines}</svg>{self.misfit(values - self.panel.measured)}"

    def _branch(self, branch: int, values: np.ndarray) -> str:
        mine = np.where(self.panel.run.branch == branch, values, np.nan)
        path = "".join(self.path(mine, part) for part in self.panel.shown(mine))
        few = " few" if self.panel.is_few else ""
        return f'<path class="m {CLASSES[branch]}{few}" d="{path}"/>' if path else ""

    def misfit(self, values: np.ndarray) -> str:
        """Model minus measurement on a scale of its own, which is written beside it, over the band of noise."""
        reach = FIGURE.room * max(float(np.nanmax(np.abs(values))), self.panel.noise / self.panel.size, 1e-12)
        left, top, width, height = self.strip.place
        band = min(FIGURE.sigmas * self.panel.noise / self.panel.size / reach, 1.0)
        tall = max(height * band, 0.5)
        corner = f"M{left:.1f} {top + (height - tall) / 2:.1f}"
        noise = f'<path class="noise" d="{corner}h{width:.1f}v{tall:.1f}h-{width:.1f}z"/>'
        shown = amount(reach / FIGURE.room * self.panel.size, self.panel.unit, 2)
        place = f'x="{left + width:.1f}" y="{top - 2:.1f}"'
        scale = f'<text class="reach" {place}>misfit, &#177; {html.escape(shown)}</text>'
        dots = "".join(self._missed(branch, values / reach) for branch in CLASSES)
        return f"{self.strip.opening}{noise}{dots}</svg>{scale}"

    def _missed(self, branch: int, values: np.ndarray) -> str:
        mine = np.where(self.panel.run.branch == branch, values, np.nan)
        parts = [part for part in self.panel.shown(mine) if len(part)]
        if not parts:
            return ""
        kept = np.concatenate(parts)
        few = " few" if self.panel.is_few else ""
        path = _dots(self.strip.points(self.panel.along[kept], mine[kept]))
        return f'<path class="r {CLASSES[branch]}{few}" d="{path}"/>'

    def figure(self, models: Sequence[np.ndarray], caption: str) -> str:
        """The panel with these models over it, each in a group of its own."""
        groups = "".join(f'<g class="model m{k}">{self.model(residual)}</g>' for k, residual in enumerate(models))
        words = html.escape(f"{self.panel.label}, {self.panel.ylabel} against {self.panel.xlabel}, and the misfit")
        svg = self.opening.replace("<svg", f'<svg role="img" aria-label="{words}"', 1)
        return f"<figure><figcaption>{caption}</figcaption>{svg}{groups}</svg></figure>"


def _dots(at: Sequence[tuple[float, float]]) -> str:
    return "".join(f"M{a:.1f} {b:.1f}h0" for a, b in at)


def frame(panel: Panel, number: int, models: Sequence[np.ndarray]) -> Frame:
    """Draw the axes of a panel so that its readings and these models fit."""
    values = [panel.measured, *(panel.model(residual) for residual in models)]
    figure, axes, below = figures.panel_and_strip(WIDTH, HEIGHT, STRIP, panel.xlabel, panel.ylabel)
    for one in (axes, below):
        one.set_xlim(*_span(panel.along))
    axes.set_ylim(*_span(np.concatenate(values)))
    svg = figures.as_svg(figure, f"p{number}")
    opening = svg[: svg.rindex("</svg>")]
    placed = Frame(panel, opening, _window(axes, figure.dpi), _window(below, figure.dpi))
    few = " few" if panel.is_few else ""
    dots = placed.dots(np.concatenate(panel.shown(panel.measured)))
    return dataclasses.replace(placed, opening=f'{opening}<path class="d{few}" d="{dots}"/>')


def _window(axes: "Axes", dpi: float) -> Window:
    (x0, y0), (x1, y1) = axes.transData.transform([(0, 0), (1, 1)]) * 72 / dpi
    box, width, height = axes.get_position(), WIDTH * 72, HEIGHT * 72
    place = (box.x0 * width, (1 - box.y1) * height, box.width * width, box.height * height)
    return Window((x1 - x0, y0 - y1), (x0, height - y0), place)


def _span(values: np.ndarray) -> tuple[float, float]:
    lower, upper = float(np.nanmin(values)), float(np.nanmax(values))
    margin = FIGURE.margin * (upper - lower) or max(abs(upper), 1.0) * 0.05
    return lower - margin, upper + margin


def loops_html(frames: Sequence[Frame], models: Sequence[np.ndarray]) -> str:
    """All panels; the caption of each tells every model's error there, in a span that shows with it."""
    shown = []
    for one in frames:
        errors = "".join(
            f'<b class="model m{k}">{amount(one.panel.error(r), one.panel.unit, 2)}</b>' for k, r in enumerate(models)
        )
        shown.append(one.figure(models, f"{html.escape(one.panel.label)}: RMS error {errors}"))
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
    words.append('<span><i class="band"></i>expected noise (±2 sigma) of the misfit, model minus measured</span>')
    return f'<div class="key">{"".join(words)}</div>'


def thinning_text(frames: Sequence[Frame], runs: int) -> str:
    """What the picture leaves out, if anything."""
    words = [f"The {len(frames)} runs with the largest errors of {runs} are drawn."] if len(frames) < runs else []
    if any(one.panel.is_thinned for one in frames):
        words.append(
            "Thinned for drawing: every branch keeps its ends and the samples that shape it most; of many loops, some "
            "are drawn. Every number is from all samples."
        )
    return " ".join(words)
