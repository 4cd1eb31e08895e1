"""Sets whose members hide each other, and runs that cannot differ as much as a fit needs them to."""

from dataclasses import dataclass, replace
from itertools import pairwise
from types import SimpleNamespace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hidden.instruments import EVERY_KIND
from hidden.simulator import NOISES, write
from hidden.study.protocols import PROTOCOLS
from hidden.study.sizes import base_of, hiding
from small_muscle import loops
from small_muscle import write as write_small

from fitting.diagnosis.diagnose import concluded, diagnose, searched
from fitting.diagnosis.linear_look import LinearLook
from fitting.diagnosis.next_sets import simpler
from fitting.diagnosis.outcomes import Reason, Why
from fitting.diagnosis.search import Search
from fitting.diagnosis.settings import DIAGNOSIS, SEARCH
from fitting.recordings.experiment import read_experiment
from fitting.report.pictures.effect_bars import effect_bars
from fitting.report.text.evidence import named_sets, sort_evidence
from fitting.report.text.names import identifiers
from fitting.report.text.reasons import notes_of, why_text
from mckibben_jax.effect import Pulling, name_of
from mckibben_jax.effects import LIBRARY, CoulombFriction, IdealCylinder, SupplyLag
from mckibben_jax.parameter import parameter

NAMES = """bladder_neo_hookean tip tip_pressure conical_ends strand_stretch radial_gap end_stop linear_spring weight
    textile_friction hertz_friction constant_friction viscous_damping force_gain force_offset pressure_offset"""
BASE = [IdealCylinder(), CoulombFriction()]
CANDIDATES = [kind() for kind in LIBRARY if name_of(kind) in NAMES.split()]  # few: each must be compiled
THREE = {"hertz_friction": {"f_s": 0.242}, "tip": {"k": 1.0216}, "weight": {"m": 0.612}}
RIVAL = {"hertz_friction": {"f_s": 0.19}}  # of the friction that is in the model


@dataclass(frozen=True)
class SimpleAdequacy:
    """The test of a set that stands."""

    why: Why | None = None


class Late(Pulling):
    """A user's law that has no value below a contraction that these data do not reach."""

    source = "a user's own file"
    A: jax.Array = parameter(10.0, "N", "amplitude", range=(0.0, 100.0))
    begin: jax.Array = parameter(0.5, "1", "contraction where it begins", range=(0.4, 0.6))

    def force(self, muscle, state):
        """Not a number before it begins, N."""
        return self.A * jnp.sqrt(state.contraction - self.begin)


def measured(folder, protocol, noise, hidden, seed=3):
    truth = hiding(base_of(hidden), hidden)
    return read_experiment(write(PROTOCOLS[protocol].data(truth, NOISES[noise], seed), folder / "data"))


@pytest.fixture(scope="module")
def told():
    """What was said of the search of `three`, in order: words and the share that is done."""
    return []


@pytest.fixture(scope="module")
def three(tmp_path_factory, told):
    experiment = measured(tmp_path_factory.mktemp("three"), "no repeats", "force", THREE)
    return searched([experiment], BASE, candidates=CANDIDATES, progress=lambda *said: told.append(said))


def test_three_effects_are_found_though_the_third_stands_behind_the_others(three):
    assert frozenset(["weight"]) not in Search.resumed(three).best(1)[:3]
    assert frozenset(THREE) in three.adequate
    found = concluded(three)
    assert tuple(sorted(THREE)) in found.explanations
    at_fault = [(names, one) for names in found.explanations for one in names if three.world.effects[one].misreads]
    assert [(each.among, each.effect) for each in found.blamed] == at_fault
    assert any("triples refitted" in note for note in notes_of(found))
    assert {tuple(sorted(e.effects)) for e in named_sets(found)} == set(found.explanations)
    assert "+ hertz_friction + tip + weight" in effect_bars(found, 0.6, "N", identifiers)


def test_progress_goes_forward_level_by_level(three, told):
    words, shares = zip(*told, strict=True)
    assert words == (
        "baseline", "one effect at a time", "pairs", "testing sets of 1", "triples", "testing sets of 2",
        "testing sets of 3",
    )  # fmt: skip
    assert shares[0] == 0
    assert all(before < after <= 1 for before, after in pairwise(shares))


