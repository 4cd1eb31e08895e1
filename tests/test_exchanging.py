"""What stands in for another effect gives its place to it, where that explains the readings far better."""

from types import SimpleNamespace

import numpy as np
import pytest
from hidden import simulator

from fitting.diagnosis.course import ModelOnTheWay
from fitting.diagnosis.diagnose import one_thread, prepared
from fitting.diagnosis.exchanging import _in_place_of_one, _is_sound, exchanged, likelier
from fitting.diagnosis.settings import VERDICT
from fitting.diagnosis.step_rules import RULES
from fitting.problem.varying import Varying
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


def changed(experiment, *added, adequate=False, seen=()):
    """The model that takes the place of one with these effects added to the baseline, and all that was begun."""
    begun = []

    def begin(present, values, confine):
        begun.append((sorted(map(name_of, present)), confine))
        return prepared([experiment], present, candidates=list(KNOWN.values()), start=values, confine=confine)

    present = [*BASE, *(KNOWN[name] for name in added)]
    search = prepared([experiment], present, candidates=list(KNOWN.values()), confine=True)
    with one_thread():
        search.fit_singles()
        return exchanged(ModelOnTheWay((), present, search), added, KNOWN, begin, RULES, adequate, seen), begun


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


def test_a_rubber_of_two_numbers_becomes_one_of_a_single_number(experiment):
    """It stood in for the tip, and was the first of them that led."""
    larger, _ = changed(experiment, "tip", "bladder_ogden")
    assert (larger.added, larger.dropped) == (("bladder_neo_hookean",), ("bladder_ogden",))


def test_a_set_that_was_on_the_way_is_not_taken_again(experiment):
    there = frozenset({"bladder_neo_hookean", "coulomb_friction", "ideal_cylinder", "tip"})
    assert changed(experiment, "conical_ends", "bladder_neo_hookean", seen=[there]) == (None, [])


@pytest.mark.parametrize(("held", "some"), [((), True), (("bladder_neo_hookean.G",), False)])
def test_a_parameter_that_is_held_is_none_that_may_be_spent(experiment, held, some):
    """In the place of a rubber whose modulus is held every other effect would free a parameter more."""
    present, varying = [*BASE, KNOWN["bladder_neo_hookean"]], Varying(held, (), ())
    search = prepared([experiment], present, candidates=list(KNOWN.values()), varying=varying, confine=True)
    with one_thread():
        search.fit_singles()
        fits = _in_place_of_one(search, ["bladder_neo_hookean"])
    assert bool(fits) is some
    assert all(len(fit.free) <= len(search.alone.free) for fit in fits)


GROUPS = np.arange(4)  # one reading each


def worse_by(mean, error):
    """Rows (4,) whose mean square is above 1 by so much, with such a standard error over four groups."""
    return np.sqrt(1 + mean + error * np.sqrt(3) * np.array([1, -1, 1, -1]))


@pytest.fixture
def sound(monkeypatch):
    """Whether a model may take the place of one with three parameters: by how much it predicts held-out runs worse.

    Each is a pair of that and its standard error, beyond instruments and as they were read; of one group of readings
    the error is not known.
    """

    def asked(parameters, beyond, as_read=(0.0, 0.1), groups=GROUPS):
        rows = [(np.ones(4), np.ones(4)), (worse_by(*beyond), worse_by(*as_read))]
        before, after = (
            SimpleNamespace(
                fit=SimpleNamespace(free="abc"[:count]), groups=groups, beyond=lambda of=of: of[0], left_out=of[1]
            )
            for count, of in zip((3, parameters), rows, strict=True)
        )
        monkeypatch.setattr("fitting.diagnosis.exchanging.unsound", lambda *_: ())
        return _is_sound(before, after, RULES)

    return asked


@pytest.mark.parametrize(("parameters", "groups", "is_sound"), [(2, 4, True), (2, 1, False), (3, 4, False)])
def test_one_group_that_is_held_out_excuses_nothing(parameters, groups, is_sound, sound):
    """Its error is without end, and a model with fewer parameters would pass whatever it predicts."""
    assert sound(parameters, (0.1, 0.2), groups=GROUPS % groups) is is_sound


@pytest.mark.parametrize(
    ("as_read", "groups", "is_sound"),
    [((-0.4, 0.1), 4, True), ((0.3, 0.2), 4, True), ((0.5, 0.2), 4, False), ((0.5, 0.2), 1, True)],
)
def test_what_predicts_readings_clearly_worse_takes_no_place(as_read, groups, is_sound, sound):
    """300 gf became 422 gf where a lag took the place of stress softening, and the lag was dropped again."""
    assert sound(3, (-0.1, 0.2), as_read, GROUPS % groups) is is_sound


def test_what_lacks_nothing_is_not_exchanged_for_what_does(experiment, monkeypatch):
    monkeypatch.setattr("fitting.diagnosis.examine.Examiner.adequacy", lambda *_, **__: SimpleNamespace(why="p"))
    assert changed(experiment, "tip", "bladder_ogden", adequate=True) == (None, [])
    assert changed(experiment, "tip", "bladder_ogden")[0].added == ("bladder_neo_hookean",)


def test_only_what_was_added_is_exchanged(experiment):
    """The model that the user began with is the user's."""
    present = [*BASE, KNOWN["conical_ends"], KNOWN["bladder_neo_hookean"]]
    search = prepared([experiment], present, candidates=list(KNOWN.values()), confine=True)
    with one_thread():
        search.fit_singles()
        here = ModelOnTheWay(("bladder_neo_hookean",), present, search)
        assert exchanged(here, ["bladder_neo_hookean"], KNOWN, lambda *_: search, RULES) is None


@pytest.mark.parametrize(
    ("times", "parameters", "taken"),
    [(2.0, 3, True), (0.5, 3, False), (0.5, 2, True), (0.9 / VERDICT.likelier, 2, False)],
    ids=["far likelier", "likelier", "likelier and simpler", "simpler alone"],
)
def test_an_exchange_must_be_far_likelier_or_save_a_parameter(times, parameters, taken, monkeypatch):
    """Half a difference of Schwarz's criterion is the logarithm of how much likelier a model is."""
    whole, other = (
        SimpleNamespace(effects=frozenset([name]), free="abc"[:count]) for name, count in (("a", 3), ("b", parameters))
    )
    worth = {whole.effects: 10.0, other.effects: 10.0 - 2 * np.log(times * VERDICT.likelier)}
    monkeypatch.setattr("fitting.diagnosis.exchanging.criteria", lambda *_: worth)
    search = SimpleNamespace(alone=whole, examiner=None)
    assert likelier(search, [other], VERDICT) == ([other] if taken else [])
