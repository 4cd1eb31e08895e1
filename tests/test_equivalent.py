"""Which single effect leads, which explanations are dropped for a better one: on trials that are only rows."""

from types import SimpleNamespace

import numpy as np
import pytest

from fitting.diagnosis.equivalent import (
    _clearly_by_group,
    best_predicting,
    leading_of,
    plainly_there,
    plausible,
    simplest,
    unrivalled,
)
from fitting.diagnosis.examine import AdequacyTest
from fitting.least_squares import held_out

GROUPS = np.repeat(np.arange(10), 30)
RANDOM = np.random.default_rng(4)
NOISE, WAVE, OTHER = RANDOM.normal(size=300), np.sin(np.arange(300)), np.cos(np.arange(300))
LEFT = {
    "": NOISE + 4 * WAVE,
    "a": NOISE + 0.001 * WAVE,
    "b": NOISE + 0.002 * OTHER,
    "c": NOISE + 2 * WAVE,
    "d": NOISE + 4 * WAVE,
}
FREE = {"": 0, "a": 1, "b": 1, "c": 1, "d": 1}


class World:
    """Families, and which set follows the predictions of which."""

    def __init__(self, families, follows, denies):
        names = "abcd"
        self.effects = {name: SimpleNamespace(family=families.get(name)) for name in names}
        self.follows, self.denies = follows, denies
        self.settings = SimpleNamespace(workers=2)

    def mimicking(self, smaller):
        def fit(effects, vector, decide=True):
            return SimpleNamespace(rows=NOISE * (0.01 if (effects, smaller.key) in self.follows else 1))

        return SimpleNamespace(fit=fit)

    def contradicted(self, fit):
        return ("muscle.length",) if fit.key in self.denies else ()

    def rmse(self, rows):
        return float(np.sqrt(np.mean(rows**2)))


@pytest.fixture(autouse=True)
def confined(monkeypatch):
    """What is fitted in place of a trial that denies a stated size, by its key; unless said, the trial itself."""
    instead = {}
    monkeypatch.setattr("fitting.diagnosis.equivalent.believable", lambda _, fit: instead.get(fit.key, fit))
    return instead


class Examiner:
    """Left-out rows as they are, and rivals that are seen in what a set leaves."""

    groups = GROUPS

    def __init__(self, seen=()):
        self.seen = set(seen)

    def left_out(self, fit):
        return fit.rows

    beyond_instruments = left_out  # these instruments are exact

    def as_fitted(self, _, fit):
        return fit

    def against(self, fit, rivals):
        return min(0.001 if (fit.key, "".join(sorted(other))) in self.seen else 1.0 for other, _ in rivals)


def fit(key, free=None, ends=()):
    count = FREE[key] if free is None else free
    return SimpleNamespace(
        key=key, effects=key, vector=None, rows=LEFT[key], at_bound=tuple(f"{one}.A" for one in ends),
        free=tuple(map(str, range(count))), cost=float(np.sum(LEFT[key] ** 2)),
    )  # fmt: skip


def led(keys, families=(), follows=(), denies=(), **own):
    fits = {frozenset(key): own.get(key, fit(key)) for key in keys}
    return leading_of(World(dict(families), set(follows), set(denies)), fit(""), fits, Examiner())


def test_the_effect_that_lowers_the_error_by_clearly_more_leads():
    """With its share of the squared error, and the error of the next best."""
    found = led("acd")
    size = lambda key: np.sqrt(np.mean(LEFT[key] ** 2))  # noqa: E731
    assert found.effects == ("a",)
    assert found.share == pytest.approx(1 - (size("a") / size("")) ** 2)
    assert found.held_out_rmse == pytest.approx(size("a"))
    assert found.runner_up_rmse == pytest.approx(size("c"))
    assert led("a").runner_up_rmse == pytest.approx(size(""))


def test_equals_lead_together_only_if_they_are_of_one_kind():
    """Rivals of one family, or one of them the special case of the other."""
    assert led("abc") is None
    assert set(led("abc", families={"a": "rubber", "b": "rubber"}).effects) == {"a", "b"}
    assert led("abc", families={"a": "rubber", "b": "friction"}) is None
    assert led("abc", families={"a": "rubber"}) is None
    wider = {"b": fit("b", free=2)}
    assert led("abc", follows={("b", "a")}, **wider).effects == ("a",)
    assert led("abc", follows={("a", "b")}, **wider) is None


def test_nothing_leads_where_nothing_helps():
    assert led("d") is None


@pytest.mark.parametrize(
    ("keys", "share", "there"), [("abc", 0.5, "ab"), ("abc", 0.9999, ""), ("acd", 0.5, "a"), ("d", 0.0, "")]
)
def test_what_does_as_well_as_the_best_is_plainly_there_whatever_its_kind(keys, share, there):
    """c is clearly behind them, and d does not help."""
    fits = {frozenset(key): fit(key) for key in keys}
    found = plainly_there(World({"a": "rubber"}, set(), set()), fit(""), fits, Examiner(), share)
    assert set(found) == {frozenset(key) for key in there}


def test_what_is_at_its_bound_or_denied_leads_only_where_all_is():
    bound = {"a": fit("a", ends="a")}
    assert led("acd", **bound).effects == ("c",)
    assert led("acd", denies=("a",)).effects == ("c",)
    assert led("a", **bound).effects == ("a",)
    world = World({}, set(), {"c"})
    assert plausible(world, frozenset("a"), fit("a", ends="b"))  # what was there before may stand at its end
    assert not plausible(world, frozenset("a"), fit("a", ends="a"))
    assert not plausible(world, frozenset("c"), fit("c"))


