"""Evidence that grows: fair bets on noise, no gain from what instruments could have made, and models that drop out."""

import json
from dataclasses import replace

import numpy as np
import pytest
from small_muscle import loops, write

from fitting.cli.main import main
from fitting.diagnosis.diagnose import prepared
from fitting.evidence.bets import Bets, bets_of
from fitting.evidence.growing import log_evidence, log_mean
from fitting.evidence.sessions import GrowingEvidence, Weighed, weigh
from fitting.evidence.settings import EVIDENCE
from fitting.recordings.experiment import read_experiment
from fitting.report.text.layout import console
from fitting.report.text.names import identifiers
from fitting.report.text.sessions import headline, next_text, odds, sessions_report, standing_text, verdict_text
from mckibben_jax.effects import CoulombFriction, ForceOffset, IdealCylinder, LinearSpring, Tip

BASE = (IdealCylinder(), CoulombFriction())
CANDIDATES = (Tip(), LinearSpring(), ForceOffset())
SESSIONS = 6
ONE = ("tip", 0)


def bets(scores, common=0.0, unseen=0.0):
    """A session of one candidate: scores of its loops, the error common to all sessions, what loops do not show."""
    scores = np.asarray(scores, float)[:, None]
    own = np.array([1.0 - unseen])
    return Bets((ONE,), scores, np.array([1.0]), own, np.array([common]))


def drawn(random, loops=10, common=0.0, heavy=False):
    """Scores of a right model: symmetric, of unequal size, and an error that is the same in all sessions."""
    size = np.sqrt(random.dirichlet(np.ones(loops)))
    noise = random.standard_t(3, loops) / np.sqrt(3) if heavy else random.standard_normal(loops)
    return np.sqrt(1 - common**2) * size * noise, size**2


# Fair bets ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("heavy", [False, True])
def test_nobody_wins_on_symmetric_noise(heavy):
    """The mean of the evidence is 1 at most, after one session and after three, whatever the noise."""
    random = np.random.default_rng(3)
    found = []
    for _ in range(4000):
        sessions = [bets(drawn(random, heavy=heavy)[0]) for _ in range(3)]
        found.append(np.exp(log_evidence(sessions)["tip"]))
    mean, error = np.mean(found, axis=0), np.std(found, axis=0) / np.sqrt(len(found))
    assert (mean < 1 + 3 * error).all()
    assert mean[0] > 0.8  # all is at stake


@pytest.mark.parametrize("paid", [True, False])
def test_what_instruments_err_by_alike_proves_nothing_however_often_it_is_recorded(paid):
    """One error in all sessions; who does not pay for it excludes right models in far more than 1 of 100."""
    random, common, excluded = np.random.default_rng(4), 0.7, 0
    for _ in range(1000):
        error, sessions = random.standard_normal(), []
        for _ in range(SESSIONS):
            scores, shares = drawn(random, common=common)
            sessions.append(bets(scores + common * error * shares, common * paid))
        excluded += np.exp(log_evidence(sessions)["tip"].max()) >= EVIDENCE.enough
    assert excluded <= 10 if paid else excluded > 40


def test_what_the_fitted_parameters_share_is_paid_for():
    """Groups whose own variances add up to half of that of their sum, as they do where a fit connects them.

    Two groups with variances of a quarter each, and fully alike: both scores are half of one normal number, over which
    the evidence is summed by Gauss and Hermite's rule.
    """
    places, weights = np.polynomial.hermite_e.hermegauss(60)
    won = lambda x, unseen: np.exp(log_evidence([bets([0.5 * x, 0.5 * x], unseen=unseen)])["tip"][0])  # noqa: E731
    mean = {unseen: weights @ [won(x, unseen) for x in places] / weights.sum() for unseen in (0.0, 0.5)}
    assert mean[0.5] < 1.0 < mean[0.0]


def test_an_effect_that_is_there_grows_without_end_and_in_any_order():
    sessions = [bets(np.full(10, size)) for size in (0.35, 0.2, 0.3)]
    there, back = log_evidence(sessions)["tip"], log_evidence(sessions[::-1])["tip"]
    assert (np.diff([0.0, *there]) > 0).all()
    assert there[-1] == pytest.approx(back[-1], rel=1e-12)
    other = log_evidence([bets(-session.scores[:, 0]) for session in sessions])["tip"]
    assert other == pytest.approx(there, rel=1e-12)  # of either sign


def test_sessions_that_contradict_each_other_prove_nothing():
    there = log_evidence([bets(np.full(10, 0.3)), bets(np.full(10, -0.3))])["tip"]
    assert there[1] < there[0]


def test_a_candidate_that_only_one_session_sees_neither_gains_nor_loses_in_the_others():
    blind = Bets((("creep", 0),), np.zeros((4, 1)), np.ones(1), np.ones(1), np.zeros(1))
    alone, both = log_evidence([bets(np.full(10, 0.3))]), log_evidence([bets(np.full(10, 0.3)), blind])
    assert both["tip"] == pytest.approx([alone["tip"][0]] * 2)
    assert both["creep"] == pytest.approx([0.0, 0.0], abs=1e-12)
    assert np.exp(log_mean(both)[1]) == pytest.approx((np.exp(alone["tip"][0]) + 1) / 2)


