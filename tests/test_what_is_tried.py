"""What a discovery tries after a diagnosis, in which order, and what it adds at first sight."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from studied import spring_missing

from fitting.diagnosis import next_model as making
from fitting.diagnosis.findings import InstrumentAnswer
from fitting.diagnosis.outcomes import Reason, Why
from fitting.diagnosis.record import Explanation, Leading
from fitting.diagnosis.step_rules import RULES
from fitting.diagnosis.tiers import is_left, proposals, worth_judging
from fitting.instruments.sources import ErrorKind, Source
from fitting.recordings.accuracy import Channel
from fitting.report.text.practice import small_rest_texts


@pytest.fixture
def found():
    """A diagnosis in which a leads, a + c explains, and c + d do so together though none of them does alone."""
    c = SimpleNamespace(rmse=10.0, full_scale=100.0, fit=SimpleNamespace(residual=np.zeros(3)))
    tried = tuple(
        Explanation(names, rmse=left, held_out_rmse=left, fall=fall, p_value=0.5, adequate=False)
        for names, left, fall in [(("c", "d"), 1.0, 5.0), (("a", "c"), 2.0, 5.0), (("b",), 4.0, 5.0),
                                  (("a",), 6.0, 5.0), (("c",), 9.9, 5.0), (("d",), 8.0, 0.5)]
    )  # fmt: skip
    told = spring_missing(c)
    return replace(told, tried=tried, held_out_rmse=10.0, explanations=(), leading=Leading(("a",), 0.6, 6.0, 9.0))


def test_what_leads_is_tried_whatever_the_verdict(found):
    assert proposals(replace(found, verdict="inconclusive")) == [[("a",)]]
    assert proposals(replace(found, verdict="not in the library"))[0] == [("a",)]
    assert proposals(replace(found, verdict="inconclusive", leading=None)) == []
    assert proposals(replace(found, verdict="nothing detectable")) == []


def test_only_what_is_named_is_tried_where_what_is_missing_is_small(found):
    """A tensile machine's loops of rubber and friction ended with six effects, four of them not there, for 0.1 %."""
    small = replace(found, verdict="not in the library", negligible=True)
    assert proposals(small) == []
    assert proposals(replace(small, verdict="missing", explanations=(("a", "c"),))) == [[("a",), ("c",)], [("a", "c")]]
    assert len(proposals(replace(small, negligible=False))) > 1
    assert proposals(replace(small, verdict="inconclusive")) == [[("a",)]]  # it may be more than what is seen


@pytest.mark.parametrize(("enough", "left"), [(0.01, True), (0.005, True), (0.0041, True), (0.0039, False)])
def test_what_is_small_is_looked_into_where_a_user_cannot_live_with_it(found, enough, left):
    small = replace(
        found, verdict="not in the library", negligible=True, rmse=0.5, noise_floor=0.3, full_scale=100.0
    )  # 0.4 % beyond noise
    rules = replace(RULES, enough=enough)
    assert is_left(small, rules) is left
    assert (proposals(small, rules) == []) is left
    assert not is_left(replace(small, negligible=False), rules)
    assert small_rest_texts(replace(small, verdict="inconclusive"), enough, ["my loops"]) == []
    said = small_rest_texts(small, enough, ["my loops"])
    assert [text.split(": ")[1] for text in said] == ["mckibben discover 'my loops' --enough '0.2 %'"] * left


def test_every_effect_alone_is_tried_where_the_test_is_blind_to_what_lowers_the_error(found):
    blind = replace(found, verdict="inconclusive", why=Why(Reason.TEST_BLIND))
    assert proposals(blind) == [[("a",)], [("b",), ("c",), ("d",)]]
    assert proposals(replace(blind, why=Why(Reason.FAINT))) == [[("a",)]]


def test_effects_are_tried_where_instruments_had_to_err_by_far_more_than_allowed(found):
    """The test is nearly blind to what is the same in all repeats of a few held lengths."""
    within = replace(found, verdict="within the instruments", leading=None, instruments=(_gain(found=0.14),))
    assert proposals(within) == [[("b",), ("a",), ("c",), ("d",)]]
    assert worth_judging(within) == [[("b",), ("a",), ("d",)]]
    assert proposals(replace(within, instruments=(_gain(found=0.002),))) == []
    assert proposals(replace(within, instruments=(_gain(found=0.14, allowed=0.0),))) == []  # taken as exact
    assert proposals(replace(within, verdict="nothing detectable")) == []


def _gain(found, allowed=0.001):
    source = Source(Channel.FORCE, ErrorKind.GAIN_PER_RUN, allowed=allowed, width=0.001)
    return InstrumentAnswer(source, found, None)


def test_what_the_verdict_names_comes_first_and_its_members_before_it(found):
    named = replace(found, verdict="missing", explanations=(("a", "c"),))
    assert proposals(named)[:2] == [[("a",), ("c",)], [("a", "c")]]
    single = replace(found, verdict="one of", explanations=(("a", "c"), ("b",)))
    assert proposals(single)[0] == [("b",)]


