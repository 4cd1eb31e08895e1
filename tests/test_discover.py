"""A discovery: what leads is added, one effect at a time, no step raises an error, and what is unsound is not kept."""

import json
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from click.testing import CliRunner
from hidden import simulator
from small_muscle import ideal, loops, write

from fitting.cli.main import main
from fitting.diagnosis import discover as discovering
from fitting.diagnosis.course import ModelOnTheWay
from fitting.diagnosis.discover import discover
from fitting.diagnosis.findings import Fault, Objection
from fitting.diagnosis.outcomes import NOTHING_MISSING
from fitting.diagnosis.step_rules import RULES
from fitting.problem.varying import Varying
from fitting.recordings.experiment import read_experiment
from fitting.report.text.amounts import amount
from fitting.report.text.stages import fall_text, stage_text
from fitting.study.stages import Stage, begin_of_fall
from mckibben_jax.effect import name_of
from mckibben_jax.effects import (
    BladderMooneyRivlin,
    BladderNeoHookean,
    CoulombFriction,
    EndStop,
    IdealCylinder,
    LinearSpring,
    Tip,
    Weight,
)

DATA = Path(__file__).parents[1] / "data"
BASE = (IdealCylinder(), CoulombFriction())
SIZES = ("muscle.radius", "muscle.length")
CONFINED = SimpleNamespace(confined=True)  # a fit whose sizes are confined


# -------------------------------------------------------------------------------------------------------- measured data


@pytest.fixture(scope="module")
def denying(tmp_path_factory):
    """Steps on a muscle whose braid contracts 1.15 times as much as itself, with a ripple that is no effect of ours.

    Other sizes take the place of the one, so that nothing beside them shows it.
    """
    missing = lambda eps, pressure, _: ideal(eps, pressure) - ideal(1.15 * eps, pressure) + 2 * np.sin(300 * eps)  # noqa: E731
    folder = write(tmp_path_factory.mktemp("denying"), loops(missing))
    described = folder / "muscle.toml"
    described.write_text(described.read_text().replace('"250 mm"', '"250 +/- 1 mm"'))
    return discover([read_experiment(folder)], BASE, candidates=[Tip(), Weight(), LinearSpring()])


def test_sizes_that_stand_in_for_what_is_missing_are_confined(denying):
    free, confined, with_tip, *_ = denying
    assert free.diagnosis.baseline.values["muscle.radius"] > 8e-3 + 3 * 1e-4
    assert (confined.added, confined.held) == ((), ("muscle.length", "muscle.radius", "muscle.braid_angle"))
    assert confined.rmse > 3 * free.rmse
    assert with_tip.added == ("tip",)
    assert with_tip.rmse < confined.rmse / 3


@pytest.fixture
def denies(monkeypatch):
    """The steps of a discovery that begins at a model which denies its radius, as they are told, and where it ends."""

    def at(free, adequate=False, larger=None, errors=9.0, ends_well=None):
        """`adequate`: the first model lacks nothing; `ends_well`: nor do those after it (else as the first)."""
        well = adequate if ends_well is None else ends_well
        denied = lambda _, __, rules: (Objection(Fault.DENIES, "muscle.radius", errors),) * (errors > rules.denied)  # noqa: E731
        monkeypatch.setattr(discovering, "denials", denied)
        monkeypatch.setattr(discovering, "with_sizes_confined", lambda _, fit: fit)
        monkeypatch.setattr(discovering, "values_of", lambda *_: {})
        world = SimpleNamespace(from_stated=lambda _: {"muscle.radius": 9.0, "muscle.length": 0.0})
        told = list[tuple[str, ...]]()
        way = discovering._Way([], BASE, [], Varying(), 0, RULES, lambda step: told.append(step.held), None)
        search = lambda confined: SimpleNamespace(  # noqa: E731
            world=world, base=SimpleNamespace(confined=confined, free=free, vector=None), run=lambda: None
        )
        monkeypatch.setattr(way, "begin", lambda *_: search(True))
        found = SimpleNamespace(rmse=1.0, held_out_rmse=1.0, verdict="not in the library")
        lacks_nothing = lambda here: adequate if here.added == ("baseline",) else well  # noqa: E731
        larger_of = lambda here: (found, lacks_nothing(here), larger if here.held else None, ())  # noqa: E731
        monkeypatch.setattr(way, "_larger", larger_of)
        monkeypatch.setattr(way, "_beside", lambda *_: None)
        ended = way.forward(ModelOnTheWay(("baseline",), list(BASE), search(False)))
        assert told == [step.held for step in way.steps]
        return told, ended

    return at


def test_sizes_that_do_not_vary_are_not_confined(denies):
    """Somebody fixed the radius where the fit denies it."""
    for adequate in (False, True):
        told, (last, lacks_nothing) = denies(("muscle.length",), adequate, on_the_way([*BASE, Tip()], ("tip",)))
        assert (told, last.added, lacks_nothing) == ([()], ("baseline",), adequate)


