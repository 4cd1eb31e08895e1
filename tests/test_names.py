"""Names in texts: each medium says what is marked in its own way; other words stay as they are."""

import io
import json
import re

import pytest

from fitting.report.page.names import PageNames
from fitting.report.page.parts import as_text
from fitting.report.results import write_json
from fitting.report.text.layout import columns, line
from fitting.report.text.names import Names, identifiers, listed, mark, marked
from mckibben_jax import LIBRARY, SUPPLIES, Pulling, name_of, title_of

NAMES = PageNames({name_of(kind): kind for kind in (*LIBRARY, *SUPPLIES)})


def on_the_page(text):
    """The HTML of a text with identifiers in brackets."""
    return re.sub(r'<small class="id">(.*?)</small>', r"[\1]", str(NAMES.html(text)).replace("<wbr>", ""))


@pytest.mark.parametrize(
    ("text", "read"),
    [
        ("⟦bladder_neo_hookean⟧ is missing.", "Rubber wall, neo-Hookean [bladder_neo_hookean] is missing."),
        ("⟦tip⟧ is missing.", "Tip correction [tip] is missing."),
        ("Mostly ⟦creep⟧: 19 N on held-out runs", "Mostly Creep [creep]: 19 N on held-out runs"),
        (marked(("tip", "weight")), "Tip correction [tip], Dead weight [weight]"),
        ("⟦end_stop⟧ 0.98", "End stop [end_stop] 0.98"),
        ("+ ⟦tip⟧ in place of ⟦creep⟧", "+ Tip correction [tip] in place of Creep [creep]"),
        (f"{marked(('end_stop', 'supply_lag'), ' + ')}.",
         "End stop [end_stop] + Lag of the supply pressure [supply_lag]."),
        (f"held at their values: {mark('coulomb_friction.f_s')}.",
         "held at their values: friction coefficient over scale factor [coulomb_friction.f_s]."),
        (marked(("muscle.braid_angle", "muscle.radius"), " and "),
         "braid angle [muscle.braid_angle] and radius [muscle.radius]"),
        ("⟦tip.k@second set⟧ = 1.1", "ratio of braid to muscle contraction [tip.k@second set] = 1.1"),
        ("samples carry no weight: next to a turn", "samples carry no weight: next to a turn"),
        ("the tip of the muscle", "the tip of the muscle"),
        ("folder/end_stop/loops.csv and my_end_stop", "folder/end_stop/loops.csv and my_end_stop"),
    ],
)  # fmt: skip
def test_effects_and_parameters_have_their_names(text, read):
    assert on_the_page(text) == read
    assert NAMES.plain(text) == re.sub(r" \[.*?\]", "", read)
    assert NAMES.spoken(text) == read.replace("[", "(").replace("]", ")")
    assert identifiers(text) == text.replace("⟦", "").replace("⟧", "")


def test_what_is_no_name_is_escaped():
    assert NAMES.html("<b> & ⟦tip_pressure⟧") == (
        '&lt;b&gt; &amp; Tip correction that depends on pressure <small class="id">tip_pressure</small>'
    )
    assert "<i>" not in NAMES.html("⟦<i>⟧")


def test_every_effect_has_a_title_of_its_own_and_a_users_may_do_without():
    titles = [kind.title for kind in (*LIBRARY, *SUPPLIES)]
    assert all(titles)
    assert len(set(titles)) == len(titles)
    assert title_of(type("MyScrew", (Pulling,), {"__doc__": "A screw."})) == "My screw"


def test_of_a_library_without_effects_identifiers_stay():
    assert PageNames({}).html("tip_pressure & ⟦tip⟧") == 'tip_pressure &amp; <small class="id">tip</small>'
    assert Names({}).spoken("⟦tip⟧ is missing.") == "tip is missing."


def test_a_users_own_effect_has_its_name_on_the_terminal_too():
    own = Names({"my_screw": type("MyScrew", (Pulling,), {"title": "Our screw"})})
    table = columns("effect", "RMS")
    table.add_row("⟦my_screw⟧", "1 N")
    said = as_text([line("VERDICT", "⟦my_screw⟧ is missing."), table], own)
    assert said.count("Our screw (my_screw)") == 2


def test_a_long_list_on_the_terminal_has_identifiers_alone():
    assert Names().spoken(listed(["tip", "creep"])) == "Tip correction (tip), Creep (creep)"
    assert listed(["tip", "creep", "hill", "weight", "mullins"]) == "tip, creep, hill, weight, mullins"


def test_machines_read_identifiers(tmp_path):
    place = tmp_path / "result.json"
    write_json(str(place), {"⟦tip⟧": ["needs ⟦creep⟧", {"why": "⟦tip.k⟧ ends at its bound"}]})
    assert json.loads(place.read_text()) == {"tip": ["needs creep", {"why": "tip.k ends at its bound"}]}


def test_a_cell_is_broken_before_an_identifier_and_a_column_goes_only_then():
    from rich.console import Console

    def shown(width):
        table = columns("effect added", "RMS", "most similar", words=(0, 2), spare=(2,))
        table.add_row("⟦bladder_neo_hookean⟧", "0.592 N", "end_stop 0.98")
        out = Console(width=width, record=True, file=io.StringIO())
        out.print(table)
        return [row.rstrip() for row in out.export_text().splitlines()]

    assert shown(80)[1] == "Rubber wall, neo-Hookean (bladder_neo_hookean)  0.592 N  end_stop 0.98"
    assert [row.split("  ")[0] for row in shown(60)[1:]] == ["Rubber wall, neo-Hookean", "(bladder_neo_hookean)"]
    assert "most similar" in shown(60)[0]
    assert "most similar" not in shown(34)[0]


def test_a_long_identifier_breaks_where_words_end():
    """A narrow column broke it anywhere: bladder_mooney_rivli, and an n below."""
    html = PageNames().html("⟦bladder_mooney_rivlin.C01⟧ and ⟦tip.k⟧")
    assert '<small class="id">bladder_<wbr>mooney_<wbr>rivlin.<wbr>C01</small>' in html
    assert '<small class="id">tip.k</small>' in html


def test_a_headline_of_many_names_has_no_identifiers_between_them():
    few, many = marked(("tip", "weight"), " + "), marked(("tip", "weight", "creep"), " + ")
    assert "class" in NAMES.headline(few)
    assert NAMES.headline(f"{many} < all") == "Tip correction + Dead weight + Creep &lt; all"
