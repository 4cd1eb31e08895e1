"""What is said of a whole path of discover: the level of one test holds for all its steps."""

from dataclasses import replace
from types import SimpleNamespace

import pytest

from fitting.diagnosis.findings import Blamed
from fitting.instruments.sources import ErrorKind, Source
from fitting.recordings.accuracy import Channel
from fitting.report.text.path import blamed_on_the_way, path_result, path_texts
from fitting.study.stages import Stage

AT_ONE_PERCENT = SimpleNamespace(level=0.01)


def stages(*p_values):
    """The steps of a discovery with these p-values, the last model being where it ended."""
    found = [Stage("baseline", 9.0, 9.1, diagnosis=AT_ONE_PERCENT, p_value=p_values[0])]
    return [
        *found,
        *(
            Stage("", 8.0 - i, 8.1 - i, added=(f"effect_{i}",), diagnosis=AT_ONE_PERCENT, p_value=p)
            for i, p in enumerate(p_values[1:])
        ),
    ]


def test_the_level_of_one_test_is_that_of_the_path():
    (said,) = path_texts(stages(5e-4, 2e-3, 0.4))
    assert "Everything that was added came to a model that the test rejects (level 0.01)." in said
    assert "at most 1 in 100" in said
    assert path_result(stages(5e-4, 2e-3, 0.4)) == {"path": {"level": 0.01, "additions": 2, "after_rejection": 2}}


def test_a_step_from_a_model_that_was_not_rejected_is_named():
    (said,) = path_texts(stages(5e-4, 0.3, 0.4))
    assert "effect_1" in said
    assert "No chance of error can be stated" in said
    assert "because it lowers the error on held-out runs" in said
    assert path_result(stages(5e-4, 0.3, 0.4))["path"]["after_rejection"] == 1


def test_a_step_from_instruments_that_erred_too_much_says_so():
    first, strained, last = stages(5e-4, 0.3, 0.4)
    (said,) = path_texts([first, replace(strained, strained=True), last])
    assert "because instruments alone would have to err by far more than their accuracy" in said


@pytest.mark.parametrize(
    "steps", [stages(0.4), [replace(stages(1e-3, 0.4)[0], diagnosis=None), *stages(1e-3, 0.4)[1:]]]
)
def test_nothing_is_said_where_nothing_was_discovered(steps):
    assert path_texts(steps) == []


@pytest.mark.parametrize(
    ("sets", "told"),
    [
        ({("effect_0", "rubber"): 11e3}, "11 kPa"),  # one effect of the explanation is added at a time
        ({("effect_0",): 11e3, ("effect_0", "rubber"): 2e3}, "11 kPa"),
        ({("effect_0", "rubber"): 2e3, ("effect_0", "tip"): 3e3}, "2 kPa"),
    ],
)
def test_an_added_effect_asks_what_the_explanation_asks_that_it_comes_from(sets, told):
    zero = Source(Channel.PRESSURE, ErrorKind.ZERO, 400.0, 400.0)
    blamed = tuple(Blamed("effect_0", names, zero, size, None) for names, size in sets.items())
    first, last = stages(5e-4, 0.4)
    (said,) = blamed_on_the_way([replace(first, diagnosis=SimpleNamespace(level=0.01, blamed=blamed)), last])
    assert f"off by {told} (" in said


@pytest.mark.parametrize(("added", "size", "told"), [("effect_0", 11e3, 1), ("effect_0", 300.0, 0), ("other", 11e3, 0)])
def test_an_added_effect_that_blames_an_instrument_says_by_how_much_at_the_end_too(added, size, told):
    zero = Source(Channel.PRESSURE, ErrorKind.ZERO, 400.0, 400.0)
    blaming = SimpleNamespace(level=0.01, blamed=(Blamed(added, (added,), zero, size, None),))
    first, last = stages(5e-4, 0.4)
    said = blamed_on_the_way([replace(first, diagnosis=blaming), last])
    assert len(said) == told
    assert all("effect_0" in text and "off by 11 kPa (known to 0.4 kPa, 28 times" in text for text in said)
