"""The drawing of a muscle in its rig: every effect has a part, and that part alone is lit."""

import xml.etree.ElementTree as ET

import pytest

from fitting.report.pictures.rig_drawing import LIT, SHAPES, acts_where, rig_svg
from mckibben_jax.effect import PARTS, Energy, name_of
from mckibben_jax.effects import LIBRARY, SUPPLIES


@pytest.mark.parametrize("kind", [*LIBRARY, *SUPPLIES], ids=name_of)
def test_the_part_of_every_effect_is_lit_and_no_other(kind):
    drawn = ET.fromstring(rig_svg(kind))
    lit = [group for group in drawn.iter("g") if group.get("stroke") == LIT]
    assert len(lit) == 1
    assert lit[0] is drawn.findall("g")[-1]  # above all others
    wanted = [path.get("d") for path in ET.fromstring(f"<g>{SHAPES[kind.part]}</g>").iter("path")]
    assert [path.get("d") for path in lit[0].iter("path")] == wanted
    assert PARTS[kind.part] in drawn.get("aria-label", "")


def test_every_part_is_drawn_and_has_an_effect():
    assert set(SHAPES) == set(PARTS) == {kind.part for kind in (*LIBRARY, *SUPPLIES)}


def test_nothing_is_drawn_of_an_effect_that_does_not_say_where_it_acts():
    class Own(Energy):
        """Somewhere."""

    assert rig_svg(Own) == acts_where(Own) == ""


def test_the_drawing_stays_within_its_frame():
    numbers = [float(n) for text in SHAPES.values() for path in ET.fromstring(f"<g>{text}</g>").iter("path")
               for pair in path.get("d", "").replace("M", " ").replace("L", " ").replace("Z", " ").split()
               if "," in pair and "H" not in pair and "V" not in pair for n in pair.split(",")[:1]]  # fmt: skip
    assert min(numbers) >= 0
    assert max(numbers) <= 470
