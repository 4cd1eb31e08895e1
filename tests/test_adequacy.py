"""Why a fitted set is not adequate, and what its test says of a candidate: rules against plain numbers."""

from types import SimpleNamespace

import numpy as np
import pytest

from fitting.diagnosis.adequacy import AdequacyTest
from fitting.diagnosis.estimates import untold
from fitting.diagnosis.examine import Examiner
from fitting.diagnosis.outcomes import Reason, Verdict, Why
from fitting.diagnosis.record import Diagnosis
from fitting.diagnosis.settings import DIAGNOSIS, VERDICT
from fitting.problem.estimate import Estimate
from fitting.report.text.reasons import why_text

ADDED = frozenset({"tip"})


def outcome(**what):
    """A test that finds nothing."""
    plain = {"by_size": False, "rejected": False, "p": 0.5, "rms_beyond": 1.0, "floor": 1.0}
    return SimpleNamespace(**plain | what)


def why(test, added=ADDED, base=20.0, gains=True, bettered=False, **fit):
    """The reason of an examiner whose base leaves so much (rms); None for none."""
    fitted = SimpleNamespace(**{"at_bound": ()} | fit)
    examiner = SimpleNamespace(
        settings=DIAGNOSIS,
        seen=None,
        base=SimpleNamespace(rows=np.full(50, base)),
        world=SimpleNamespace(contradicted=lambda fit: fitted.denied if hasattr(fit, "denied") else ()),
        _gains=lambda _, __: gains,
    )
    found = Examiner._why_not(examiner, added, fitted, test, bettered)
    return None if found is None else found.reason


@pytest.fixture(autouse=True)
def believed(monkeypatch):
    """No instrument is blamed here (`test_blamed.py` asks for that), and every value is told."""
    monkeypatch.setattr("fitting.diagnosis.examine.unbelieved", lambda *_: ())
    monkeypatch.setattr("fitting.diagnosis.examine.untold", lambda *_: ())


NAN = float("nan")


@pytest.mark.parametrize(
    ("creep", "hill", "vague"),
    [
        ({"K1": (5.0, 60.0), "tau": (2.0, 90.0)}, {"a": (3.0, 1.0)}, ("creep",)),
        ({"K1": (5.0, 40.0), "tau": (2.0, 90.0)}, {"a": (3.0, 1.0)}, ()),  # one value that is told a little is enough
        ({"K1": (5.0, 60.0), "tau": (2.0, NAN)}, {"a": (3.0, 1.0)}, ()),  # at its bound
        ({"K1": (5.0, 60.0), "tau": (0.0, 90.0)}, {"a": (-3.0, 80.0)}, ("creep", "hill")),
        ({}, {"a": (3.0, 1.0)}, ()),  # nothing that the readings see
    ],
)
def test_effects_of_which_nothing_is_known_are_no_part_of_an_explanation(monkeypatch, creep, hill, vague):
    """Each value beside its standard error; of a single effect the test itself says whether it is there."""
    sets = {"creep": creep, "hill": hill}
    as_known = lambda values: {name: Estimate(*each, "1") for name, each in values.items()}  # noqa: E731
    monkeypatch.setattr("fitting.diagnosis.estimates.estimates", lambda _, __, names: as_known(sets[names[0]]))
    world = SimpleNamespace(layout=SimpleNamespace(entry=lambda name: SimpleNamespace(size_of=abs)))
    assert untold(world, frozenset(sets), None, VERDICT.untold) == vague
    assert untold(world, frozenset({"creep"}), None, VERDICT.untold) == ()


def test_a_set_with_such_an_effect_is_not_adequate(monkeypatch):
    monkeypatch.setattr("fitting.diagnosis.examine.untold", lambda *_: ("creep",))
    assert why(outcome()) is Reason.UNTOLD
    assert why_text(Why(Reason.UNTOLD, ("creep",))) == "beside the others these data do not determine ⟦creep⟧"


@pytest.mark.parametrize(
    ("test", "how", "reason"),
    [
        (outcome(), {}, None),
        (outcome(by_size=True, rejected=True), {}, Reason.LARGE_MISFIT),
        (outcome(rejected=True), {}, Reason.STILL_MISSING),
        (outcome(rms_beyond=15.0, floor=1.0), {}, Reason.MOST_LEFT),
        (outcome(rms_beyond=15.0, floor=14.0), {}, None),  # of the size of the noise
        (outcome(rms_beyond=15.0, floor=1.0), {"base": 200.0}, None),  # little of what there was
        (outcome(rms_beyond=15.0, floor=1.0), {"added": frozenset()}, None),  # nothing was there before
        (outcome(), {"at_bound": ("tip.k", "muscle.radius")}, Reason.AT_BOUND),
        (outcome(), {"at_bound": ("muscle.radius",)}, None),
        (outcome(), {"denied": ("muscle.length",)}, Reason.CONTRADICTS),
        (outcome(), {"gains": False}, Reason.NO_GAIN),
        (outcome(), {"bettered": True}, Reason.BETTERED),
    ],
)
def test_a_set_is_adequate_unless_one_of_these_holds(test, how, reason):
    assert why(test, **how) == reason


