"""Pictures of designs: the muscle to scale, at rest and contracted, and trade-offs."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fitting import showing
from fitting.designs.answer import Answer
from fitting.errors import InputError
from fitting.report.pictures.figures import BLUE, INK, ORANGE
from fitting.report.settings import DESIGN_PICTURE
from fitting.report.text.design import quantity_text
from fitting.writing import write_whole
from mckibben_jax.design.best import Design, Task
from mckibben_jax.design.merit import QUANTITIES, built
from mckibben_jax.design.pareto import Second
from mckibben_jax.laws import braid
from mckibben_jax.muscle import Muscle

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

PICTURES = (".svg", ".pdf", ".png")
SETTINGS: dict[Any, Any] = {
    "svg.fonttype": "none",
    "font.size": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
}


def stroke_of(task: Task, found: Design) -> tuple[float, float]:
    """Pressure (Pa) at which a design is shown contracted, the largest that the task names, and the stroke there."""
    pressures = [at["pressure"] for at in (task.at, *(c.at for c in task.constraints)) if "pressure" in at]
    pressure = max(pressures, default=DESIGN_PICTURE.pressure)
    return pressure, float(QUANTITIES["stroke"].law(built(found.muscle, task.effects), {"pressure": pressure}))


def to_scale(muscle: Muscle, contraction: float, pressure: float) -> "Figure":
    """The muscle from the side at rest and at the end of its stroke, both to one scale, the braid with its angles."""
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    length, shorter = float(muscle.length), float(muscle.length) * (1 - contraction)
    at_end = f"contracted {100 * contraction:.1f} % at {showing.show(pressure, 'Pa')}"
    views = ((0.0, length, "at rest"), (contraction, shorter, at_end))
    halves = [1.2 * _outer(muscle, eps) + 0.06 * length for eps, _, _ in views]  # with room for the words above
    whole = sum(halves)
    with rc_context(SETTINGS):
        width, bottom = 7.0, 1.0
        figure = Figure(figsize=(width, width * 2 * whole / (1.36 * length)))
        for (eps, long, title), half in zip(views, halves, strict=True):
            bottom -= half / whole
            axes = figure.add_axes((0.0, bottom, 1.0, half / whole))
            _side_view(axes, muscle, eps)
            angle = np.degrees(float(braid.angle(eps, muscle.braid_angle)))
            size = f"{showing.show(long, 'm')} long, {showing.show(2 * _outer(muscle, eps), 'm')} thick"
            axes.text(0, half - 0.015 * length, f"{title}: {size}, braid {angle:.1f} deg", va="top", color=INK)
            axes.set_xlim(-0.18 * length, 1.18 * length)
            axes.set_ylim(-half, half)
            axes.set_aspect("equal")
            axes.axis("off")
        _bar(figure.axes[1], length, -halves[1])
    return figure


def _outer(muscle: Muscle, contraction: float) -> float:
    return float(QUANTITIES["outer_radius"].law(built(muscle, ()), {"contraction": contraction}))


def _side_view(axes: "Axes", muscle: Muscle, contraction: float) -> None:
    from matplotlib.patches import Rectangle

    length = float(muscle.length) * (1 - contraction)
    radius = float(muscle.radius * braid.radius_ratio(contraction, muscle.braid_angle))
    outer = _outer(muscle, contraction)
    axes.add_patch(Rectangle((0, -outer), length, 2 * outer, facecolor="#d9d4c8", edgecolor="none"))
    along = np.linspace(0, length, 1500)
    turn = 2 * np.pi * float(muscle.turns) * along / length
    for start in 2 * np.pi * np.arange(DESIGN_PICTURE.strands) / DESIGN_PICTURE.strands:
        for way, colour in ((1, BLUE), (-1, ORANGE)):
            phase = start + way * turn
            seen = np.where(np.cos(phase) >= 0, radius * np.sin(phase), np.nan)  # what lies in front
            axes.plot(along, seen, color=colour, linewidth=0.7)
    tip, rest = DESIGN_PICTURE.fitting * float(muscle.length), float(muscle.radius)
    for x in (-tip, length):
        axes.add_patch(Rectangle((x, -rest), tip, 2 * rest, facecolor="#6b7280", edgecolor="none"))


def _bar(axes: "Axes", length: float, low: float) -> None:
    size = 10.0 ** np.floor(np.log10(length / 2))
    low += 0.01 * length
    axes.plot([length - size, length], [low, low], color=INK, linewidth=2)
    axes.text(length - size / 2, low + 0.01 * length, showing.show(size, "m"), ha="center", va="bottom", color=INK)


def trade_off(found: Sequence[Design], second: Second) -> "Figure":
    """The objective over the second quantity, a mark for each design."""
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    first = found[0]
    x_unit, x_size = showing.shown_in(first.constraints[-1].unit, abs(first.constraints[-1].value))
    y_unit, y_size = showing.shown_in(first.unit, abs(first.value))
    with rc_context(SETTINGS):
        figure = Figure(figsize=(5.2, 3.6), layout="constrained")
        axes = figure.add_subplot()
        places = [(one.constraints[-1].value / x_size, one.value / y_size) for one in found]
        axes.plot(*zip(*places, strict=True), color=BLUE, linewidth=1)
        for number, ((x, y), one) in enumerate(zip(places, found, strict=True), 1):
            axes.plot(x, y, "o", color=BLUE if one.outcome == "optimal" else ORANGE)
            axes.annotate(str(number), (x, y), xytext=(5, 4), textcoords="offset points", fontsize=8, color=INK)
        axes.set_xlabel(f"{quantity_text(second.quantity, second.at)}" + (f" [{x_unit}]" if x_unit else ""))
        axes.set_ylabel(f"{quantity_text(first.objective, first.at)}" + (f" [{y_unit}]" if y_unit else ""))
    return figure


def figure_of(found: Answer) -> tuple[str, "Figure"]:
    """The picture of an answer under its title: the muscle to scale, or the trade-off."""
    if len(found.designs) > 1 and found.order.second:
        return "The trade-off, a mark for each design", trade_off(found.designs, found.order.second)
    pressure, stroke = stroke_of(found.order.task, found.first)
    return "The muscle to scale", to_scale(found.first.muscle, max(stroke, 0.0), pressure)


def draw(found: Answer, path: str) -> None:
    """Write the picture of an answer: the muscle to scale, or the trade-off."""
    kind = check_kind(path)
    _, figure = figure_of(found)
    write_whole(path, lambda new: figure.savefig(new, dpi=150, format=kind.removeprefix(".")))


def check_kind(path: str) -> str:
    """The kind of a picture, by the end of its name; InputError where it cannot be drawn."""
    kind = Path(path).suffix.lower()
    if kind not in PICTURES:
        raise InputError("the picture's kind is not known", path, cure=f"end its name with {', '.join(PICTURES)}")
    return kind
