"""A discovery: what leads is added, one effect at a time, no step raises an error, and what is unsound is not kept."""

import json
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace

import jax
import numpy as np
import pytest
from click.testing import CliRunner
from hidden import simulator
from small_muscle import loops, surface, write
from studied import spring_missing

from fitting.cli.main import main
from fitting.diagnosis import discover as discovering
from fitting.diagnosis import judging
from fitting.diagnosis.among_all import fit_from_smaller
from fitting.diagnosis.course import ModelOnTheWay
from fitting.diagnosis.discover import discover, proposals, worth_judging
from fitting.diagnosis.findings import Fault, InstrumentAnswer, Objection
from fitting.diagnosis.judging import Judged, ends_of, first_sound
from fitting.diagnosis.lay_out import universe
from fitting.diagnosis.outcomes import NOTHING_MISSING, Reason, Why
from fitting.diagnosis.record import Explanation, Leading
from fitting.diagnosis.step_rules import RULES
from fitting.instruments.sources import ErrorKind, Source
from fitting.least_squares.fit import fit
from fitting.recordings.accuracy import Channel
from fitting.recordings.experiment import read_experiment
from mckibben_jax.effect import Pulling, name_of
from mckibben_jax.effects import (
    BladderMooneyRivlin,
    BladderNeoHookean,
    ConicalEnds,
    CoulombFriction,
    EndStop,
    IdealCylinder,
    LinearSpring,
    TextileFriction,
    Tip,
    Weight,
)
from mckibben_jax.parameter import parameter

DATA = Path(__file__).parents[1] / "data"
BASE = (IdealCylinder(), CoulombFriction())


# -------------------------------------------------------------------------------------------------------- measured data


@pytest.fixture(scope="module")
def measured():
    """The steps on a published static map, and those steps as they were announced."""
    announced = []
    experiment = read_experiment(DATA / "martens2017_dmsp20")
    candidates = [BladderNeoHookean(), BladderMooneyRivlin(), Tip(), EndStop(), LinearSpring()]
    return discover([experiment], BASE, candidates=candidates, on_step=announced.append), announced


def test_a_measured_muscle_gets_its_rubber(measured):
    """Martens and Boblan explain these forces by a rubber wall; the ideal cylinder leaves many times their noise."""
    steps, _ = measured
    families = {kind.__name__: kind.family for kind in (BladderNeoHookean, BladderMooneyRivlin)}
    assert set(families.values()) == {"bladder"}
    assert steps[1].effect in ("bladder_neo_hookean", "bladder_mooney_rivlin")
    assert steps[0].diagnosis.leading.effects[0] == steps[1].effect
    assert steps[1].rmse < 0.5 * steps[0].rmse


def test_no_step_raises_an_error_and_each_pays(measured):
    steps, announced = measured
    assert list(steps) == announced
    for before, after in pairwise(steps):
        assert after.rmse < before.rmse
        assert after.held_out_rmse < 0.9 * before.held_out_rmse


def test_what_is_kept_is_the_muscle_that_was_measured(measured):
    """The ideal cylinder alone wants twice the stated radius. No step leaves a stated size by over two errors."""
    steps, _ = measured
    priors = read_experiment(DATA / "martens2017_dmsp20").priors
    away = [abs(steps[0].diagnosis.baseline.values[name] - mean) / sd for name, (mean, sd) in priors.items()]
    assert max(away) > 10
    for step in steps[1:]:
        values = step.diagnosis.baseline.values
        assert all(abs(values[name] - mean) <= 2.001 * sd for name, (mean, sd) in priors.items())
        assert set(step.diagnosis.baseline.at_bound) <= set(priors)  # a confined size may stand at its end
    assert "muscle.radius" in steps[1].held
    modulus = next(value for name, value in steps[1].diagnosis.baseline.values.items() if name.startswith("bladder"))
    assert 0.3e6 < modulus < 3e6  # Pa: rubbers of hoses