@pytest.mark.parametrize(("errors", "confines"), [(4.0, False), (9.0, True)])
def test_a_model_that_lacks_nothing_may_deny_a_size_unless_that_is_absurd(denies, errors, confines):
    """Four errors are a caliper that was read wrong, nine hardly are."""
    told, (last, lacks_nothing) = denies(SIZES, True, on_the_way([*BASE, Tip()], ("tip",)), errors)
    assert told == ([(), SIZES, ()] if confines else [()])
    assert (last.added, lacks_nothing) == (("tip",) if confines else ("baseline",), True)


def test_a_complete_model_is_left_only_for_another_that_is_complete(denies):
    """Else the size was read wrong after all, and no effect makes up for it."""
    told, (last, lacks_nothing) = denies(SIZES, True, on_the_way([*BASE, Tip()], ("tip",)), ends_well=False)
    assert (told, last.added, lacks_nothing) == ([()], ("baseline",), True)


def test_a_diameter_that_was_read_wrong_adds_nothing_to_a_muscle_that_lacks_nothing(tmp_path):
    """Eight errors: with the radius as it was stated the model errs a hundred times as far, whatever is added."""
    folder = write(tmp_path / "small", loops())
    described = folder / "muscle.toml"
    described.write_text(described.read_text().replace('"8.0 +/- 0.1 mm"', '"7.2 +/- 0.1 mm"'))
    told = []
    steps = discover([read_experiment(folder)], BASE, candidates=[Tip(), Weight(), LinearSpring()], on_step=told.append)
    assert [step.added for step in steps] == [("baseline",)]
    assert list(steps) == told
    assert steps[0].diagnosis.verdict == "nothing detectable"


@pytest.mark.parametrize("adequate", [False, True])
def test_what_lacks_nothing_with_the_sizes_as_measured_is_kept_with_these(denies, adequate):
    """With nothing to add, and the muscle as it was measured."""
    told, (last, _) = denies(SIZES, adequate)
    assert (told, last.held) == (([(), SIZES], SIZES) if adequate else ([()], ()))


def test_what_can_be_added_to_the_muscle_as_it_was_measured_is_added(denies):
    with_tip = on_the_way([*BASE, Tip()], ("tip",))
    told, (last, _) = denies(("muscle.radius",), larger=with_tip)
    assert told == [(), ("muscle.radius",), ()]
    assert last is with_tip


def test_what_fell_is_the_error_in_the_muscle_that_was_measured(denying):
    """Not that of a muscle that nobody measured, which was small before anything was added."""
    stages = [Stage("" if k else s.effect, s.rmse, s.held_out_rmse, added=s.added * bool(k), held=s.held)
              for k, s in enumerate(denying)]  # fmt: skip
    assert begin_of_fall(stages) == 1
    assert stage_text(stages[1]) == "sizes of the muscle kept to what was measured"
    text = fall_text(stages, stages[-1].rmse, "N")
    assert f"fell from {amount(stages[1].rmse, 'N')} to {amount(stages[-1].rmse, 'N')}, with the sizes" in text
    assert f"that model erred by {amount(stages[0].rmse, 'N')}" in text
    alone = fall_text(stages[:2], stages[1].rmse, "N")
    assert alone.startswith("With the sizes of the muscle kept to what was measured, the error is")
    assert (
        fall_text(stages[1:], 1.0, "N") == f"The error fell from {amount(stages[1].rmse, 'N')} to {amount(1.0, 'N')}."
    )


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


@pytest.fixture
def course(monkeypatch):
    """`discover` from the baseline where nothing is computed: what happens is what is given, and else nothing."""

    def run(candidates, adequate=False, rules=RULES, **happens):
        found = SimpleNamespace(rmse=1.0, held_out_rmse=1.0, verdict="missing", p_value=0.001)
        search = SimpleNamespace(
            run=lambda: SimpleNamespace(base_is_adequate=adequate), world=None, base=SimpleNamespace(confined=True)
        )
        stubs = {
            "prepared": lambda *_, **__: search, "concluded": lambda _: found, "worth_judging": lambda *_: [],
            "plain_step": lambda *_: (None, None, ()), "without_idle": lambda *_: None, "exchanged": lambda *_: None,
            "smaller_models": lambda *_: [],
        }  # fmt: skip
        for name, stub in (stubs | happens).items():
            monkeypatch.setattr(discovering, name, stub)
        return discover([], BASE, candidates=candidates, rules=rules)

    return run


def on_the_way(present, added=(), **how):
    """A model on the way that nobody searches."""
    search = SimpleNamespace(
        run=lambda: SimpleNamespace(base_is_adequate=False), world=None, base=SimpleNamespace(confined=True)
    )
    return ModelOnTheWay(added, list(present), search, **how)


