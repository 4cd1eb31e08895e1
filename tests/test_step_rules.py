"""When a step of a discovery is kept: each rule by plain numbers, and the order of sound rivals."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from fitting.diagnosis import step_rules
from fitting.diagnosis.findings import Fault, Objection
from fitting.diagnosis.judging import Judged, in_order
from fitting.diagnosis.step_rules import RULES, Fitted, denied_sizes, is_no_worse_beyond, objections
from fitting.problem.estimate import Estimate


def model(rmse=10.0, left_out=10.0, bound=(), denied=0.0, values=None, cost=None, readings=100, free=("a.K", "b.L"),
          confined=False, beyond=None):  # fmt: skip
    """A fitted model as the rules see it: errors in N, left-out rows of that size with some scatter.

    `beyond` is their size beyond what instruments can make of them, else the same.
    """
    scatter = np.tile([0.9, 1.1], readings // 2)
    rows = left_out * scatter
    world = SimpleNamespace(
        rmse=lambda rows: float(np.sqrt(np.mean(np.square(rows)))),
        from_stated=lambda fit: {"muscle.radius": denied}, samples=range(readings), values=values or {"K": (5.0, 1.0)},
        layout=SimpleNamespace(entry=lambda name: SimpleNamespace(size_of=abs)),
    )  # fmt: skip
    fit = SimpleNamespace(
        rows=np.full(readings, rmse), cost=rmse**2 if cost is None else cost, free=free, at_bound=tuple(bound),
        effects=frozenset(["a"]), confined=confined, slopes=np.ones((readings, len(free))),
    )  # fmt: skip
    hidden = rows if beyond is None else beyond * scatter
    return Fitted(world, fit, rows, np.repeat(np.arange(10), readings // 10), lambda: hidden)


@pytest.fixture(autouse=True)
def stated_estimates(request, monkeypatch):
    """The rules read the values that `model` states."""
    if "rule" in request.node.name:
        monkeypatch.setattr(
            step_rules,
            "estimates",
            lambda world, *_: {f"a.{name}": Estimate(*known, "1") for name, known in world.values.items()},
        )


GOOD = {"rmse": 5.0, "left_out": 5.0}


def test_the_rule_on_sizes_asks_for_them_whatever_else_is_wrong():
    """In a muscle of twice the radius nothing else that a fit says counts."""
    size, value = Objection(Fault.DENIES, "muscle.radius", 4.0), Objection(Fault.UNKNOWN, "tip.k", 0.5)
    assert denied_sizes([size, value, Objection(Fault.BOUND, "muscle.radius")]) == ("muscle.radius",)
    assert denied_sizes([value]) == denied_sizes([Objection(Fault.RISES)]) == denied_sizes([]) == ()


def test_the_rule_on_bounds_lets_a_confined_size_stand_at_its_end():
    loose, tight = (model(**GOOD, bound=["muscle.radius"], confined=confined) for confined in (False, True))
    assert [why.reason for why in objections(model(), loose)] == [Fault.BOUND]
    assert objections(model(), tight) == ()


@pytest.mark.parametrize(
    ("slope", "known", "value", "lower", "reasons"),
    [
        (0.0, 5.0, 0.0, 0.0, []),  # friction of a muscle that is held, and does not slide inside either
        (1.0, 5.0, 0.0, 0.0, [Fault.BOUND]),  # the smaller model could tell it
        (1.0, 3.0, 0.0, 0.0, [Fault.BOUND]),  # and knew it just so well
        (1.0, 2.9, 0.0, 0.0, []),  # it may be 0 by chance there
        (1.0, 2.9, 0.5, 0.0, [Fault.BOUND]),  # it stands at the upper end
        (0.0, 5.0, 0.5, 0.0, [Fault.BOUND]),
        (0.0, 5.0, -1.0, -1.0, [Fault.BOUND]),  # it is not 0 that it may not leave
    ],
)
def test_the_rule_on_bounds_lets_the_data_say_that_an_effect_is_absent(slope, known, value, lower, reasons):
    before, after = model(values={"L": (known, 1.0)}), model(**GOOD, bound=["a.L"])
    before.fit.free = ("b.K", "a.L")
    before.fit.slopes = np.array([[3.0, slope], [4.0, 0.0]])
    after.world.layout = SimpleNamespace(
        at=lambda names: [1], entry=lambda name: SimpleNamespace(lower=lower, size_of=abs)
    )
    after.fit.vector = np.array([7.0, value])
    assert [why.reason for why in objections(before, after)] == reasons


def test_the_rule_on_costs_compares_sizes_confined_alike():
    """Where only the smaller model could leave the stated sizes, its cost says nothing."""
    before, after = model(cost=10.0), model(**GOOD)
    assert [why.reason for why in objections(before, after)] == [Fault.RISES]
    assert objections(before, after, alike=model(rmse=20.0)) == ()


@pytest.mark.parametrize(
    ("before", "after", "reasons"),
    [
        ({}, GOOD, []),
        ({}, {"rmse": 10.1, "left_out": 5.0}, [Fault.RISES]),
        ({}, GOOD | {"cost": 101.0}, [Fault.RISES]),
        ({}, {"rmse": 5.0, "left_out": 9.1}, [Fault.SMALL_GAIN]),
        ({}, {"rmse": 5.0, "left_out": 10.5}, [Fault.NO_GAIN]),
        ({}, GOOD | {"bound": ["a.K"]}, [Fault.BOUND]),
        ({"bound": ["a.K"]}, GOOD | {"bound": ["a.K"]}, []),  # it was there before
        ({}, GOOD | {"denied": -3.1}, [Fault.DENIES]),
        ({}, GOOD | {"denied": 2.9}, []),
        ({"denied": 9.0}, GOOD | {"denied": -4.0}, [Fault.DENIES]),  # however far the smaller one was from it
        ({}, GOOD | {"values": {"K": (5.0, 1.0), "c": (-0.9, 1.0)}}, [Fault.UNKNOWN]),
        ({}, GOOD | {"values": {"K": (5.0, 1.0), "c": (-1.1, 1.0)}}, []),
        ({"values": {"K": (0.5, 1.0)}}, GOOD | {"values": {"K": (0.5, 1.0)}}, []),  # nor was it known before
        ({}, GOOD | {"values": {"K": (0.5, 1.0)}}, [Fault.UNKNOWN]),
        ({"readings": 20}, GOOD | {"readings": 20, "free": ("a.K",) * 16}, [Fault.FEW]),
    ],
)
def test_each_rule_of_a_step(before, after, reasons):
    assert [why.reason for why in objections(model(**before), model(**after))] == reasons


def test_the_rule_on_scatter_between_runs():
    """A fall that one run alone makes is no gain: within its own standard error."""
    before, after = model(), model(rmse=5.0)
    rows = before.left_out.copy()
    rows[before.groups == 0] = 0.0
    rows[before.groups == 1] *= 1.3
    assert [why.reason for why in objections(before, replace(after, left_out=rows))] == [Fault.NO_GAIN]


@pytest.mark.parametrize(
    ("beyond", "bound", "hides"), [(5.0, (), True), (10.0, (), True), (11.0, (), False), (5.0, ("a.K",), False)]
)
def test_the_rule_on_a_gain_that_hides_behind_errors_of_instruments(beyond, bound, hides):
    """Load cells whose gain differs from run to run cover it; nothing else may speak against the step.

    Beyond these errors runs left out are predicted better, alike or worse.
    """
    before, after = model(), model(rmse=5.0, left_out=10.5, beyond=beyond, bound=bound)
    why = objections(before, after, RULES, adequate=True)
    assert Fault.NO_GAIN in {objection.reason for objection in why}
    assert is_no_worse_beyond(before, after, why, RULES) is hides


def test_the_rule_of_a_tenth_is_not_asked_of_what_is_identified():
    assert objections(model(), model(rmse=5.0, left_out=9.1), RULES, adequate=True) == ()


def test_the_rule_on_values_asks_one_parameter_of_an_effect_that_is_identified():
    half, none = ({"K": (k, 1.0), "c": (0.5, 1.0)} for k in (5.0, 0.5))
    assert objections(model(free=()), model(**GOOD, values=half, free=()), RULES, adequate=True) == ()
    vague = objections(model(free=()), model(**GOOD, values=none, free=()), RULES, adequate=True)
    assert [why.about for why in vague] == ["a.K", "a.c"]


@pytest.mark.parametrize(
    ("other", "first"),
    [
        ({"rmse": 4.0, "left_out": 5.0}, "other"),  # held-out runs do not decide: the smaller error in sample
        ({"rmse": 6.0, "left_out": 5.0}, "one"),
        ({"rmse": 4.0, "left_out": 5.0, "confined": True}, "one"),  # it had to be forced into the stated sizes
        ({"rmse": 4.0, "left_out": 5.0, "free": ("a.K", "b.L", "b.M")}, "one"),  # it has a number more
        ({"rmse": 4.0, "left_out": 5.0, "free": ("a.K", "b.L", "muscle.radius")}, "other"),  # a stated size is none
        ({"rmse": 4.0, "left_out": 6.0}, "one"),  # held-out runs decide
    ],
)
def test_the_rule_on_sound_rivals(other, first):
    judged = [Judged((name,), model(**how), model(), (), ()) for name, how in (("one", GOOD), ("other", other))]
    assert in_order(judged, RULES)[0].names == (first,)
