"""One muscle drawn to scale as SVG: from the side and as a section, with the sizes that the model knows."""

import html
import math
from collections.abc import Collection, Sequence

import jax.numpy as jnp
import numpy as np

from fitting import showing
from fitting.problem.unknowns import Unknowns
from fitting.recordings.records import Experiment
from fitting.report.pictures.rig_drawing import LIT
from mckibben_jax.muscle import Muscle

LONG, HALF = 360.0, 46.0  # of the side view, px: its length and its half height at most
LEFT, AXIS = 40.0, 62.0  # of the side view; the height of the axis
SECTION, CENTRE = 42.0, 530.0  # radius and place of the section, px
FITTING = 14.0  # length of a fitting, px
STRANDS = 4  # that wind each way
PIECES = 24  # straight pieces of one turn of a strand
ENDS = 2.0  # what is lit at each end, in radii
DRAWN = "The model's muscle, to scale. Orange: where its effects act. Dashed, where it differs: as measured."
FAINT, DASHED = 'stroke-opacity="0.45"', 'stroke-dasharray="4 3" stroke-opacity="0.8"'


def muscle_html(muscle: Muscle, measured: Muscle | None = None, lit: Collection[str] = ()) -> str:
    """The muscle at rest; dashed, in the same scale, the one that was measured; `lit` are parts where effects act.

    The side view has one scale, the section another one, and both stand below it. A wall that is not known is not
    drawn. Parts of the rig that are no part of the muscle are passed over.
    """
    alone = measured is None or _size(measured) == _size(muscle)
    both = [muscle] if alone or measured is None else [muscle, measured]
    scale = min(LONG / max(float(m.length) for m in both), HALF / max(_outer(m) for m in both))
    across = SECTION / max(_outer(m) for m in both)
    drawn = _side(muscle, scale, lit) + _section(muscle, across, lit)
    if len(both) > 1:
        drawn += _outlines(both[1], scale, across)
    words, dashed = _words(muscle), "" if alone else f"; dashed {_words(both[1])}"
    larger = f"The section is drawn {across / scale:.2g} times as large." if across > 1.05 * scale else ""
    return (
        f'<div class="muscle"><svg viewBox="0 0 620 122" role="img" aria-label="The muscle to scale: {words}{dashed}">'
        f"{drawn}{_extent(muscle, scale)}</svg><small>{words}. {larger}</small></div>"
    )


def model_html(experiments: Sequence[Experiment], layout: Unknowns, vector: np.ndarray, switches: np.ndarray) -> str:
    """The muscle of a model for each data set, beside what was measured of it; lit is where its effects act.

    `vector` holds a value for every unknown of the layout, SI; `switches` is 1 for effects that are in the model.
    """
    drawn = []
    for number, experiment in enumerate(experiments):
        model = layout.model(jnp.asarray(vector), number)
        lit = {type(effect).part for effect, on in zip(model.effects, switches, strict=True) if on}
        drawn.append(muscle_html(model.muscle, experiment.muscle, lit))
    return "".join(drawn)


def _size(muscle: Muscle) -> tuple[float, ...]:
    return float(muscle.length), float(muscle.radius), float(muscle.braid_angle)


def _outer(muscle: Muscle) -> float:
    return float(muscle.radius) + float(muscle.wall_outside or 0.0)


def _words(muscle: Muscle) -> str:
    length, radius, angle = _size(muscle)
    wall = "" if muscle.wall_thickness is None else f", wall {showing.show(float(muscle.wall_thickness), 'm')}"
    told = f"{showing.show(length, 'm')} long, radius {showing.show(radius, 'm')}{wall}"
    return html.escape(f"{told}, braid {showing.show(angle, 'rad')}")


def _shape(path: str, lit: bool, fill: bool = False, width: float = 1.0) -> str:
    if not lit:
        return f'<path d="{path}" fill="none" stroke="currentColor" stroke-width="{width}" {FAINT}/>'
    inside = f'fill="{LIT}" fill-opacity="0.3" fill-rule="evenodd"' if fill else 'fill="none"'
    return f'<path d="{path}" {inside} stroke="{LIT}" stroke-width="2"/>'


def _box(x: float, width: float, half: float) -> str:
    return f"M{x:.1f},{AXIS - half:.1f}h{width:.1f}v{2 * half:.1f}h{-width:.1f}Z"


def _side(muscle: Muscle, scale: float, lit: Collection[str]) -> str:
    length, radius = float(muscle.length) * scale, float(muscle.radius) * scale
    end = min(ENDS * radius, length / 2)
    ends = _box(LEFT, end, radius) + _box(LEFT + length - end, end, radius)
    caps = _box(LEFT - FITTING, FITTING, 0.7 * radius) + _box(LEFT + length, FITTING, 0.7 * radius)
    return (
        _shape(_strands(muscle, scale), "strands" in lit)
        + _shape(_box(LEFT, length, _outer(muscle) * scale), "muscle" in lit, fill=True)
        + (_shape(ends, True, fill=True) if "ends" in lit else "")
        + _shape(caps, "fittings" in lit, fill=True)
    )


def _strands(muscle: Muscle, scale: float) -> str:
    """What lies in front of both families, with the angle that the braid has."""
    length, radius = float(muscle.length) * scale, float(muscle.radius) * scale
    turns = length * math.tan(float(muscle.braid_angle)) / (2 * math.pi * radius)
    steps = max(round(PIECES * turns), PIECES)
    drawn = []
    for way in (-1, 1):
        for number in range(STRANDS):
            pen = "M"
            for k in range(steps + 1):
                turn = 2 * math.pi * (way * turns * k / steps + number / STRANDS)
                if math.cos(turn) < 0:
                    pen = "M"
                    continue
                drawn.append(f"{pen}{LEFT + length * k / steps:.1f},{AXIS + radius * math.sin(turn):.1f}")
                pen = "L"
    return "".join(drawn)


def _circle(radius: float) -> str:
    half = f"a{radius:.1f},{radius:.1f} 0 1 0"
    return f"M{CENTRE - radius:.1f},{AXIS}{half} {2 * radius:.1f},0{half} {-2 * radius:.1f},0Z"


def _section(muscle: Muscle, across: float, lit: Collection[str]) -> str:
    """Bore, wall and braid; the wall's two circles are one shape, so that what is filled is the rubber."""
    outer = _outer(muscle) * across
    wall = 0.0 if muscle.wall_thickness is None else float(muscle.wall_thickness) * across
    bore = _circle(outer - wall)
    rubber = _shape(_circle(outer) + bore, "bladder" in lit, fill=True) if wall else ""
    braid = _shape(_circle(float(muscle.radius) * across), "strands" in lit, width=1.6)
    return _shape(bore, "gas" in lit, fill=True) + rubber + braid


def _outlines(muscle: Muscle, scale: float, across: float) -> str:
    """The muscle as measured, dashed."""
    side = _box(LEFT, float(muscle.length) * scale, _outer(muscle) * scale)
    return f'<path d="{side}{_circle(float(muscle.radius) * across)}" fill="none" stroke="currentColor" {DASHED}/>'


def _extent(muscle: Muscle, scale: float) -> str:
    end = LEFT + float(muscle.length) * scale
    return f'<path d="M{LEFT},112V122M{LEFT},117H{end:.1f}M{end:.1f},112V122" stroke="currentColor" {FAINT}/>'