def test_a_linear_look_beside_a_set_foretells_its_refit(three):
    pair = frozenset(["hertz_friction", "tip"])
    promised = Search.resumed(three).look.one_more(pair)
    assert min(promised, key=promised.__getitem__) - pair <= {"weight", "force_offset"}  # at held pressures one force
    triple, left = frozenset(THREE), three.examiner.left
    fall = left(three.fits[pair]) - left(three.fits[triple])
    assert left(three.fits[pair]) - promised[triple] == pytest.approx(fall, rel=0.3)
    assert fall > 50  # in variances of a reading


def search_with_a_pair_that_stands(three):
    """The search of `three`, were the flips blind to what two of the three effects leave."""
    pair, search = frozenset(["hertz_friction", "tip"]), Search.resumed(three)
    search.adequate, search.adequacy_tests[pair] = [pair], replace(three.adequacy_tests[pair], why=None)
    return search, pair


def test_a_pair_that_stands_goes_where_a_third_effect_makes_the_readings_far_likelier(three):
    search, pair = search_with_a_pair_that_stands(three)
    assert search.is_outdone(2)
    assert search.not_outdone([[], [pair], [frozenset(THREE)]]) == [frozenset(THREE)]
    assert search.adequacy_tests[pair].why == Why(Reason.LESS_LIKELY)


def test_a_pair_that_stands_goes_where_another_pair_that_does_not_is_far_likelier(three):
    """The other is not the truth either, so the truth is larger than both."""
    search = Search.resumed(three)
    search.adequacy_tests |= three.adequacy_tests
    best = search.best(2)[0]
    search.adequate = [best]
    search.drop_surpassed(2)
    assert search.adequate == [best]
    poor = max((added for added in three.adequacy_tests if len(added) == 2), key=search.left)
    search.adequate = [poor, frozenset(THREE)]
    search.drop_surpassed(2)
    assert search.adequate == [frozenset(THREE)]
    assert search.adequacy_tests[poor].why == Why(Reason.LESS_LIKELY)


def test_what_stands_stays_where_no_larger_set_is_far_likelier(three):
    search, pair = search_with_a_pair_that_stands(three)
    assert search.not_outdone([[], [pair], []]) == [pair]
    idle = max((added for added in three.fits if pair < added), key=search.left)
    assert search.not_outdone([[pair], [idle]]) == [pair]
    assert search.adequacy_tests[pair].why is None
    search.adequate = [frozenset(THREE)]
    assert not search.is_outdone(3)
    assert max(map(len, search.fits)) == 3  # no four effects are looked for


def test_the_search_goes_on_from_what_stands_to_what_is_far_likelier(three):
    """Of a single effect that stands, pairs that do not, and triples that do, only these are named."""
    standing = {1: [frozenset(["tip"])], 2: [], 3: [frozenset(THREE)]}
    search = Search.resumed(three)
    search.adequacy_tests[frozenset(["tip"])] = SimpleAdequacy()
    search.level = lambda size, _: search.adequate.extend(standing[size])
    search.is_outdone = lambda size: size == 1
    search.levels()
    assert search.adequate == [frozenset(THREE)]
    standing[3], search.adequate = [], []
    search.levels()
    assert search.adequate == [frozenset(["tip"])]


def test_friction_of_another_law_is_named_though_two_runs_could_differ_in_theirs(tmp_path):
    """Two pressures, one run each: with a friction 11 % apart from run to run Coulomb's law would do as well."""
    search = searched([measured(tmp_path, "poor", "pressure", RIVAL)], BASE, candidates=CANDIDATES)
    assert search.missing_effect_test.rejected
    assert concluded(search).explanations == (("hertz_friction",),)
    assert frozenset() not in search.fits  # beside one that does, nothing else is looked for


def test_what_pressure_and_speed_do_together_is_no_difference_between_runs(tmp_path):
    """A stiffness in proportion to both: every run has its own, and nothing but its size says that it is no chance."""
    rows = []
    for number, speed in enumerate((1, 2, 4)):
        stiffer = loops(lambda eps, p, _, v=speed: 5 * p / 1e5 * v * eps, seed=number)
        rows += [(run + 3 * number, time / speed, *more) for run, time, *more in stiffer]
    search = searched([read_experiment(write_small(tmp_path, rows))], BASE, candidates=CANDIDATES)
    assert search.missing_effect_test.rejected
    assert concluded(search).verdict == "not in the library"


