"""The next model of a discovery: what comes first, what gives way, and what is tried beside it."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from fitting.diagnosis import next_model as making
from fitting.diagnosis.findings import Fault, Objection
from fitting.diagnosis.judging import Judged
from fitting.diagnosis.next_model import next_model
from fitting.diagnosis.step_rules import RULES
from mckibben_jax.effects import BladderNeoHookean, IdealCylinder, LinearSpring, Tip, Weight

CONFINED = SimpleNamespace(confined=True)  # a fit whose sizes are confined
MOONEY, NEO = ("bladder_mooney_rivlin", "tip"), ("bladder_neo_hookean", "tip")


def judged(name, gain_is_hidden):
    """A model with one effect more against which only its gain speaks, if anything."""
    end = SimpleNamespace(
        world=SimpleNamespace(from_stated=lambda _: {}),
        fit=SimpleNamespace(vector=np.zeros(0), confined=False, free=()), rmse=1.0, held_out_rmse=1.0,
        left_out=np.ones(4), groups=np.arange(4), beyond=lambda: np.array([0.4, 0.5, 0.6, 0.5]),
    )  # fmt: skip
    smaller = SimpleNamespace(beyond=lambda: np.ones(4), groups=np.arange(4))
    return Judged((name,), end, smaller, (), (Objection(Fault.NO_GAIN),) if gain_is_hidden else ())


@pytest.mark.parametrize(
    ("tiers", "verdict", "taken"),
    [
        ([], "missing", ("tip",)),  # at first sight it gains nothing
        ([[("tip",)]], "missing", ("tip",)),
        ([[("tip",)], [("weight",)]], "missing", ("weight",)),  # what is seen to gain comes before it
        ([[("tip",)]], "one of", None),
    ],
    ids=["not looked at", "alone", "beside a plain gain", "one of several"],
)
def test_what_is_missing_is_added_though_its_gain_hides_behind_instruments(tiers, verdict, taken, monkeypatch):
    """Else a discovery would end with the verdict that it is missing, and not add it."""
    monkeypatch.setattr(making, "judge", lambda _, __, names, *___: judged(names[0], names[0] == "tip"))
    monkeypatch.setattr(making, "fitted", lambda *_: judged("before", False).alike)
    monkeypatch.setattr(making, "objections", lambda *_: ())
    world = SimpleNamespace(settings=SimpleNamespace(workers=1), layout=SimpleNamespace(names=()))
    tried = [SimpleNamespace(effects=(name,), adequate=name == "tip") for name in ("tip", "weight")]
    told = SimpleNamespace(tried=tried, explanations=(("tip",),), verdict=verdict)
    known = {"tip": Tip(), "weight": Weight()}
    begin = lambda *_: SimpleNamespace(world=world, base=CONFINED)  # noqa: E731
    here = SimpleNamespace(world=world, base=CONFINED)
    larger, attempts = next_model(here, [IdealCylinder()], tiers, told, known, begin, RULES)
    assert (larger and larger.added) == taken
    assert taken not in [attempt.effects for attempt in attempts]


def test_a_value_at_its_bound_leads_to_the_simpler_relative(monkeypatch):
    """Rubber of Mooney and Rivlin beside friction was refused for its second constant; neo-Hookean was not tried."""
    at_bound = Objection(Fault.BOUND, "bladder_mooney_rivlin.C01")
    fits = {
        ("bladder_mooney_rivlin", "tip"): replace(judged("tip", False), names=MOONEY, why=(at_bound,)),
        ("bladder_neo_hookean", "tip"): replace(judged("tip", False), names=NEO),
    }
    begun = dict[tuple[str, ...], object]()

    def judge(_, __, names, ___, ____, _____, begin):
        begun[names] = begin
        return fits[names]

    monkeypatch.setattr(making, "judge", judge)
    monkeypatch.setattr(making, "fitted", lambda *_: judged("before", False).alike)
    monkeypatch.setattr(making, "objections", lambda *_: ())
    rubbers = {name: SimpleNamespace(family="rubber") for name in ("bladder_mooney_rivlin", "bladder_neo_hookean")}
    world = SimpleNamespace(
        settings=SimpleNamespace(workers=1), effects=rubbers | {"tip": SimpleNamespace(family=None)},
        candidates=[*rubbers, "tip"],
        layout=SimpleNamespace(names=(), of_effect=lambda name: "two" if "mooney" in name else "1"),
    )  # fmt: skip
    told = SimpleNamespace(tried=[], explanations=(), verdict="not in the library")
    known = {"tip": Tip(), "bladder_neo_hookean": BladderNeoHookean()}
    here = SimpleNamespace(world=world, base=CONFINED)
    larger, attempts = next_model(here, [IdealCylinder()], [[MOONEY]], told, known, lambda *_: here, RULES)
    assert larger.added == NEO
    assert [attempt.effects for attempt in attempts] == [MOONEY]
    assert begun[MOONEY] is None
    assert begun[NEO] is fits[MOONEY].after.fit.vector


@pytest.mark.parametrize(
    ("adequate", "later", "left", "taken"),
    [(False, True, 0.8, "weight"), (False, False, 0.8, "tip"), (True, True, 0.8, "tip"), (False, True, 0.7, "tip")],
    ids=["another stands beside all", "none does", "nothing is missing then", "it leaves less than half of that"],
)
def test_an_earlier_effect_gives_way_only_where_nothing_like_it_stands_beside_it(
    adequate, later, left, taken, monkeypatch
):
    """Strand bending in the place of a spring came before the rubber that stood beside it, and led astray."""
    gives_way, stands = judged("tip", False), judged("weight", not later)
    gives_way.after.held_out_rmse = left  # the other leaves 1 N
    fits = {"tip": replace(gives_way, gone=("linear_spring",)), "weight": stands}
    monkeypatch.setattr(making, "judge", lambda _, __, names, *___: fits[names[0]])
    monkeypatch.setattr(making, "fitted", lambda *_: judged("before", False).alike)
    monkeypatch.setattr(making, "objections", lambda *_: ())
    world = SimpleNamespace(settings=SimpleNamespace(workers=1), layout=SimpleNamespace(names=()))
    tried = [SimpleNamespace(effects=("tip",), adequate=adequate)]
    told = SimpleNamespace(tried=tried, explanations=(), verdict="not in the library")
    known, here = {"tip": Tip(), "weight": Weight()}, SimpleNamespace(world=world, base=CONFINED)
    begin = lambda *_: SimpleNamespace(world=world, base=CONFINED)  # noqa: E731
    present = [IdealCylinder(), LinearSpring()]
    larger, _ = next_model(here, present, [[("tip",)], [("weight",)]], told, known, begin, RULES)
    assert larger.added == (taken,)
    assert larger.dropped == (("linear_spring",) if taken == "tip" else ())
