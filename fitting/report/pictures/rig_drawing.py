"""A muscle in its rig, drawn in lines, with the part lit in which an effect acts."""

import html
import math

from mckibben_jax.effect import PARTS, Effect

LIT = "#d55e00"
LEFT, RIGHT, AXIS = 96.0, 344.0, 66.0  # of the muscle, px
TAPER, THIN, WIDE = 42.0, 10.0, 30.0  # length of an end; radius there and of the body
PITCH, STRANDS = 96.0, 6  # of the strands, and how many wind each way
STEP = 6.0


def rig_svg(kind: type[Effect]) -> str:
    """The drawing for an effect as SVG; empty for one that does not say where it acts."""
    if kind.part not in PARTS:
        return ""
    drawn = "".join(_group(part, part == kind.part) for part in sorted(SHAPES, key=lambda part: part == kind.part))
    return (
        f'<svg class="rig" viewBox="0 0 470 132" role="img" aria-label="{html.escape(acts_where(kind))}">'
        f"<title>{html.escape(acts_where(kind))}</title>{drawn}</svg>"
    )


def acts_where(kind: type[Effect]) -> str:
    """Where an effect acts, in words."""
    return f"Where it acts: {PARTS[kind.part]}" if kind.part in PARTS else ""


def _group(part: str, lit: bool) -> str:
    stroke, width, fill = (LIT, 2.4, 0.3) if lit else ("currentColor", 1.0, 0.0)
    faint = 1.0 if lit else 0.45
    filled = f'fill="{LIT}" fill-opacity="{fill}"' if part in FILLED and lit else 'fill="none"'
    return f'<g stroke="{stroke}" stroke-width="{width}" stroke-opacity="{faint}" {filled}>{SHAPES[part]}</g>'


def _radius(x: float) -> float:
    """Of the braid: it opens from the fittings to the body as a quarter of a wave."""
    share = min(min(x - LEFT, RIGHT - x) / TAPER, 1.0)
    return THIN + (WIDE - THIN) * math.sin(math.pi / 2 * share)


def _places(start: float, end: float) -> list[float]:
    count = round((end - start) / STEP)
    return [start + (end - start) * k / count for k in range(count + 1)]


def _line(points: list[tuple[float, float]], closed: bool = False) -> str:
    joined = " L".join(f"{x:.1f},{y:.1f}" for x, y in points)
    return f'<path d="M{joined}{"Z" if closed else ""}"/>'


def _outline(inset: float, start: float = LEFT, end: float = RIGHT) -> str:
    """The outline of the muscle between two places, moved inwards."""
    upper = [(x, AXIS - _radius(x) + inset) for x in _places(start, end)]
    return _line([*upper, *((x, 2 * AXIS - y) for x, y in reversed(upper))], closed=True)


def _wall() -> str:
    """The rubber wall, cut along the axis: two bands."""
    bands = []
    for side in (-1.0, 1.0):
        outer = [(x, AXIS + side * (_radius(x) - 3)) for x in _places(LEFT, RIGHT)]
        inner = [(x, AXIS + side * (_radius(x) - 8)) for x in _places(LEFT, RIGHT)]
        bands.append(_line([*outer, *reversed(inner)], closed=True))
    return "".join(bands)


def _strands() -> str:
    """Both families, as far as they lie in front."""
    drawn = []
    for way in (-1.0, 1.0):
        for number in range(STRANDS):
            piece: list[tuple[float, float]] = []
            for x in _places(LEFT, RIGHT):
                turn = way * 2 * math.pi * x / PITCH + 2 * math.pi * number / STRANDS
                if math.sin(turn) >= 0:
                    piece.append((x, AXIS + _radius(x) * math.cos(turn)))
                elif piece:
                    drawn.append(piece)
                    piece = []
            drawn.append(piece)
    return "".join(_line(piece) for piece in drawn if len(piece) > 1)


FILLED = ("gas", "bladder", "ends", "muscle", "load cell", "supply", "pressure gauge")
SHAPES = {
    "gas": _outline(9.0, LEFT + 6, RIGHT - 6),
    "bladder": _wall(),
    "strands": _strands(),
    "ends": _outline(0.0, LEFT, LEFT + TAPER) + _outline(0.0, RIGHT - TAPER, RIGHT),
    "muscle": _outline(0.0),
    "fittings": '<path d="M82,56H96V76H82Z M344,56H358V76H344Z M36,66H82 M358,66H388 M432,66H440'
    ' M36,44V88 M440,44V88"/>',
    "supply": '<path d="M20,8H48V34H20Z"/><path fill="none" d="M48,21H89V56"/>',
    "pressure gauge": '<circle cx="72" cy="21" r="9"/><path d="M72,21L78,15"/>',
    "load cell": '<path d="M388,52H432V80H388Z M396,66H424"/>',
    "position gauge": '<path d="M351,76V112 M346,106L351,112L356,106 M270,114H440M270,114V122M304,114V122M338,114V122'
    'M372,114V122M406,114V122M440,114V122"/>',
}
