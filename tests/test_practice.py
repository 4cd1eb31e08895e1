"""The verdict for practice: how much of full scale is left, whether that is enough, and what the rest is."""

import json
from types import SimpleNamespace
from typing import cast

import pytest
from click.testing import CliRunner
from small_muscle import loops, write

from fitting.cli.main import main
from fitting.comparison.compare import Comparison
from fitting.diagnosis.outcomes import NOTHING_MISSING, Verdict
from fitting.report.text.attempts import held_text
from fitting.report.text.practice import practice_result, practice_text
from fitting.report.text.stated_sizes import confined_texts
from fitting.shipped import example_data
from fitting.study.practice import Practice, practice
from fitting.study.stages import Stage, added_by


def test_what_is_left_is_said_first_and_then_what_it_is():
    text = practice_text(Practice(("rubber", "cones"), 0.005, 0.02, 0.01, Verdict.NOT_IN_LIBRARY))
    assert text.startswith(
        "⟦rubber⟧ + ⟦cones⟧ explain all but 0.5 % of full scale (2 % on held-out runs), which is below 1 %"
    )
    assert text.endswith("No effect of the library explains all of what remains.")


def test_a_large_rest_is_called_large_and_instruments_are_named():
    text = practice_text(Practice(("rubber",), 0.02, None, 0.01, Verdict.WITHIN_INSTRUMENTS))
    assert "⟦rubber⟧ explains all but 2 % of full scale, which is above 1 %." in text
    assert text.endswith("What remains is within what the instruments may err by.")
    strained = practice_text(Practice(("rubber",), 0.02, None, 0.01, Verdict.WITHIN_INSTRUMENTS, strained=True))
    assert strained.endswith("only if one erred by more than three times its accuracy.")
    named = practice_text(Practice(("rubber",), 0.02, None, 0.01, Verdict.ONE_OF))
    assert named.endswith("The verdict says what that may be.")


@pytest.mark.parametrize(("enough", "is_enough"), [(0.021, True), (0.019, False)])
def test_who_uses_the_muscle_says_what_is_enough(enough, is_enough):
    found = Practice(("rubber",), 0.02, None, enough, "")
    assert practice_result(found)["practice"]["is_enough"] is is_enough
    assert f"{'below' if is_enough else 'above'} {100 * enough:.1f} %." in practice_text(found)


def test_an_effect_that_was_dropped_again_explains_nothing():
    one = Stage("baseline", 50.0, 60.0)
    steps = [one, Stage("", 5.0, 6.0, added=("rubber", "cones")), Stage("", 10.0, 12.0, dropped=("rubber",))]
    found = practice(steps, cast(Comparison, SimpleNamespace(rmse=10.0, full_scale=1000.0)))
    assert found.added == ("cones",)
    assert (found.left, found.held_out) == (0.01, 0.012)


def test_what_gave_way_and_came_back_explains_its_share():
    """Of a rubber in place of another one the second explains; what was taken out and added again does so, too."""
    steps = [Stage("baseline", 50.0, 60.0), Stage("", 9.0, 9.0, added=("rubber",)),
             Stage("", 8.0, 8.0, added=("other",), dropped=("rubber",))]  # fmt: skip
    assert added_by(steps) == ("other",)
    assert added_by([*steps, Stage("", 7.0, 7.0, added=("rubber",), dropped=("other",))]) == ("rubber",)


def test_sizes_of_several_data_sets_are_named_once():
    """Three hoses have twelve, and the names of data sets have blanks: no shell takes them after --free."""
    (one,) = held_text(["muscle.radius"])
    assert "From here on ⟦muscle.radius⟧ stay" in one
    (both,) = held_text(["muscle.radius@long hose", "muscle.length@long hose", "muscle.radius@hose, short"])
    assert "From here on ⟦muscle.radius⟧, ⟦muscle.length⟧ of every data set stay" in both
    (later,) = confined_texts(["muscle.radius@long hose", "muscle.length@long hose", "muscle.radius@hose, short"])
    held = "the model file holds ⟦muscle.radius⟧, ⟦muscle.length⟧ fixed"
    assert later.endswith(f"{held} (--free muscle.radius muscle.length lets all sizes go).")


@pytest.mark.parametrize("text", ["0", "110 %", "much", "5 N"])
def test_what_is_no_share_is_refused_before_anything_is_computed(text):
    result = CliRunner().invoke(main, ["discover", str(example_data("muscle_a")), "--enough", text])
    assert result.exit_code == 2
    assert "--enough" in result.output


def test_discover_says_it_on_the_terminal_on_the_page_and_in_json(tmp_path):
    data = write(tmp_path / "small", loops(lambda eps, *_: 400 * eps, points=20, repeats=2))
    words = ["discover", str(data), "--baseline", "--candidates", "linear_spring", "tip", "--enough", "0.2 %"]
    places = [
        "--save",
        str(tmp_path / "m.toml"),
        "--json",
        str(tmp_path / "r.json"),
        "--html",
        str(tmp_path / "r.html"),
    ]
    result = CliRunner().invoke(main, [*words, *places])
    assert result.exit_code == 0, result.output
    said = json.loads((tmp_path / "r.json").read_text())
    share = said["rmse_N"] / said["full_scale_N"]
    assert said["practice"] | {"held_out_left": None} == {
        "left": pytest.approx(share, rel=1e-6), "held_out_left": None, "enough": 0.002, "is_enough": share < 0.002,
    }  # fmt: skip
    text = f"which is {'below' if share < 0.002 else 'above'} 0.2 %"
    shown = " ".join(result.output.split())
    assert text in shown
    after = "posterior" if said["verdict"] in NOTHING_MISSING else "plan"
    assert f"NEXT mckibben {after} {data} --model {tmp_path / 'm.toml'}" in shown  # not the baseline again
    on_page = " ".join((tmp_path / "r.html").read_text().split())
    assert text.replace("which is", "What is left is") in on_page
    assert f"<code>mckibben {after} {data} --model {tmp_path / 'm.toml'}" in on_page  # as on the terminal