def test_what_is_not_kept_says_why(measured):
    """Mooney and Rivlin's rubber has one number more than these data know."""
    steps, _ = measured
    attempts = [attempt for step in steps for attempt in step.attempts]
    assert all(attempt.why for attempt in attempts)
    for attempt in attempts:
        if "bladder_mooney_rivlin" in attempt.effects:
            assert {w.reason for w in attempt.why} & {Fault.BOUND, Fault.UNKNOWN, Fault.NO_GAIN}


def judged(name, gain_is_hidden):
    """A model with one effect more against which only its gain speaks, if anything."""
    end = SimpleNamespace(
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
    monkeypatch.setattr(discovering, "judge", lambda _, __, names, *___: judged(names[0], names[0] == "tip"))
    monkeypatch.setattr(discovering, "fitted", lambda *_: judged("before", False).alike)
    monkeypatch.setattr(discovering, "objections", lambda *_: ())
    world = SimpleNamespace(settings=SimpleNamespace(workers=1), layout=SimpleNamespace(names=()))
    tried = [SimpleNamespace(effects=(name,), adequate=name == "tip") for name in ("tip", "weight")]
    told = SimpleNamespace(tried=tried, explanations=(("tip",),), verdict=verdict)
    known = {"tip": Tip(), "weight": Weight()}
    begin = lambda *_: SimpleNamespace(world=world, base=None)  # noqa: E731
    here = SimpleNamespace(world=world, base=None)
    larger, attempts = discovering._next(here, [IdealCylinder()], tiers, told, known, begin, RULES)
    assert (larger and larger.added) == taken
    assert taken not in [attempt.effects for attempt in attempts]


@pytest.mark.parametrize("adequate", [False, True])
def test_a_rejected_model_is_asked_for_what_does_not_pay_and_the_path_goes_on(adequate, monkeypatch):
    """Tip, spring, then a weight; the first two go, and after them an end stop comes."""
    found = SimpleNamespace(rmse=1.0, held_out_rmse=1.0, verdict="missing", p_value=0.001)
    search = SimpleNamespace(run=lambda: SimpleNamespace(base_is_adequate=adequate), world=None)
    present, coming = list(BASE), [Tip(), LinearSpring(), Weight(), None, EndStop(), None]

    def larger(*_):
        new = coming.pop(0)
        if new is None:
            return None, ()
        present.append(new)
        return ModelOnTheWay((name_of(new),), list(present), search), ()

    def smaller(here, added, *_):
        idle = ("tip", "linear_spring")
        if not {*idle} <= {*map(name_of, here.present)}:
            return None
        assert added == ["tip", "linear_spring", "weight"]
        present[:] = [effect for effect in here.present if name_of(effect) not in idle]
        return ModelOnTheWay((), list(present), search, dropped=idle)

    stubs = {
        "prepared": lambda *_, **__: search, "concluded": lambda _: found, "_next": larger, "without_idle": smaller,
        "_plainly": lambda *_: (None, None, ()), "worth_judging": lambda *_: [], "smaller_models": lambda *_: [],
    }  # fmt: skip
    for name, stub in stubs.items():
        monkeypatch.setattr(discovering, name, stub)
    candidates = [Tip(), LinearSpring(), Weight(), EndStop()]
    steps = discover([], BASE, candidates=candidates, rules=replace(RULES, steps=4))
    told = [(step.added, step.dropped) for step in steps]
    came = [(("baseline",), ()), (("tip",), ()), (("linear_spring",), ()), (("weight",), ())]
    assert told == came + ([] if adequate else [((), ("tip", "linear_spring")), (("end_stop",), ())])


def test_a_model_from_which_something_was_dropped_is_not_asked_once_more(monkeypatch):
    """Beside it as it is now each of the others may pay a little less than a step must, one after another."""
    found = SimpleNamespace(rmse=1.0, held_out_rmse=1.0, verdict="missing", p_value=0.001)
    search = SimpleNamespace(run=lambda: SimpleNamespace(base_is_adequate=False), world=None)
    coming = [ModelOnTheWay(("tip",), [*BASE, Tip()], search)]
    gone = iter(
        [ModelOnTheWay((), list(BASE), search, dropped=("tip",)), ModelOnTheWay((), [], search, dropped=("b",))]
    )
    stubs = {
        "prepared": lambda *_, **__: search, "concluded": lambda _: found, "worth_judging": lambda *_: [],
        "_next": lambda *_: (coming.pop() if coming else None, ()), "without_idle": lambda *_: next(gone),
        "_plainly": lambda *_: (None, None, ()), "smaller_models": lambda *_: [],
    }  # fmt: skip
    for name, stub in stubs.items():
        monkeypatch.setattr(discovering, name, stub)
    assert [step.dropped for step in discover([], BASE, candidates=[Tip()])] == [(), (), ("tip",)]


def test_what_was_dropped_is_not_added_again_and_again(monkeypatch):
    """A path that came back to a model that it had would go on in circles."""
    found = SimpleNamespace(rmse=1.0, held_out_rmse=1.0, verdict="missing", p_value=0.001)
    search = SimpleNamespace(run=lambda: SimpleNamespace(base_is_adequate=False), world=None)
    with_tip = ModelOnTheWay(("tip",), [*BASE, Tip()], search)
    stubs = {
        "prepared": lambda *_, **__: search, "concluded": lambda _: found, "worth_judging": lambda *_: [],
        "_next": lambda _, present, *__: (with_tip if len(present) == len(BASE) else None, ()),
        "without_idle": lambda here, *_: ModelOnTheWay((), list(BASE), search, dropped=("tip",)) if here is with_tip
        else None, "_plainly": lambda *_: (None, None, ()), "smaller_models": lambda *_: [],
    }  # fmt: skip
    for name, stub in stubs.items():
        monkeypatch.setattr(discovering, name, stub)
    steps = discover([], BASE, candidates=[Tip()])
    assert [(step.added, step.dropped) for step in steps] == [(("baseline",), ()), (("tip",), ()), ((), ("tip",))]


@pytest.mark.slow
def test_what_stood_in_for_four_effects_is_gone_in_the_end(tmp_path):
    """Rubber, a compliant rig, a tip and a constant friction are hidden behind erring instruments at once.

    A spring in parallel and conical ends are added on the way, and are dropped again.
    """
    hidden = {"bladder_neo_hookean": {"G": 3e5}, "series_compliance": {"k_s": 2e5}, "tip": {"k": 1.15},
              "constant_friction": {"F_c": 6.0}}  # fmt: skip
    truth = simulator.Truth(simulator.Muscle(), simulator.with_baseline(**hidden))
    recording = simulator.loops(
        truth, noise=simulator.COLOURED, seed=3, samples=400, pressures=(1e5, 2e5, 3e5, 4e5), speeds=(0.01,),
        instruments=simulator.LABORATORY,
    )  # fmt: skip
    errors = {"radius": 1e-4, "braid_angle": 0.01, "length": 1e-3}
    muscle = simulator.dataset(truth, [recording], "Four", simulator.COLOURED, 3, **errors)
    experiment = read_experiment(simulator.write(muscle, tmp_path / "four", say_accuracy=True))
    steps = discover([experiment], BASE)
    left = {name for step in steps for name in step.added if not any(name in later.dropped for later in steps)}
    assert left == {"baseline", *hidden}
    assert any(step.dropped and not step.added for step in steps)
    assert steps[-1].verdict in NOTHING_MISSING


# ------------------------------------------------------------------------ a larger model cannot do worse than one in it


class Trap(Pulling):
    """A force that vanishes at q = 0, and is least again near q = 3, where a search that begins there stays."""

    source = "a test"
    q: jax.Array = parameter(2.966, "1", "place", range=(0.0, 4.0))

    def force(self, muscle, state):
        """The pull, N."""
        return 100.0 * self.q * ((self.q - 3.0) ** 2 + 0.2) * state.contraction


@pytest.fixture(scope="module")
def small(tmp_path_factory):
    """Loops in which nothing is missing, and the fit of the model that made them."""
    experiment = read_experiment(write(tmp_path_factory.mktemp("d") / "small", loops(points=20, repeats=2)))
    return experiment, fit([experiment], BASE, starts=1)


def test_from_its_own_start_the_search_is_caught(small):
    experiment, smaller = small
    assert fit([experiment], [*BASE, Trap()], starts=1).cost > 2 * smaller.cost


@pytest.mark.parametrize("starts", [1, 2])
def test_a_fit_from_a_smaller_model_ends_no_higher(small, starts):
    experiment, smaller = small
    larger = fit([experiment], [*BASE, Trap()], start=smaller.values, starts=starts)
    assert larger.cost <= smaller.cost * (1 + 1e-9)
    assert larger.values["trap.q"] == pytest.approx(0.0, abs=0.01)


def test_add_begins_at_the_model_before(small, tmp_path):
    """The command, with a user's own effect that traps the search."""
    source = Path(__file__).read_text().split("class Trap")[1].split("@pytest")[0]
    heads = "import jax\nfrom mckibben_jax.effect import Pulling\nfrom mckibben_jax.parameter import parameter\n\n\n"
    own = tmp_path / "own.py"
    own.write_text(f"{heads}class Trap{source}")
    folder, out = write(tmp_path / "small", loops(points=20, repeats=2)), tmp_path / "r.json"
    order = ["add", folder, "trap", "--effect-file", own, "--starts", 1, "--json", out]
    done = CliRunner().invoke(main, [str(word) for word in order])
    assert done.exit_code == 0, done.output
    before, after = json.loads(out.read_text())["steps"]
    assert after["rmse_N"] == pytest.approx(before["rmse_N"], rel=0.02)
    assert (folder / "model.toml").exists()


def test_among_all_candidates_too(small):
    """Each of them is absent at some value of its parameters, which nobody has to name."""
    experiment, _ = small
    candidates = [Trap(), LinearSpring(), EndStop(), Tip(), ConicalEnds(), BladderMooneyRivlin()]
    world = universe([experiment], BASE, candidates)
    base = world.fit(frozenset(world.base), world.start)
    assert world.fit(world.with_added(["trap"]), base.vector, ["trap"]).cost > 2 * base.cost
    for name in world.candidates:
        assert fit_from_smaller(world, world.with_added([name]), base).cost <= base.cost * (1 + 1e-6), name


def test_a_friction_in_place_of_another_is_told_as_that(tmp_path):
    """Else a reader takes both for parts of the model, which has one."""
    load = lambda eps, pressure: surface(eps) * pressure / 1000.0  # noqa: E731  kN
    textile = lambda eps, p, sign: (20.0 * load(eps, p) ** 0.7 - 12.0 * load(eps, p)) * sign  # noqa: E731
    experiment = read_experiment(write(tmp_path / "set", loops(textile, points=40, repeats=2)))
    steps = discover([experiment], BASE, candidates=[TextileFriction(), Tip()])
    assert [(step.added, step.dropped) for step in steps] == [
        (("baseline",), ()),
        (("textile_friction",), ("coulomb_friction",)),
    ]


# -------------------------------------------------------------------------------------------------------- what is tried


@pytest.fixture
def found(small):
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
    """`_plainly` on a search in which these effects lead with this share; with it what was proposed."""
    asked = []

    def one(leads, share, adequate=False):
        glance = SimpleNamespace(base_is_adequate=adequate, world=None, base=None, fits={}, examiner=None)
        here = SimpleNamespace(search=SimpleNamespace(glance=lambda: glance), present=[])
        leading = leads and Leading(leads, share, 1.0, 4.0)
        monkeypatch.setattr(discovering, "leading_of", lambda *_: leading)
        monkeypatch.setattr(discovering, "concluded", lambda _: found)
        monkeypatch.setattr(discovering, "_next", lambda *given: (asked.append(given[2]), ("larger", ("tried",)))[1])
        return discovering._plainly(here, {}, None, RULES), asked

    return one


@pytest.mark.parametrize("share", [RULES.plain, 0.99])
def test_what_plainly_leads_is_added_before_two_at_once_are_looked_at(plainly, share):
    (said, larger, attempts), asked = plainly(("a",), share)
    assert asked == [[[("a",)]]]
    assert (said.verdict, said.explanations, said.nearest) == ("missing", (("a",),), ())
    assert (larger, attempts) == ("larger", ("tried",))


def test_of_a_class_that_plainly_leads_each_is_proposed(plainly):
    (said, _, _), asked = plainly(("a", "c"), 0.9)
    assert asked == [[[("a", "c"), ("a",), ("c",)]]]
    assert said.verdict == "one of"


def test_nothing_is_plain_where_nothing_is_missing_or_leads_or_leads_by_enough(plainly):
    for given in ((("a",), 0.99, True), (None, 0.0), (("a",), 0.99 * RULES.plain)):
        said, asked = plainly(*given)
        assert said == (None, None, ())
        assert asked == []


# ---------------------------------------------------------------------------------------------------------- the command


def test_every_step_is_printed_when_it_is_made_and_stands_in_the_result(tmp_path):
    folder = write(tmp_path / "spring", loops(lambda eps, *_: 400.0 * eps, repeats=2))
    out = tmp_path / "r.json"
    order = ["discover", folder, "--candidates", "linear_spring", "tip", "--json", out]
    done = CliRunner().invoke(main, [str(word) for word in order])
    assert done.exit_code == 0, done.output
    assert done.stdout.index("STEP      baseline") < done.stdout.index("STEP      + Spring in parallel (linear_spring)")
    assert done.stdout.index("STEP      + Spring in parallel (linear_spring)") < done.stdout.index("RESULT")
    steps = json.loads(out.read_text())["steps"]
    assert [step["effect"] for step in steps] == ["baseline", "linear_spring"]
    assert steps[1]["rmse_N"] == pytest.approx(0.3, rel=0.1)  # the noise that was put in
    for step in steps:
        assert all(attempt["why"] for attempt in step["not_kept"])
    assert "K" in (folder / "model.toml").read_text()


@pytest.mark.parametrize(
    ("adequate", "cost", "stays"),
    [(True, 2.0, True), (True, 3.0, False), (False, 2.0, False), (False, 0.5, True)],
    ids=["adequate", "far more error", "not adequate", "lower anyway"],
)
def test_an_adequate_model_stays_in_its_valley(adequate, cost, stays, monkeypatch):
    """The lower end of the two, of cost 1, may be one that instruments made."""
    there, other = SimpleNamespace(cost=cost), SimpleNamespace(cost=1.0)
    world = SimpleNamespace(
        with_added=lambda names: names, fit=lambda *_, **__: there, decided=lambda fit: fit, left_out=lambda *_: None,
        at=lambda *_: there,
    )  # fmt: skip
    monkeypatch.setattr(judging, "fit_from_smaller", lambda *_, **__: other)
    search = SimpleNamespace(examiner=SimpleNamespace(groups=None, left=lambda fit: fit.cost))
    found = next(ends_of(world, search, None, SimpleNamespace(fit=None), ("end_stop",), adequate))
    assert found.fit is (there if stays else other)


@pytest.mark.parametrize(("left", "stays"), [(0.5, True), (0.9, False)], ids=["far less", "hardly less"])
def test_an_adequate_model_stays_where_it_is_right_though_the_way_leads_down(left, stays, monkeypatch):
    """A search from there ends where less is left of the rows, but more beyond what instruments can make of them."""
    before, there, other = (SimpleNamespace(cost=cost) for cost in (2.0, 1.5, 1.0))
    world = SimpleNamespace(
        with_added=lambda names: names, fit=lambda *_, **__: there, decided=lambda fit: fit, left_out=lambda *_: None,
        at=lambda *_: before,
    )  # fmt: skip
    monkeypatch.setattr(judging, "fit_from_smaller", lambda *_, **__: other)
    beyond = {id(before): left, id(there): 1.0}
    search = SimpleNamespace(examiner=SimpleNamespace(groups=None, left=lambda fit: beyond[id(fit)]))
    ends = list(ends_of(world, search, None, SimpleNamespace(fit=None), ("end_stop",), True))
    assert [end.fit for end in ends] == ([before, there] if stays else [there])
    assert first_sound(ends, lambda end: ("too dear",) if end.fit is before else ()).fit is there
    assert first_sound(ends, lambda end: ("anything",)) is ends[0]