@pytest.mark.parametrize("adequate", [False, True])
def test_a_rejected_model_is_asked_for_what_does_not_pay_and_the_path_goes_on(adequate, course):
    """Tip, spring, then a weight; the first two go, and after them an end stop comes."""
    present, coming = list(BASE), [Tip(), LinearSpring(), Weight(), None, EndStop(), None]
    told = SimpleNamespace(
        run=lambda: SimpleNamespace(base_is_adequate=adequate), world=None, base=SimpleNamespace(confined=True)
    )

    def larger(*_):
        new = coming.pop(0)
        if new is None:
            return None, ()
        present.append(new)
        return ModelOnTheWay((name_of(new),), list(present), told), ()

    def smaller(here, added, *_):
        idle = ("tip", "linear_spring")
        if not {*idle} <= {*map(name_of, here.present)}:
            return None
        assert added == ["tip", "linear_spring", "weight"]
        present[:] = [effect for effect in here.present if name_of(effect) not in idle]
        return ModelOnTheWay((), list(present), told, dropped=idle)

    candidates = [Tip(), LinearSpring(), Weight(), EndStop()]
    steps = course(candidates, adequate, replace(RULES, steps=4), next_model=larger, without_idle=smaller)
    came = [(("baseline",), ()), (("tip",), ()), (("linear_spring",), ()), (("weight",), ())]
    last = [] if adequate else [((), ("tip", "linear_spring")), (("end_stop",), ())]
    assert [(step.added, step.dropped) for step in steps] == came + last


def test_a_model_from_which_something_was_dropped_is_not_asked_once_more(course):
    """Beside it as it is now each of the others may pay a little less than a step must, one after another."""
    coming = [on_the_way([*BASE, Tip()], ("tip",))]
    gone = iter([on_the_way(BASE, dropped=("tip",)), on_the_way([], dropped=("b",))])
    larger = lambda *_: (coming.pop() if coming else None, ())  # noqa: E731
    steps = course([Tip()], next_model=larger, without_idle=lambda *_: next(gone))
    assert [step.dropped for step in steps] == [(), (), ("tip",)]


def test_what_was_dropped_is_not_added_again_and_again(course):
    """A path that came back to a model that it had would go on in circles; what is known of it is not asked again."""
    with_tip, without = on_the_way([*BASE, Tip()], ("tip",)), on_the_way(BASE, dropped=("tip",))
    without.search.run = None
    steps = course(
        [Tip()],
        next_model=lambda _, present, *__: (with_tip if len(present) == len(BASE) else None, ()),
        without_idle=lambda here, *_: without if here is with_tip else None,
    )
    assert [(step.added, step.dropped) for step in steps] == [(("baseline",), ()), (("tip",), ()), ((), ("tip",))]


def test_where_what_plainly_leads_was_there_before_all_else_is_looked_at(course):
    """What was found of the model before would be said of this one."""
    with_tip, without = on_the_way([*BASE, Tip()], ("tip",)), on_the_way(BASE, dropped=("tip",))
    found, searched = SimpleNamespace(rmse=2.0, held_out_rmse=2.0, verdict="missing", p_value=0.001), []

    def looked_at(search, *_):
        searched.append(search)
        return None, ()

    steps = course(
        [Tip()],
        plain_step=lambda here, *_: (found, with_tip, ()) if len(here.present) == len(BASE) else (None, None, ()),
        next_model=looked_at,
        without_idle=lambda here, *_: without if here is with_tip else None,
    )
    assert [(step.added, step.dropped) for step in steps] == [(("baseline",), ()), (("tip",), ()), ((), ("tip",))]
    assert len(searched) == 2  # the model with the tip, and the baseline at the second time
    assert [step.rmse for step in steps] == [2.0, 1.0, 1.0]


@pytest.mark.parametrize(("longest", "count"), [(12, 3), (2, 2)])
def test_what_was_added_is_exchanged_in_the_end_and_never_back(longest, count, course):
    """Each of two could take the place of the other without an end."""
    with_tip, with_weight = on_the_way([*BASE, Tip()], ("tip",)), [*BASE, Weight()]
    asked = []

    def other(here, added, *given):
        asked.append(added)
        if here is with_tip:
            return on_the_way(with_weight, ("weight",), dropped=("tip",), exchanged=True)
        was_there = frozenset(map(name_of, with_tip.present)) in given[-1]
        return None if was_there else replace(with_tip, dropped=("weight",), exchanged=True)

    steps = course(
        [Tip(), Weight()],
        rules=replace(RULES, longest=longest),
        next_model=lambda _, present, *__: (with_tip if len(present) == len(BASE) else None, ()),
        exchanged=other,
    )
    assert [step.added for step in steps] == [("baseline",), ("tip",), ("weight",)][:count]
    assert [step.exchanged for step in steps] == [False, False, True][:count]
    assert asked == [["tip"], ["weight"]][: 2 * (count - 2)]


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
