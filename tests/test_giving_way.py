"""An effect of the smaller model that has become idle beside a new one gives way to it, and only then."""

from types import SimpleNamespace

import pytest
from small_muscle import loops, surface, write

from fitting.diagnosis import judging
from fitting.diagnosis.discover import discover
from fitting.diagnosis.findings import Fault, Objection
from fitting.diagnosis.judging import Judged, judge
from fitting.diagnosis.step_rules import RULES
from fitting.recordings.experiment import read_experiment
from mckibben_jax.effects import ConstantFriction, CoulombFriction, IdealCylinder, Tip

BASE = (IdealCylinder(), CoulombFriction())
BOUND, VAGUE = Objection(Fault.BOUND, "coulomb_friction.f_s"), Objection(Fault.UNKNOWN, "coulomb_friction.f_s", 0.3)


def test_constant_friction_takes_the_place_of_coulombs(tmp_path):
    """Coulomb's ends at 0 beside it; the step was refused for that, and the discovery stood still."""
    constant = lambda eps, pressure, sign: (15.0 - 0.012 * surface(eps) * pressure) * sign  # noqa: E731
    experiment = read_experiment(write(tmp_path / "set", loops(constant, points=40, repeats=2)))
    steps = discover([experiment], BASE, candidates=[ConstantFriction(), Tip()])
    assert [(step.added, step.dropped) for step in steps] == [
        (("baseline",), ()),
        (("constant_friction",), ("coulomb_friction",)),
    ]
    assert steps[-1].verdict == "nothing detectable"
    assert steps[-1].rmse == pytest.approx(0.3, rel=0.05)  # the noise


@pytest.fixture
def judged(monkeypatch):
    """`judge` of a model with "new" beside "coulomb_friction" and "creep", when these objections are raised against it.

    `without` are those against the same model without effects, by their number.
    """

    def one(why, without=(), adequate=True, missing=None, needed=(), added=(), without_both=()):
        smaller = frozenset(["coulomb_friction", "creep"])
        world = SimpleNamespace(lacking=lambda left: needed, fit=lambda left, _: SimpleNamespace(effects=left))
        after = SimpleNamespace(world=world, fit=SimpleNamespace(effects=smaller | {"new"}, vector=None))
        before = SimpleNamespace(fit=SimpleNamespace(effects=smaller))
        seen = SimpleNamespace(settled=lambda *_: None)
        tested = SimpleNamespace(adequacy=lambda *_: SimpleNamespace(why=missing), seen=seen)
        monkeypatch.setattr(judging, "_with_all", lambda *_: Judged(("new",), after, before, (), tuple(why)))
        monkeypatch.setattr(judging, "fitted", lambda world, fit, search: SimpleNamespace(world=world, fit=fit))

        def asked(_, model, rules, as_adequate, alike):
            if as_adequate is not adequate or alike is not before:
                return ("else",)
            return tuple(without_both if len(model.fit.effects) == 1 else without)

        monkeypatch.setattr(judging, "objections", asked)
        search = SimpleNamespace(examiner=tested, fits={frozenset(["new"]): SimpleNamespace(vector=None)})
        return judge(search, before, ("new",), RULES, adequate, added)

    return one


@pytest.mark.parametrize("why", [[BOUND], [VAGUE], [BOUND, VAGUE]])
def test_what_has_become_idle_gives_way(judged, why):
    found = judged(why)
    assert (found.why, found.gone) == ((), ("coulomb_friction",))
    assert found.after.fit.effects == {"new", "creep"}


@pytest.mark.parametrize(
    ("without_both", "gone"), [((), ("coulomb_friction", "creep")), ([Objection(Fault.RISES)], ("coulomb_friction",))]
)
def test_several_that_have_become_idle_go_together_or_one_of_them(judged, without_both, gone):
    """Strand bending and creep beside the rubber for which both had been added: it was kept out by the two."""
    why = [BOUND, Objection(Fault.UNKNOWN, "creep.tau", 0.1)]
    found = judged(why, without_both=without_both, adequate=False, added=("coulomb_friction", "creep"))
    assert (found.why, found.gone) == ((), gone)
    assert found.after.fit.effects == {"coulomb_friction", "creep", "new"} - {*gone}


@pytest.mark.parametrize("why", [[BOUND], [VAGUE, VAGUE]])
def test_what_stood_in_for_another_gives_way_though_more_is_missing(judged, why):
    """Ogden's rubber beside an end stop and a weight, for which it was added: nothing else would be let in."""
    found = judged(why, adequate=False, missing="p", added=("coulomb_friction",))
    assert (found.why, found.gone) == ((), ("coulomb_friction",))


@pytest.mark.parametrize(
    "given",
    [
        {"why": [BOUND], "adequate": False},  # more is missing, and it was there from the beginning
        {"why": [BOUND], "adequate": False, "added": ("coulomb_friction",), "without": [Objection(Fault.SMALL_GAIN)]},
        {"why": [Objection(Fault.BOUND, "new.K")], "adequate": False, "added": ("coulomb_friction",)},
        {"why": [BOUND], "missing": "p"},  # or from the larger one without it
        {"why": [BOUND], "without": [Objection(Fault.NO_GAIN)]},  # it pays only with both
        {"why": [BOUND], "needed": ("friction",)},  # another effect needs it
        {"why": [BOUND, Objection(Fault.NO_GAIN)]},  # it does not pay, whatever stands at its bound
        {"why": [Objection(Fault.BOUND, "new.K")]},  # what is new is idle itself
        {"why": [BOUND, Objection(Fault.BOUND, "creep.tau")], "adequate": False, "added": ("creep",)},  # not all were
        {"why": [BOUND, Objection(Fault.BOUND, "creep.tau")], "without": [VAGUE], "without_both": [VAGUE]},
        {"why": [Objection(Fault.DENIES, "muscle.radius")]},
    ],
)
def test_in_all_other_cases_the_objections_stand(judged, given):
    found = judged(**given)
    assert (found.why, found.gone) == (tuple(given["why"]), ())


def test_a_step_against_which_nothing_speaks_keeps_both(judged):
    assert judged([]).gone == ()