def test_all_three_of_a_set_that_is_named_come_after_its_parts(found):
    """A discovery ended with the verdict that one of two triples is missing, and added nothing."""
    three = ("a", "c", "d")
    tried = (replace(found.tried[0], effects=three, held_out_rmse=0.5), *found.tried)
    parts = [[("a",), ("c",), ("d",)], [("c", "d"), ("a", "c")]]
    named = replace(found, tried=tried, verdict="one of", explanations=(three,))
    assert [sorted(tier) for tier in proposals(named)[:2]] == [sorted(tier) for tier in parts]
    assert proposals(named)[2] == [three]
    assert not any(three in tier for tier in proposals(replace(named, explanations=(("a", "c"),))))


def test_two_at_once_come_after_all_that_stand_alone(found):
    """And three never."""
    order = proposals(replace(found, verdict="not in the library", leading=None))
    assert order == [[("b",), ("a",), ("c",), ("d",)], [("c", "d"), ("a", "c")]]
    three = replace(found, verdict="one of", explanations=(("a", "c", "d"),), leading=None)
    assert proposals(three) == [[("a",), ("c",), ("d",)], [("c", "d"), ("a", "c")], [("b",)]]


def test_what_does_not_pay_is_not_judged(found):
    """c removes 1 %; that d removes less than its standard error is for its own fit to say."""
    judged = worth_judging(replace(found, verdict="not in the library"))
    assert judged == [[("a",)], [("b",), ("d",)], [("c", "d"), ("a", "c")]]


@pytest.fixture
def plainly(found, monkeypatch):
    """`plain_step` on a search in which these effects lead with this share; with it what was proposed.

    Where none leads, `there` are plainly there.
    """
    asked = []

    def one(leads, share, adequate=False, there=(), whole=None, measured=()):
        why = lambda added, fit, fits: SimpleNamespace(why=None if added == {whole} == fit else "p")  # noqa: E731
        fits = {frozenset(each): frozenset(each) for each in there}
        examiner = SimpleNamespace(adequacy=why)
        parts = {"a": (("wall_thickness",), ("rubber",)), "b": ((), ()), "c": (("wall_thickness",), ())}
        world = SimpleNamespace(
            effects={name: SimpleNamespace(needs=needs, gives=gives) for name, (needs, gives) in parts.items()},
            measured={*measured},
        )
        glance = SimpleNamespace(base_is_adequate=adequate, world=world, base=None, fits=fits, examiner=examiner)
        here = SimpleNamespace(search=SimpleNamespace(glance=lambda: glance), present=[])
        leading = leads and Leading(leads, share, 1.0, 4.0)
        monkeypatch.setattr(making, "leading_of", lambda *_: leading)
        monkeypatch.setattr(making, "plainly_there", lambda *given: [frozenset(t) for t in there if given[-1] == 0.5])
        monkeypatch.setattr(making, "concluded", lambda _: found)
        monkeypatch.setattr(making, "next_model", lambda *given: (asked.append(given[2]), ("larger", ("tried",)))[1])
        return making.plain_step(here, {}, None, RULES), asked

    return one


@pytest.mark.parametrize("share", [RULES.plain, 0.99])
def test_what_plainly_leads_is_added_before_two_at_once_are_looked_at(plainly, share):
    (said, larger, attempts), asked = plainly(("a",), share)
    assert asked == [[[("a",)]]]
    assert (said.verdict, said.explanations, said.nearest) == ("missing", (("a",),), ())
    assert (larger, attempts) == ("larger", ("tried",))


def test_of_a_class_that_plainly_leads_each_is_proposed(plainly):
    (said, _, _), asked = plainly(("a", "c"), 0.9)
    assert asked == [[[("a",), ("c",)]]]
    assert said.verdict == "one of"


def test_what_is_plainly_there_is_added_though_others_do_as_well(plainly):
    """Strand bending and rubber each left a third of a hose's error: two minutes went into pairs and triples."""
    (said, larger, _), asked = plainly(None, 0.0, there=[("b",), ("a",)])
    assert asked == [[[("b",), ("a",)]]]  # in the order of what they leave
    assert (said.verdict, said.explanations, larger) == ("one of", (("b",), ("a",)), "larger")


def test_what_acts_on_a_part_that_was_measured_comes_before_what_only_may_be_there(plainly):
    """Strand bending took nearly the pull of a rubber wall whose thickness was stated, and was added in its place."""
    for leads, share, there in ((None, 0.0, [("b",), ("c",), ("a",)]), (("b", "a"), 0.9, ())):
        (said, _, _), asked = plainly(leads, share, there=there, measured=["wall_thickness"])
        assert (asked[-1], said.verdict) == ([[("a",)]], "one of")  # the readings do not tell them apart


def test_nothing_is_plain_where_one_of_those_that_do_as_well_may_be_all_that_is_missing(plainly):
    """Strand bending took the place of rubber that stood within the errors of the instruments."""
    said, asked = plainly(None, 0.0, there=[("b",), ("a",)], whole="a")
    assert (said, asked) == ((None, None, ()), [])


def test_nothing_is_plain_where_nothing_is_missing_or_leads_or_leads_by_enough(plainly):
    for given in ((("a",), 0.99, True), (None, 0.0), (("a",), 0.99 * RULES.plain)):
        said, asked = plainly(*given)
        assert said == (None, None, ())
        assert asked == []
