"""What an adequate model does not need any more is dropped in the end, and nothing else."""

from types import SimpleNamespace

import numpy as np
import pytest
from small_muscle import loops, write
from studied import compared, spring_missing

from fitting.diagnosis.course import ModelOnTheWay
from fitting.diagnosis.diagnose import prepared
from fitting.diagnosis.dropping import not_needed, smaller_models
from fitting.recordings.experiment import read_experiment
from fitting.report.results import steps_result
from fitting.report.text.path import path_result
from fitting.report.text.stages import dropped_text, stage_text
from fitting.study.stages import Stage
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
    (step,) = smaller_models(here, result, ["tip", "linear_spring"], begin)
    assert step.dropped == ("tip",)
    assert step.added == ()
    assert step.diagnosis.verdict in ("nothing detectable", "within the instruments")
    # a spring of 400 N over the rest length of 250 mm, and the noise that was put in
    assert step.diagnosis.baseline.values["linear_spring.K"] == pytest.approx(SPRING / 0.25, rel=0.05)
    assert step.rmse == pytest.approx(0.3, rel=0.1)


def test_a_model_that_lacks_something_keeps_all_it_has(begin):
    """Nothing is said of what it needs before it has what is missing."""
    effects = [IdealCylinder(), CoulombFriction(), Tip()]
    search = begin(effects)
    result = search.glance()
    assert not result.base_is_adequate
    assert not list(smaller_models(ModelOnTheWay(("tip",), effects, search), result, ["tip"], begin))


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
    assert np.isfinite(last["rmse_N"])
