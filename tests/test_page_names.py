"""Names on the page: what readers call an effect first, its identifier small behind; other words stay as they are."""

import re

import pytest

from fitting.report.page.names import Names
from mckibben_jax import LIBRARY, SUPPLIES, Pulling, name_of, title_of

NAMES = Names({name_of(kind): kind for kind in (*LIBRARY, *SUPPLIES)})


@pytest.mark.parametrize(
    ("text", "read"),
    [
        ("bladder_neo_hookean is missing.", "Rubber wall, neo-Hookean [bladder_neo_hookean] is missing."),
        ("tip is missing.", "Tip correction [tip] is missing."),
        ("Mostly creep: 19 N on held-out runs", "Mostly Creep [creep]: 19 N on held-out runs"),
        ("tip, weight", "Tip correction [tip], Dead weight [weight]"),
        ("end_stop 0.98", "End stop [end_stop] 0.98"),
        ("+ tip in place of creep", "+ Tip correction [tip] in place of Creep [creep]"),
        ("end_stop + supply_lag.", "End stop [end_stop] + Lag of the supply pressure [supply_lag]."),
        ("held at their values: coulomb_friction.f_s.",
         "held at their values: friction coefficient over scale factor [coulomb_friction.f_s]."),
        ("muscle.braid_angle and muscle.radius", "braid angle [muscle.braid_angle] and radius [muscle.radius]"),
        ("samples carry no weight: next to a turn", "samples carry no weight: next to a turn"),
        ("the tip of the muscle", "the tip of the muscle"),
        ("folder/end_stop/loops.csv and my_end_stop", "folder/end_stop/loops.csv and my_end_stop"),
    ],
)  # fmt: skip
def test_effects_and_parameters_have_their_names(text, read):
    assert re.sub(r'<small class="id">(.*?)</small>', r"[\1]", NAMES.html(text)) == read
    assert NAMES.plain(text) == re.sub(r" \[.*?\]", "", read)


def test_what_is_no_name_is_escaped():
    assert NAMES.html("<b> & tip_pressure") == (
        '&lt;b&gt; &amp; Tip correction that depends on pressure <small class="id">tip_pressure</small>'
    )


def test_every_effect_has_a_title_of_its_own_and_a_users_may_do_without():
    titles = [kind.title for kind in (*LIBRARY, *SUPPLIES)]
    assert all(titles)
    assert len(set(titles)) == len(titles)
    assert title_of(type("MyScrew", (Pulling,), {"__doc__": "A screw."})) == "My screw"


def test_a_library_without_effects_has_no_names():
    assert Names({}).html("tip_pressure & tip") == "tip_pressure &amp; tip"
