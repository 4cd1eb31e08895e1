"""The misfit of all runs in one picture: model minus measured along the stroke, a line a run, over the band of noise.

Every model is drawn on the same axes, which the first one fills: with each effect added the lines fall into the band.
"""

import html
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fitting.report.pictures import figures
from fitting.report.pictures.loops import Window
from fitting.report.pictures.panels import Panel
from fitting.report.settings import FIGURE

SHAPES = {"broad": (9.4, 3.3), "narrow": (4.7, 3.6)}  # inches; narrow: for a telephone, with letters as large
LEFT, RIGHT, LOW, HIGH = 0.62, 0.1, 0.46, 0.12  # inches beside the axes
DASHES = {1: "", -1: ' stroke-dasharray="5 2.5"', 0: ""}  # elongating is dashed
COLOURS = ("#440154", "#3b528b", "#21918c", "#3fae5a", "#b8a800")  # viridis, darker at its end: seen on white and black
LIGHTER = ("#b07cc6", "#7f9be0", "#35b7ae", "#5ec962", "#fde725")  # the same ranks on a dark page


@dataclass(frozen=True)
class Course:
    """The mean misfit of one branch of one run: where along, and how much, in units of the axes."""

    held: int  # rank of what its run holds
    branch: int
    along: np.ndarray
    missed: np.ndarray
    is_few: bool


def overview_html(shown: Sequence[Panel], models: Sequence[np.ndarray]) -> str:
    """The picture with its key, each model in a group of its own; empty where no two runs share an axis."""
    alike = _on_one_axis(shown)
    if len(alike) < 2:
        return ""
    held = held_ranks(alike)
    courses = [[c for panel in alike for c in _courses(panel, residual, held)] for residual in models]
    band = FIGURE.sigmas * float(np.median([panel.noise / panel.size for panel in alike]))
    drawn = "".join(_drawn(shape, alike[0], courses, band) for shape in SHAPES)  # the page shows the one that fits
    return f'<figure class="overview">{_key(held, courses)}{drawn}</figure>'


def _drawn(shape: str, panel: Panel, courses: Sequence[Sequence[Course]], band: float) -> str:
    """The picture in one of its shapes."""
    opening, window = _axes(shape, panel, courses, band)
    groups = "".join(f'<g class="model m{k}">{_lines(each, window)}</g>' for k, each in enumerate(courses))
    words = f"{panel.ylabel}, model minus measured, run by run, against {panel.xlabel}"
    svg = opening.replace("<svg", f'<svg class="{shape}" role="img" aria-label="{html.escape(words)}"', 1)
    return f"{svg}{window.opening}{groups}</svg></svg>"


def _on_one_axis(shown: Sequence[Panel]) -> list[Panel]:
    """The runs that are drawn along what most runs are drawn along."""
    if not shown:
        return []
    (xlabel, ylabel), _ = Counter((panel.xlabel, panel.ylabel) for panel in shown).most_common(1)[0]
    return [panel for panel in shown if (panel.xlabel, panel.ylabel) == (xlabel, ylabel)]


def held_ranks(shown: Sequence[Panel]) -> dict[str, int]:
    """What runs hold, as words, with its rank among the colours: the least first."""
    level = {panel.held: panel.level for panel in shown}
    order = sorted(level, key=level.__getitem__)
    last = max(len(order) - 1, 1)
    return {words: round(rank * (len(COLOURS) - 1) / last) for rank, words in enumerate(order)}


def _courses(panel: Panel, residual: np.ndarray, held: dict[str, int]) -> list[Course]:
    missed = np.full(len(panel.run), np.nan)
    missed[panel.position] = residual[panel.mine] / panel.size
    found = []
    for branch in DASHES:
        mine = np.isfinite(missed) & (panel.run.branch == branch)
        if np.any(mine):
            along, values = panel.along[mine], missed[mine]
            middle, mean = (along, values) if panel.is_few else _means(along, values)
            order = np.argsort(middle)
            found.append(Course(held[panel.held], branch, middle[order], mean[order], panel.is_few))
    return found