def test_a_set_promises_what_its_effects_leave_together():
    """The least sum of squares beside the base's parameters and what instruments can make, against numpy."""
    random = np.random.default_rng(5)
    base = SimpleNamespace(rows=random.normal(size=40), slopes=random.normal(size=(40, 2)))
    gain = np.linalg.qr(random.normal(size=(40, 1)))[0]
    examiner = SimpleNamespace(without_instruments=lambda columns: columns - gain @ (gain.T @ columns))
    changes = [random.normal(size=40) for _ in "ab"]
    fits = {frozenset([name]): SimpleNamespace(rows=base.rows + made) for name, made in zip("ab", changes, strict=True)}
    columns = np.column_stack([*changes, base.slopes, gain])
    assert LinearLook(examiner, fits, base).together(("a", "b")) == pytest.approx(
        np.linalg.lstsq(columns, base.rows, rcond=None)[1][0]
    )


def test_sets_come_in_the_order_of_what_they_leave_beyond_the_instruments():
    """A gain within its accuracy lowers the plain error more than a small lag, and sixteen such sets hid the lag."""
    costs = {"gain": (10.0, 5.0), "lag": (30.0, 1.0), "zero": (9.0, 6.0)}
    search = Search(None, None, SimpleNamespace(settings=DIAGNOSIS), None, lambda *_: None)
    search.fits.update({frozenset([name]): SimpleNamespace(cost=c, left=left) for name, (c, left) in costs.items()})
    search.examiner.left = lambda fit: fit.left
    assert [min(added) for added in search.best(1)] == ["lag", "gain", "zero"]


def test_a_small_effect_is_found_under_all_errors_of_instruments(tmp_path):
    truth = hiding(base_of({}), {"pressure_drop": {"tau": 0.006}})
    data = PROTOCOLS["rich"].data(truth, NOISES["ar"], 5, EVERY_KIND["laboratory"])
    found = diagnose([read_experiment(write(data, tmp_path / "data", say_accuracy=True))], BASE)
    assert found.explanations == (("pressure_drop",),)
    assert sort_evidence(found)[0][0].name == "pressure_drop"  # though others lower the plain error by more
    named = found.effects["pressure_drop"]
    assert any(e.rmse < named.rmse for e in found.effects.values() if e.rmse)
    assert named.unexplained < 0.7 * found.unexplained


def test_an_explanation_is_bettered_by_one_more_effect_that_takes_most_of_the_rest():
    """By a set with that effect and no other, and not by one that leaves the explanation out."""
    costs = {"a": 100.0, "b": 100.0, "ab": 80.0, "bc": 1.0, "abc": 1.0}
    fits = {frozenset(key): SimpleNamespace(cost=cost) for key, cost in costs.items()}
    search = SimpleNamespace(fits=fits, settings=SEARCH, base=SimpleNamespace(cost=200.0))
    search.examiner = SimpleNamespace(left=lambda fit: fit.cost)
    bettered = {key: Search.bettered(search, frozenset(key)) for key in ("", "a", "b", "ab")}
    assert bettered == {"": False, "a": False, "b": True, "ab": True}


def test_what_gives_no_number_or_moves_nothing_is_set_aside(tmp_path):
    known = [kind() for kind in LIBRARY if name_of(kind) in ("hertz_friction", "weight", "tip")]
    experiment = measured(tmp_path, "no repeats", "white", RIVAL)
    search = searched([experiment], BASE, candidates=[*known, Late(), SupplyLag()])
    found = concluded(search)
    assert found.explanations == (("hertz_friction",),)
    assert frozenset(["supply_lag"]) in search.fits  # it could be fitted, and does nothing at a held pressure
    assert Search.resumed(search).promising(2, SEARCH.best_tripled)
    assert not any("supply_lag" in pair for pair in Search.resumed(search).promising(2, SEARCH.best_tripled))
    assert why_text(found.effects["late"].why) == "cannot be tested: gives no number on these data"


def test_a_simpler_relative_is_tried_in_the_place_of_each_member():
    """Of one family the one with fewer numbers; never one with as many, or of no family."""
    families = {"mooney": "rubber", "hookean": "rubber", "thin": "rubber", "tip": None, "cones": None}
    numbers = {"mooney": ("a", "b"), "hookean": ("g",), "thin": ("a", "b"), "tip": ("k", "l"), "cones": ("k",)}
    world = SimpleNamespace(
        candidates=tuple(families),
        effects={name: SimpleNamespace(family=family) for name, family in families.items()},
        layout=SimpleNamespace(of_effect=lambda name: numbers[name]),
    )
    sets = [frozenset(("mooney", "tip")), frozenset(("thin", "tip")), frozenset(("thin", "cones"))]
    assert simpler(world, sets) == [frozenset(("hookean", "tip")), frozenset(("hookean", "cones"))]
    assert simpler(world, [frozenset(("hookean", "tip")), frozenset(("tip", "cones"))]) == []