def test_what_denies_a_size_leads_if_it_does_so_in_a_believable_muscle_too(confined):
    """b stands for a with the sizes confined: it denies nothing, and leaves the least all the same."""
    confined["a"] = fit("b")
    assert led("acd", denies=("a",)).effects == ("a",)
    confined["a"] = fit("d")
    assert led("acd", denies=("a",)).effects == ("c",)


def test_a_lead_is_clear_where_it_is_so_in_every_group():
    """One group that errs a hundred times more than the others hides a difference of sums, not one of logarithms."""
    better, group = np.ones(100), np.repeat(np.arange(5), 20)
    worse = 3 * better * np.where(group == 0, 100.0, 1.0)
    better = better * np.where(group == 0, 100.0, 1.0)
    fall, error = held_out.difference(worse, better, group)
    assert not fall > 2 * error
    assert _clearly_by_group(worse, better, group, 2.0)
    assert not _clearly_by_group(better, worse, group, 2.0)


def test_explanations_that_contain_a_simpler_one_are_dropped_and_exact_likes_are_a_class():
    fits = {frozenset("a"): fit("a"), frozenset("b"): fit("b"), frozenset("c"): fit("c", free=3)}
    adequate = list(fits)
    follows = {("b", "a"), ("a", "b"), ("c", "a"), ("c", "b")}
    named, classes, wider = simplest(World({}, follows, ()), adequate, fits, noise=1.0)
    assert set(named) == {frozenset("a"), frozenset("b")}
    assert [set(members) for members in classes] == [{("a",), ("b",)}]
    assert wider == {frozenset("c"): named[0]}
    alone = simplest(World({}, set(), ()), adequate, fits, noise=1.0)
    assert (set(alone[0]), alone[1], alone[2]) == (set(adequate), (), {})


def test_what_foretells_clearly_worse_is_dropped():
    fits = {frozenset(key): fit(key) for key in "abc"}
    assert best_predicting(list(fits), fits, Examiner()) == [frozenset("a"), frozenset("b")]
    assert best_predicting([], {}, Examiner()) == []


def test_a_set_in_whose_residual_a_rival_is_seen_is_dropped_unless_each_is():
    fits = {frozenset(key): fit(key) for key in "ab"}
    both, (a, b) = list(fits), fits
    assert unrivalled(both, fits, Examiner([("a", "b")])) == [b]
    assert unrivalled(both, fits, Examiner([("b", "a")])) == [a]
    assert unrivalled(both, fits, Examiner([("a", "b"), ("b", "a")])) == both
    assert unrivalled(both, fits, Examiner()) == both
    assert unrivalled(both[:1], fits, Examiner([("a", "b")])) == [a]


def adequacy(**changes):
    """Two shapes of effect a, one of b, which is nearly alike, and one of c, which the model takes up nearly whole."""
    test = SimpleNamespace(
        left=np.array([0.5, 0.8, 0.9, 0.1]), explained=np.array([3.0, 1.0, 2.0, 1.0]),
        detectable=np.array([2.0, 0.5, np.inf, 1.0]), p_effects=np.array([0.2, 0.03, 0.5, 0.9]),
        cosines=np.array([[1, 0.5, 0.7, 0.1], [0.5, 1, -0.95, 0.2], [0.7, -0.95, 1, 0.3], [0.1, 0.2, 0.3, 1]]),
    )  # fmt: skip
    given = {"test": test, "columns": ("a", "a", "b", "c"), "rms_columns": np.array([1.0, 2.0, 3.0, 4.0])}
    return AdequacyTest(**(given | {"noise_rms": 1.0, "noise": 0.5} | changes))


def test_what_is_said_of_one_candidate_is_said_over_its_shapes():
    """The least p, the middle limit, the largest share that is left, and what is alike, the most alike first."""
    found = adequacy().of("a")
    assert found.p_value == pytest.approx(0.03)
    assert found.limit == pytest.approx(np.median([2.0 * 1.0, 0.5 * 2.0]))
    assert found.absorbed == pytest.approx(1 - 0.8**2)
    assert found.similar == {"b": pytest.approx(0.95)}
    unseen = adequacy().of(
        "b"
    )  # never by flips; by the bases where it is as large as they need, and many times the noise
    assert unseen.limit == pytest.approx(max(np.sqrt(2.5**2 - 1) * 0.5, 2.0 * 3.0))
    assert adequacy(noise=99.0).of("b").limit == pytest.approx(np.sqrt(2.5**2 - 1) * 99.0)
    assert adequacy().of("c").limit is None
    assert adequacy().of("c").similar == {}
    absent = adequacy().of("d")
    assert (absent.limit, absent.similar) == (None, {})
    assert np.isnan(absent.p_value)


def test_likes_are_listed_the_most_alike_first():
    cosines = np.array([[1.0, 0.92, -0.99], [0.92, 1.0, 0.9], [-0.99, 0.9, 1.0]])
    test = SimpleNamespace(
        left=np.ones(3), explained=np.ones(3), detectable=np.ones(3), p_effects=np.ones(3), cosines=cosines
    )
    found = adequacy(test=test, columns=("a", "b", "c"), rms_columns=np.ones(3)).of("a")
    assert list(found.similar) == ["c", "b"]
