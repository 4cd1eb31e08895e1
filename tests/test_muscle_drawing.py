"""The muscle drawn to scale: lengths in the picture stand to each other as those of the muscle."""

import itertools
import math
import re
import xml.etree.ElementTree as ET

import pytest

from fitting.report.pictures.muscle_drawing import LEFT, muscle_html
from fitting.report.pictures.rig_drawing import LIT
from mckibben_jax.muscle import Muscle

SLIM = Muscle(length=0.3, radius=0.007, braid_angle=math.radians(20), wall_thickness=0.001)
WIDE = Muscle(length=0.2, radius=0.02, braid_angle=math.radians(35), wall_thickness=0.002, wall_outside=0.001)
BOX = re.compile(r"M([\d.]+),([\d.]+)h([\d.]+)v([\d.]+)")
CIRCLE = re.compile(r"M[\d.]+,[\d.]+a([\d.]+)")
POINT = re.compile(r"([ML])([\d.]+),([\d.]+)")


def paths(svg, **having):
    """The paths of a drawing that have these attributes."""
    return [one.get("d") for one in ET.fromstring(svg).iter("path") if having.items() <= one.attrib.items()]


def body(svg):
    """Length and thickness of the side view of the muscle, px."""
    dashed = paths(svg, **{"stroke-dasharray": "4 3"})
    found = [BOX.match(path) for path in paths(svg) if path not in dashed]
    widths = [(float(m[3]), float(m[4])) for m in found if m and float(m[1]) == LEFT]
    return max(widths)


def radii(svg):
    """Of all circles of the section, px."""
    return [float(r) for path in paths(svg) for r in CIRCLE.findall(path)]


@pytest.mark.parametrize("muscle", [SLIM, WIDE])
def test_the_side_view_has_one_scale(muscle):
    length, thick = body(muscle_html(muscle))
    outer = float(muscle.radius) + float(muscle.wall_outside or 0.0)
    assert thick / length == pytest.approx(2 * outer / float(muscle.length), rel=0.02)


@pytest.mark.parametrize("muscle", [SLIM, WIDE])
def test_strands_cross_the_axis_at_the_angle_of_the_braid(muscle):
    strands = max(paths(muscle_html(muscle)), key=len)
    points = [(kind, float(x), float(y)) for kind, x, y in POINT.findall(strands)]
    middle = sum(y for _, _, y in points) / len(points)
    steepest = max(
        abs(y2 - y1) / (x2 - x1)
        for (_, x1, y1), (kind, x2, y2) in itertools.pairwise(points)
        if kind == "L" and abs(y1 + y2 - 2 * middle) < abs(y2 - y1) * 2
    )
    assert steepest == pytest.approx(math.tan(float(muscle.braid_angle)), rel=0.06)


@pytest.mark.parametrize("muscle", [SLIM, WIDE])
def test_the_section_shows_wall_and_braid(muscle):
    braid, wall, outside = float(muscle.radius), float(muscle.wall_thickness), float(muscle.wall_outside or 0.0)
    outer = braid + outside
    found = sorted({r / max(radii(muscle_html(muscle))) for r in radii(muscle_html(muscle))})
    wanted = sorted({(outer - wall) / outer, braid / outer, 1.0})
    assert found == pytest.approx(wanted, rel=0.01)


def test_a_wall_that_is_not_known_is_not_drawn():
    assert len(set(radii(muscle_html(Muscle(length=0.3, radius=0.007, braid_angle=0.35))))) == 1


def test_what_was_measured_is_dashed_in_the_same_scale():
    svg = muscle_html(WIDE, SLIM)
    (dashed,) = paths(svg, **{"stroke-dasharray": "4 3"})
    at = BOX.match(dashed)
    length, _ = body(svg)
    assert float(at[3]) / length == pytest.approx(0.3 / 0.2, rel=0.01)
    assert float(at[4]) / float(at[3]) == pytest.approx(2 * 0.007 / 0.3, rel=0.03)
    assert "dashed 300 mm long, radius 7 mm, wall 1 mm" in svg
    assert paths(muscle_html(WIDE, WIDE), **{"stroke-dasharray": "4 3"}) == []


@pytest.mark.parametrize("part", ["gas", "bladder", "strands", "ends", "muscle", "fittings"])
def test_a_part_is_lit(part):
    assert paths(muscle_html(WIDE), stroke=LIT) == []
    assert paths(muscle_html(WIDE, lit=(part, "supply")), stroke=LIT) != []


def test_the_drawing_stays_within_its_frame():
    for muscle in (SLIM, WIDE, Muscle(length=0.05, radius=0.045, braid_angle=0.9)):
        svg = muscle_html(muscle, SLIM)
        for _, x, y in (point for path in paths(svg) for point in POINT.findall(path)):
            assert 0 <= float(x) <= 620
            assert 0 <= float(y) <= 122