def gains(monkeypatch, left_out, fall, added=ADDED, numbers=4):
    """Whether a set gains that leaves so much (rms) of each of four runs left out, where the base leaves 1 of each.

    `fall` is that of Schwarz's criterion; there are twenty candidates, and 40 readings for so many fitted `numbers`.
    """
    base, fit = (SimpleNamespace(rows=np.zeros(40), free=("p",) * count) for count in (3, numbers))
    groups = np.repeat(np.arange(4), 10)
    rows = {id(base): np.ones(40), id(fit): np.asarray(left_out)[groups]}
    monkeypatch.setattr("fitting.diagnosis.examine.free_of_noise", lambda ground: ground)
    monkeypatch.setattr("fitting.diagnosis.examine.criterion", lambda set_, _: fall if set_ is base else 0.0)
    examiner = SimpleNamespace(
        settings=DIAGNOSIS, base=base, alone=base, groups=groups, world=SimpleNamespace(candidates=range(20)),
        beyond_instruments=lambda set_: rows[id(set_)], ground=lambda _: None,
        has_plenty=lambda set_: Examiner.has_plenty(examiner, set_),
    )  # fmt: skip
    return Examiner._gains(examiner, added, fit)


@pytest.mark.parametrize(
    ("left_out", "fall", "gained"),
    [
        ((0.5, 0.5, 0.5, 0.6), -50.0, True),  # runs left out say so
        ((1.5, 1.5, 1.5, 1.6), 50.0, False),
        ((0.9, 0.9, 0.9, 1.3), 50.0, True),  # they do not decide, and readings are far likelier
        ((0.9, 0.9, 0.9, 1.3), 2 * np.log(100 * 20) - 0.1, False),
    ],
)
def test_a_set_gains_on_runs_left_out_or_where_they_do_not_decide_by_all_readings(monkeypatch, left_out, fall, gained):
    assert gains(monkeypatch, left_out, fall) is gained


def test_more_is_asked_of_the_likeliest_of_many_pairs(monkeypatch):
    undecided, fall = (0.9, 0.9, 0.9, 1.3), 2 * np.log(100 * 20) + 0.1
    assert gains(monkeypatch, undecided, fall)
    assert not gains(monkeypatch, undecided, fall, frozenset({"tip", "weight"}))
    assert gains(monkeypatch, undecided, 2 * np.log(100 * 190) + 0.1, frozenset({"tip", "weight"}))


def test_a_limit_is_the_amount_that_is_found_times_what_is_left_of_one():
    """Of two shapes the median; a limit beyond what a misfit of many times the noise shows anyway is that."""
    test = SimpleNamespace(
        p_effects=np.array([0.2, 0.1, 0.9]), detectable=np.array([3.0, 2.0, np.inf]), explained=np.full(3, 1e-3),
        left=np.array([0.8, 0.9, 0.5]), cosines=np.eye(3),
    )  # fmt: skip
    found = AdequacyTest(test, ("tip", "tip", "creep"), np.array([2.0, 4.0, 1.0]), 1.0, 100.0, many_times_noise=3.0)
    seen = found.of("tip")
    assert seen.limit == pytest.approx((6.0 + 8.0) / 2)
    assert seen.p_value == pytest.approx(0.1)
    assert seen.absorbed == pytest.approx(1 - 0.81)
    assert found.of("creep").limit == pytest.approx(np.sqrt(8) * 100.0)
    assert found.settings is VERDICT


@pytest.mark.parametrize(
    ("verdict", "beyond", "strained"),
    [
        (Verdict.WITHIN_INSTRUMENTS, True, True),
        (Verdict.WITHIN_INSTRUMENTS, False, False),
        *((verdict, True, False) for verdict in Verdict if verdict is not Verdict.WITHIN_INSTRUMENTS),
    ],
)
def test_a_verdict_is_strained_where_instruments_explain_it_only_far_beyond_their_accuracy(verdict, beyond, strained):
    given = SimpleNamespace(verdict=verdict, instruments=(SimpleNamespace(is_beyond=beyond),))
    assert Diagnosis.is_strained.fget(given) is strained


def test_few_readings_do_not_decide_for_many_numbers(monkeypatch):
    """Ten effects meet forty readings whatever these are; where runs left out say that a set helps, it does."""
    undecided, better = (0.9, 0.9, 0.9, 1.3), (0.5, 0.5, 0.5, 0.6)
    assert gains(monkeypatch, undecided, 50.0, numbers=4)
    assert not gains(monkeypatch, undecided, 50.0, numbers=5)
    assert gains(monkeypatch, better, 50.0, numbers=5)
