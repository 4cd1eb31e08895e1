"""The sentence for practice: how much of full scale is left, and what it is."""

from fitting.diagnosis.outcomes import Verdict
from fitting.report.text.practice import practice_text
from fitting.study.stages import Stage


def stages(verdict, *added):
    return [Stage("baseline", 50.0, 60.0), *(Stage("", 5.0, 20.0, verdict, added=(name,)) for name in added)]


def test_what_is_left_is_said_first_and_then_what_it_is():
    text = practice_text(stages(Verdict.NOT_IN_LIBRARY, "rubber", "cones"), 5.0, 1000.0)
    assert text.startswith(
        "rubber + cones explain all but 0.5 % of full scale (2 % on held-out runs), which is below 1 %"
    )
    assert text.endswith("What remains follows no effect of the library.")


def test_a_large_rest_is_called_large_and_instruments_are_named():
    text = practice_text(stages(Verdict.WITHIN_INSTRUMENTS, "rubber"), 20.0, 1000.0)
    assert "rubber explains all but 2 % of full scale" in text
    assert "which is above 1 %. What remains is within what the instruments may err by." in text