def _means(along: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Means over equal parts of the stroke: noise is averaged, and the shape stays."""
    ends = np.linspace(np.min(along), np.max(along), FIGURE.parts + 1)
    part = np.clip(np.searchsorted(ends, along, side="right") - 1, 0, FIGURE.parts - 1)
    count = np.bincount(part, minlength=FIGURE.parts)
    some = count > 0
    total = [np.bincount(part, each, FIGURE.parts)[some] for each in (along, values)]
    return total[0] / count[some], total[1] / count[some]


def _axes(shape: str, panel: Panel, courses: Sequence[Sequence[Course]], band: float) -> tuple[str, Window]:
    """Axes that all models fit on, with the band of noise, as SVG without its end; and where values lie on them."""
    each = [course for model in courses for course in model]
    reach = FIGURE.room * max(band, *(float(np.max(np.abs(course.missed))) for course in each))
    low, high = min(np.min(c.along) for c in each), max(np.max(c.along) for c in each)
    margin = FIGURE.margin * (high - low) or 1.0
    wide, tall = SHAPES[shape]
    figure = figures.blank(wide, tall)
    across, up = 1 - (LEFT + RIGHT) / wide, 1 - (LOW + HIGH) / tall
    with figures.settings():
        axes = figure.add_axes((LEFT / wide, LOW / tall, across, up))
        axes.set_xlim(low - margin, high + margin)
        axes.set_ylim(-reach, reach)
        axes.set_xlabel(panel.xlabel, labelpad=2)
        unit = panel.ylabel[panel.ylabel.index("[") :]
        axes.set_ylabel(f"model minus measured {unit}", labelpad=2)
        axes.axhspan(-band, band, color=figures.GREY, alpha=0.3, linewidth=0)
        axes.axhline(0, color=figures.INK, linewidth=0.5)
    svg = figures.as_svg(figure, f"overview-{shape}")
    (x0, y0), (x1, y1) = axes.transData.transform([(0, 0), (1, 1)]) * 72 / figure.dpi
    box, width, height = axes.get_position(), wide * 72, tall * 72
    place = (box.x0 * width, (1 - box.y1) * height, box.width * width, box.height * height)
    return svg[: svg.rindex("</svg>")], Window((x1 - x0, y0 - y1), (x0, height - y0), place)


def _lines(courses: Sequence[Course], window: Window) -> str:
    return "".join(_line(course, window) for course in courses)


def _line(course: Course, window: Window) -> str:
    at = window.points(course.along, course.missed)
    path = "L".join(f"{a:.1f} {b:.1f}" for a, b in at)
    dots = "".join(f"M{a:.1f} {b:.1f}h0" for a, b in at) if course.is_few else ""
    dotted = f'<path class="few h{course.held}" d="{dots}"/>' if dots else ""
    return f'<path class="h{course.held}"{DASHES[course.branch]} d="M{path}"/>{dotted}'


def _key(held: dict[str, int], courses: Sequence[Sequence[Course]]) -> str:
    """What colours, dashes and the band mean; of many colours the first and the last."""
    words = list(held)
    told = words if len(words) <= len(COLOURS) else [words[0], words[len(words) // 2], words[-1]]
    spans = [f'<span><i class="h{held[name]}"></i>{html.escape(name)}</span>' for name in told]
    if {course.branch for model in courses for course in model} >= {1, -1}:
        spans.append('<span><i class="dashed"></i>dashed: elongating</span>')
    spans.append('<span><i class="band"></i>expected noise of one reading (±2 sigma)</span>')
    return f'<figcaption class="key">{"".join(spans)}</figcaption>'


def overview_style() -> str:
    """The colours of what runs hold, on light and on dark pages."""
    rules = "".join(_rule(rank, colour) for rank, colour in enumerate(COLOURS))
    dark = "".join(_rule(rank, colour) for rank, colour in enumerate(LIGHTER))
    return f"{rules}@media (prefers-color-scheme: dark) {{ {dark} }}\n"


def _rule(rank: int, colour: str) -> str:
    return f".overview path.h{rank} {{ stroke: {colour}; }} .key i.h{rank} {{ border-color: {colour}; }}\n"
