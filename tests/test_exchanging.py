"""What stands in for another effect gives its place to it, where that explains the readings far better."""

from types import SimpleNamespace

import numpy as np
import pytest
from hidden import simulator

from fitting.diagnosis.course import ModelOnTheWay
from fitting.diagnosis.diagnose import one_thread, prepared
from fitting.diagnosis.exchanging import exchanged, far_likelier
from fitting.diagnosis.settings import VERDICT
from fitting.diagnosis.step_rules import RULES
from fitting.recordings.experiment import read_experiment
from mckibben_jax.effect import name_of
from mckibben_jax.effects import (
    BladderNeoHookean,
    BladderOgden,
    ConicalEnds,
    CoulombFriction,
    IdealCylinder,
    LinearSpring,
    Tip,
)

BASE = (IdealCylinder(), CoulombFriction())
KNOWN = {name_of(e): e for e in (*BASE, Tip(), ConicalEnds(), BladderNeoHookean(), BladderOgden(), LinearSpring())}


@pytest.fixture(scope="module")
def experiment(tmp_path_factory):
    """Loops of a muscle with a tip correction and a rubber wall, by a laboratory whose instruments err."""
    hidden = {"bladder_neo_hookean": {"G": 3e5}, "tip": {"k": 1.15}}
    truth = simulator.Truth(simulator.Muscle(), simulator.with_baseline(**hidden))
    recording = simulator.loops(
        truth, noise=simulator.COLOURED, seed=2, samples=120, pressures=(1e5, 2e5, 3e5), speeds=(0.01,),
        instruments=simulator.LABORATORY,
    )  # fmt: skip
    stated = {"radius": 1e-4, "braid_angle": 0.01, "length": 1e-3}
    muscle = simulator.dataset(truth, [recording], "Tip", simulator.COLOURED, 2, **stated)
    return read_experiment(simulator.write(muscle, tmp_path_factory.mktemp("d") / "tip", say_accuracy=True))


def changed(experiment, *added):
    """The model that takes the place of one with these effects added to the baseline, and all that was begun."""
    begun = []

    def begin(present, values, confine):
        begun.append((sorted(map(name_of, present)), confine))
        return prepared([experiment], present, candidates=list(KNOWN.values()), start=values, confine=confine)

    present = [*BASE, *(KNOWN[name] for name in added)]
    search = prepared([experiment], present, candidates=list(KNOWN.values()), confine=True)
    with one_thread():
        search.fit_singles()
        return exchanged(ModelOnTheWay((), present, search), added, KNOWN, begin, RULES), begun


def test_a_stand_in_gives_its_place(experiment):
    """Cones are fitted where the tip corrects: half a newton more, and nothing that is only added removes them."""
    larger, begun = changed(experiment, "conical_ends", "bladder_neo_hookean")
    assert (larger.added, larger.dropped, larger.exchanged) == (("tip",), ("conical_ends",), True)
    there = ["bladder_neo_hookean", "coulomb_friction", "ideal_cylinder", "tip"]
    assert begun == [(there, True)]  # what was confined stays so
    assert sorted(map(name_of, larger.present)) == there
    assert larger.search.base.effects == {*there}


def test_what_is_right_keeps_its_place(experiment):
    """Also beside Ogden's rubber, which has one number more: that is an addition, and has to pay as one."""
    assert changed(experiment, "tip", "bladder_neo_hookean") == (None, [])


def test_only_what_was_added_is_exchanged(experiment):
    """The model that the user began with is the user's."""
    present = [*BASE, KNOWN["conical_ends"], KNOWN["bladder_neo_hookean"]]
    search = prepared([experiment], present, candidates=list(KNOWN.values()), confine=True)
    with one_thread():
        search.fit_singles()
        here = ModelOnTheWay(("bladder_neo_hookean",), present, search)
        assert exchanged(here, ["bladder_neo_hookean"], KNOWN, lambda *_: search, RULES) is None


@pytest.mark.parametrize(("times", "far"), [(2.0, True), (0.5, False)])
def test_far_likelier_is_so_many_times_likelier(times, far, monkeypatch):
    """Half a difference of Schwarz's criterion is the logarithm of how much likelier a model is."""
    whole, other = (SimpleNamespace(effects=frozenset([name])) for name in "ab")
    worth = {whole.effects: 10.0, other.effects: 10.0 - 2 * np.log(times * VERDICT.likelier)}
    monkeypatch.setattr("fitting.diagnosis.exchanging.criteria", lambda *_: worth)
    search = SimpleNamespace(alone=whole, examiner=None)
    assert far_likelier(search, [other], VERDICT) == ([other] if far else [])
