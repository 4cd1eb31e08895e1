"""What an adequate model does not need any more is dropped in the end, and nothing else."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from small_muscle import loops, write
from studied import compared, spring_missing

from fitting.diagnosis import dropping
from fitting.diagnosis.course import ModelOnTheWay
from fitting.diagnosis.diagnose import prepared
from fitting.diagnosis.dropping import _does_as_well, not_needed, smaller_models, without_idle
from fitting.diagnosis.step_rules import RULES, Fitted
from fitting.recordings.experiment import read_experiment
from fitting.report.results import steps_result
from fitting.report.text.path import path_result
from fitting.report.text.stages import dropped_text, stage_text
from fitting.study.stages import Stage
from mckibben_jax.effect import name_of
from mckibben_jax.effects import ConstantFriction, CoulombFriction, EndStop, IdealCylinder, LinearSpring, Tip, Weight

SPRING = 400.0  # N for a contraction of 1
EFFECTS = [IdealCylinder(), CoulombFriction(), LinearSpring(), Tip()]
LIBRARY = [LinearSpring(), Tip(), EndStop(), Weight(), ConstantFriction()]


@pytest.fixture(scope="module")
def begin(tmp_path_factory):
    """Prepares the search of a model of loops in which a spring is hidden, and friction."""
    rows = loops(lambda eps, *_: SPRING * eps)
    experiment = read_experiment(write(tmp_path_factory.mktemp("spring") / "data", rows))
    return lambda present, values=None, confine=False: prepared(
        [experiment], present, LIBRARY, start=values, confine=confine
    )


def test_what_the_data_do_not_ask_for_goes_and_what_they_ask_for_stays(begin):
    """The tip correction was in the model before the spring came; then it is 1."""
    search = begin(EFFECTS)
    result = search.run()
    assert result.base_is_adequate
    here = ModelOnTheWay(("linear_spring",), EFFECTS, search)
    (step,) = smaller_models(here, True, ["tip", "linear_spring"], begin)
    assert step.dropped == ("tip",)
    assert step.added == ()
    assert step.diagnosis.verdict in ("nothing detectable", "within the instruments")
    # a spring of 400 N over the rest length of 250 mm, and the noise that was put in
    assert step.diagnosis.baseline.values["linear_spring.K"] == pytest.approx(SPRING / 0.25, rel=0.05)
    assert step.rmse == pytest.approx(0.3, rel=0.1)


def test_what_does_not_pay_beside_what_came_later_goes_and_what_pays_stays(begin):
    """Whatever the test says of the model."""
    search = begin(EFFECTS)
    left = without_idle(ModelOnTheWay(("linear_spring",), EFFECTS, search), ["tip", "linear_spring"], begin, RULES)
    assert left is not None
    assert left.dropped == ("tip",)
    assert [name_of(effect) for effect in left.present] == ["ideal_cylinder", "coulomb_friction", "linear_spring"]
    assert left.search.base.effects == search.base.effects - {"tip"}
    assert not left.freed  # nothing was confined
    assert without_idle(left, ["tip", "linear_spring"], begin, RULES) is None


def test_two_that_pay_only_together_stay(begin, monkeypatch):
    """Each lowers the held-out error by less than a step must, both together by more."""
    search = begin(EFFECTS)
    errors = {2: 1.0, 3: 1.1, 4: 1.2}  # by how many of the two are missing
    scatter = np.repeat([0.99, 1.01], 50)

    def stub(world, fit, _):
        missing = len({"tip", "linear_spring"} - fit.effects)
        rows = errors[2 + missing] * scatter
        return Fitted(world, fit, rows, np.repeat(np.arange(10), 10), lambda: rows)

    monkeypatch.setattr(dropping, "fitted", stub)
    monkeypatch.setattr(Fitted, "held_out_rmse", property(lambda self: float(np.sqrt(np.mean(self.left_out**2)))))
    model = ModelOnTheWay((), EFFECTS, search)
    left = without_idle(model, ["tip", "linear_spring"], begin, RULES)
    assert left is not None
    assert len(left.dropped) == 1


def test_sizes_are_free_again_once_what_denied_them_is_gone(begin):
    """They were confined on the way; of a muscle as it is stated a free fit denies none."""
    here = ModelOnTheWay(("linear_spring",), EFFECTS, begin(EFFECTS, None, True))
    assert here.search.base.confined
    left = without_idle(here, ["tip"], begin, RULES)
    assert left is not None
    assert left.freed
    assert not left.search.base.confined
    strict = replace(RULES, denied=0.0)  # every size is denied that is not exactly as it is stated
    held = without_idle(here, ["tip"], begin, strict)
    assert held is not None
    assert not held.freed
    assert held.search.base.confined


def test_a_model_that_lacks_something_keeps_all_it_has(begin):
    """Nothing is said of what it needs before it has what is missing."""
    effects = [IdealCylinder(), CoulombFriction(), Tip()]
    search = begin(effects)
    result = search.glance()
    assert not result.base_is_adequate
    assert not list(smaller_models(ModelOnTheWay(("tip",), effects, search), False, ["tip"], begin))


def test_what_the_data_ask_for_is_needed(begin):
    search = begin(EFFECTS[:3])
    search.fit_singles()
    assert not_needed(search, ["linear_spring"]) is None


@pytest.mark.parametrize(
    ("why", "p_value", "left", "as_well"),
    [(None, 0.2, 1.0, True), ("still missing", 0.2, 1.0, False), (None, 0.001, 1.0, False), (None, 0.2, 1.3, False)],
    ids=["as well", "the test rejects it", "what is left out is seen", "held-out runs are predicted worse"],
)
def test_each_reason_to_keep_an_effect_suffices(why, p_value, left, as_well):
    """Rows of size `left` on held-out runs, where the larger model leaves 1 in each of them."""
    smaller, whole = (SimpleNamespace(effects=frozenset(names)) for names in (("a",), ("a", "b")))
    scatter = np.random.default_rng(0).standard_normal(400)
    examiner = SimpleNamespace(
        adequacy=lambda *_: SimpleNamespace(why=why), against=lambda *_: p_value,
        flip_groups=SimpleNamespace(level=0.01), groups=np.repeat(np.arange(20), 20),
        beyond_instruments=lambda fit: scatter * (left if fit is smaller else 1.0),
    )  # fmt: skip
    search = SimpleNamespace(examiner=examiner, base=whole, alone=whole, fits={})
    assert _does_as_well(search, smaller) is as_well


@pytest.mark.parametrize("strained", [False, True])
def test_what_only_instruments_far_off_could_stand_in_for_is_kept(strained, monkeypatch):
    found = SimpleNamespace(is_strained=strained, rmse=1.0, held_out_rmse=1.0, verdict="within the instruments")
    smaller = SimpleNamespace(effects=frozenset({"ideal_cylinder"}), vector=np.zeros(0), confined=False)
    answers = iter([smaller, None])
    monkeypatch.setattr(dropping, "not_needed", lambda *_: next(answers))
    monkeypatch.setattr(dropping, "concluded", lambda _: found)
    adequate = SimpleNamespace(base_is_adequate=True)
    world = SimpleNamespace(layout=SimpleNamespace(names=()))
    search = SimpleNamespace(base=SimpleNamespace(effects=frozenset({"ideal_cylinder", "tip"})), world=world)
    next_search = SimpleNamespace(run=lambda: adequate)
    here = ModelOnTheWay(("tip",), [IdealCylinder(), Tip()], search)
    steps = list(smaller_models(here, True, ["tip"], lambda *_: next_search))
    assert [step.dropped for step in steps] == ([] if strained else [("tip",)])


def test_what_another_effect_needs_is_not_asked():
    """Nothing is fitted without it."""
    world = SimpleNamespace(lacking=lambda effects: ("rubber",) if "mullins" in effects else ())
    base = SimpleNamespace(effects=frozenset({"mullins", "bladder_neo_hookean"}))
    search = SimpleNamespace(world=world, base=base, examiner=SimpleNamespace(left=len))
    assert not_needed(search, ["bladder_neo_hookean"]) is None


def test_a_step_that_drops_is_told_as_one(tmp_path):
    _, c = compared(tmp_path / "set")
    d = spring_missing(c)
    stages = [
        Stage("baseline", 3.0, 3.1, "missing", diagnosis=d, p_value=0.001),
        Stage("", 1.0, 1.1, "missing", diagnosis=d, p_value=0.001, added=("tip",)),
        Stage("", 0.4, 0.5, "nothing detectable", diagnosis=d, p_value=0.2, added=("linear_spring",)),
        Stage("", 0.5, 0.5, "nothing detectable", diagnosis=d, p_value=0.1, dropped=("tip",)),
    ]
    last = steps_result(stages)["steps"][-1]
    assert (last["effect"], last["dropped"]) == ("", ["tip"])
    assert path_result(stages)["path"]["additions"] == 2
    assert "tip" in stage_text(stages[-1])
    assert "nothing in the data asks for" in dropped_text(stages[-1])[0]
    assert not any(dropped_text(stage) for stage in stages[:-1])
    exchange = Stage("", 0.3, 0.4, "missing", added=("tip",), dropped=("conical_ends",), exchanged=True)
    assert "explains the readings better than ⟦conical_ends⟧" in dropped_text(exchange)[0]
    gave_way = replace(exchange, exchanged=False)
    assert dropped_text(gave_way) == ["Beside ⟦tip⟧ nothing is left for ⟦conical_ends⟧, which gave way."]
    assert not dropped_text(replace(gave_way, dropped=("tip_pressure",)))  # of a rival of its family
    stages[1] = replace(stages[1], exchanged=True, dropped=("weight",))
    assert path_result(stages)["path"]["additions"] == 1  # an exchange adds nothing
    assert np.isfinite(last["rmse_N"])