# Real rows ------------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    """Three sessions of a muscle with a spring that nobody knows of."""
    place = tmp_path_factory.mktemp("sessions")
    spring = lambda eps, *_: 40.0 * eps  # noqa: E731
    days = ("monday", "tuesday", "wednesday")
    return [
        write(place / day, loops(spring, seed=number, points=40, repeats=4), name=day)
        for number, day in enumerate(days)
    ]


@pytest.fixture(scope="module")
def found(folders):
    return weigh([read_experiment(folder) for folder in folders], BASE, candidates=CANDIDATES)


def test_scores_of_a_session_have_the_variances_that_are_stated(folders):
    """Noise, instruments and stated sizes drawn anew: the scatter of whole scores, and that of their loops."""
    search = prepared([read_experiment(folders[0])], BASE, CANDIDATES)
    random, base, sums, squares = np.random.default_rng(6), search.base, [], []
    instruments = search.examiner.errors(base).columns
    for _ in range(200):
        rows = random.standard_normal(len(base.rows)) + instruments @ random.standard_normal(instruments.shape[1])
        stated = random.standard_normal(len(base.prior_rows))
        it = bets_of(search.examiner, replace(base, rows=rows, prior_rows=stated))
        sums.append(it.scores.sum(axis=0))
        squares.append(np.sum(it.scores**2, axis=0))
    assert np.var(sums, axis=0) == pytest.approx(it.variance, rel=0.3)
    assert np.mean(squares, axis=0) == pytest.approx(it.own, rel=0.15)
    assert (it.own < 0.99 * it.variance).any()  # what is fitted to all loops


def test_a_missing_spring_is_the_one_that_stands(found):
    assert found.is_lacking
    assert [each.added for each in found.standing] == [("linear_spring",)]
    assert found.as_it_is.excluded_by() is not None
    assert found.as_it_is.points_at == "linear_spring"
    assert found.singles[0].rmse < found.as_it_is.rmse


def test_a_muscle_that_lacks_nothing_keeps_its_model(tmp_path):
    clean = [read_experiment(write(tmp_path / str(k), loops(seed=10 + k, points=40), name=str(k))) for k in range(3)]
    found = weigh(clean, BASE, candidates=CANDIDATES)
    assert not found.is_lacking
    assert max(found.as_it_is.evidence) < 30


# Words ----------------------------------------------------------------------------------------------------------------


def made(*singles, as_it_is=(2.0, 1000.0)):
    weighed = [Weighed((name,), evidence, 0.5, "tip") for name, evidence in singles]
    return GrowingEvidence(("monday", "tuesday"), (), Weighed((), as_it_is, 1.0, "tip"), tuple(weighed))


def test_the_answer_in_words():
    one, two = ("tip", (1.0, 0.5)), ("creep", (1.0, 0.4))
    out = ("weight", (400.0, 3.0))
    assert identifiers(headline(made(one, out))) == "Missing after 2 sessions: tip."
    assert identifiers(headline(made(one, two))) == "Missing after 2 sessions: one of tip, creep."
    assert "no single effect" in headline(made(out))
    assert headline(made(one, as_it_is=(2.0, 8.0))) == "Nothing is shown to be missing after 2 sessions."
    assert "enough since session 2 (tuesday)" in verdict_text(made(one))
    assert "8 to 1, and 300 to 1 is asked for" in verdict_text(made(one, as_it_is=(2.0, 8.0)))
    assert "nothing else. 1 other effect excluded for good" in standing_text(made(one, out))
    assert standing_text(made(one, as_it_is=(2.0, 8.0))) == ""
    assert "mckibben plan" in next_text(made(one, two))
    assert "'mckibben plan mon 'a b'' names" in next_text(made(one, two), ("mon", "a b"))
    assert "'mckibben add mon tip'" in next_text(made(one, out), ("mon",))
    assert "Record another session" in next_text(made(one, as_it_is=(2.0, 8.0)))
    assert "mckibben discover" in next_text(made(out))


def test_what_was_excluded_once_stays_excluded():
    assert made(("weight", (400.0, 3.0))).standing == ()


@pytest.mark.parametrize(("value", "words"), [
    (1e-5, "below 0.01"), (0.123, "0.12"), (12.345, "12"), (4321.0, "4,320"), (2e6, "over a million"),
])  # fmt: skip
def test_odds_as_people_read_them(value, words):
    assert odds(value) == words


def test_the_command_on_three_sessions(folders, tmp_path, capsys):
    out, page = tmp_path / "evidence.json", tmp_path / "evidence.html"
    words = ["evidence", *map(str, folders), "--baseline", "--candidates", "tip", "linear_spring", "force_offset"]
    main([*words, "--json", str(out), "--html", str(page)], standalone_mode=False)
    said = capsys.readouterr().out
    assert "Spring in parallel (linear_spring)" in said
    result = json.loads(out.read_text())
    assert result["sessions"] == ["monday", "tuesday", "wednesday"]
    assert result["standing"] == [["linear_spring"]]
    assert result["something_missing"] is True
    assert len(result["models"][0]["evidence"]) == 3
    assert "<svg" in page.read_text()


def test_it_holds_in_a_narrow_terminal(found, capsys):
    for shown in sessions_report(found):
        console().print(shown)
    assert max(map(len, capsys.readouterr().out.splitlines())) <= 110
