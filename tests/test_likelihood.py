"""Of several sets that stand, the likeliest is named first, and none that is out of the question beside it.

One effect more may make the readings so much likelier that no smaller set can be the whole of it.
"""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import scipy.linalg

from fitting.diagnosis.candidate_fit import CandidateFit
from fitting.diagnosis.likelihood import criteria, likeliest, outdone
from fitting.diagnosis.schwarz import criterion
from fitting.diagnosis.settings import VERDICT

COUNT = 200
RNG = np.random.default_rng(4)
NOISE = RNG.standard_normal(COUNT)


def fit(rows, slopes, prior_rows=(), prior_slopes=None):
    """A fitted set with these rows (model minus measured over sigma) and slopes."""
    free = tuple(f"p{k}" for k in range(slopes.shape[1]))
    stated = np.zeros((0, len(free))) if prior_slopes is None else prior_slopes
    return CandidateFit(frozenset(), np.zeros(len(free)), free, rows, slopes, np.asarray(prior_rows), stated, ())


def plain(columns):
    return columns


def test_it_is_schwarz_of_ordinary_least_squares():
    slopes = RNG.standard_normal((COUNT, 3))
    left = scipy.linalg.lstsq(slopes, NOISE)[1]
    wanted = COUNT * np.log(left / COUNT) + 3 * np.log(COUNT)
    assert criterion(fit(NOISE, slopes), plain) == pytest.approx(wanted, rel=1e-12)
    moved = NOISE + slopes @ [3.0, -1.0, 0.5]  # not at its optimum: it is moved there
    assert criterion(fit(moved, slopes), plain) == pytest.approx(wanted, rel=1e-12)


def test_the_scale_of_a_parameter_and_of_the_noise_changes_no_difference():
    few, many = RNG.standard_normal((COUNT, 1)), RNG.standard_normal((COUNT, 4))
    difference = criterion(fit(NOISE, few), plain) - criterion(fit(NOISE, many), plain)
    again = criterion(fit(3 * NOISE, 5 * few), plain) - criterion(fit(3 * NOISE, 0.1 * many), plain)
    assert again == pytest.approx(difference, rel=1e-9)


def test_a_size_that_was_measured_holds_a_parameter_back():
    slopes = RNG.standard_normal((COUNT, 1))
    rows = NOISE + 2.0 * slopes[:, 0]
    free = criterion(fit(rows, slopes), plain)
    held = criterion(fit(rows, slopes, [0.0], np.array([[1e4]])), plain)  # known to a ten-thousandth of a step
    alone = COUNT * np.log(np.mean(rows**2)) + np.log(COUNT)
    assert free < held
    assert held == pytest.approx(alone, rel=0.01)


def test_a_stated_size_that_is_denied_costs_its_square():
    slopes = RNG.standard_normal((COUNT, 1))
    kept, denied = (fit(NOISE, slopes, [apart], np.zeros((1, 1))) for apart in (0.0, 3.0))
    assert criterion(denied, plain) - criterion(kept, plain) == pytest.approx(9.0)


def test_noise_that_remembers_is_taken_out_before_two_sets_are_compared():
    """A slow wave in noise that is itself slow is no evidence; to who takes readings for independent it is."""
    memory = 0.95
    slow = np.zeros(COUNT)
    for k in range(1, COUNT):
        slow[k] = memory * slow[k - 1] + NOISE[k]

    def innovations(columns):
        out = np.array(columns, float)
        out[1:] -= memory * np.asarray(columns)[:-1]
        return out

    wave = np.cos(np.pi * np.arange(COUNT) / COUNT)[:, None]
    nothing = np.zeros((COUNT, 0))
    asked = lambda free: criterion(fit(slow, nothing), free) - criterion(fit(slow, wave), free)  # noqa: E731
    assert asked(plain) > 20 > 2 > asked(innovations)


def sets_and_examiner(misfits):
    """Sets that each leave noise and this much of a wave that their parameters do not know."""
    wave = np.sin(np.arange(COUNT) / 7.0)
    fits = {frozenset([name]): fit(NOISE + size * wave, np.ones((COUNT, 1))) for name, size in misfits.items()}
    ground = SimpleNamespace(instruments=lambda: plain, without_noise=plain)
    left = lambda mine: float(np.sum(mine.rows**2))  # noqa: E731
    world = SimpleNamespace(candidates=tuple("abcdefghij"))
    return fits, SimpleNamespace(left=left, ground=lambda _: ground, world=world)


def test_the_likeliest_is_first_and_what_is_out_of_the_question_is_gone():
    fits, examiner = sets_and_examiner({"far": 0.6, "near": 0.15, "true": 0.0})
    assert likeliest(list(fits), fits, examiner) == [frozenset(["true"]), frozenset(["near"])]
    assert likeliest([frozenset(["far"])], fits, examiner) == [frozenset(["far"])]
    assert likeliest([], fits, examiner) == []


def test_a_set_goes_where_another_is_more_than_a_hundred_times_likelier():
    fits, examiner = sets_and_examiner({"true": 0.0, "other": 0.35})
    better, worse = (criterion(each, plain) for each in fits.values())
    times = np.exp((worse - better) / 2)
    assert VERDICT.likelier == 100
    kept = [len(likeliest(list(fits), fits, examiner, replace(VERDICT, likelier=times * by))) for by in (0.99, 1.01)]
    assert kept == [1, 2]


def test_a_set_is_outdone_where_one_more_effect_is_likelier_by_more_than_the_number_of_effects():
    """A hundred times ten candidates: one of ten that do nothing fits better by chance than any one of them."""
    fits, examiner = sets_and_examiner({"one": 0.42, "two": 0.0})
    one, two = fits
    times = np.exp((criterion(fits[one], plain) - criterion(fits[two], plain)) / 2)
    asked = lambda by: outdone([one], [two], fits, examiner, replace(VERDICT, likelier=by * times / 10))  # noqa: E731
    assert [asked(0.99), asked(1.01)] == [True, False]
    assert not outdone([two], [one], fits, examiner)
    assert not outdone([], [two], fits, examiner)
    assert not outdone([one], [], fits, examiner)


def test_the_best_of_either_size_decides():
    fits, examiner = sets_and_examiner({"far": 0.9, "near": 0.1, "worse": 0.8, "true": 0.0})
    far, near, worse, true = fits
    assert outdone([far], [worse, true], fits, examiner)
    assert not outdone([far, near], [worse, true], fits, examiner)


def test_the_noise_is_that_of_the_smaller_of_two_sets_that_leave_as_little():
    """A number more takes a little of the noise away; it does not make its set the best guess at what noise is."""
    fits, examiner = sets_and_examiner({"small": 0.0, "large": 0.0})
    small, large = fits
    fits[large] = fit(0.999 * NOISE, RNG.standard_normal((COUNT, 4)))
    asked = []
    ground = examiner.ground(None)
    criteria(
        [large, small], fits, SimpleNamespace(left=examiner.left, ground=lambda mine: asked.append(mine) or ground)
    )
    assert asked == [fits[small]]
    fits[large] = fit(0.8 * NOISE, fits[large].slopes)
    criteria(
        [large, small], fits, SimpleNamespace(left=examiner.left, ground=lambda mine: asked.append(mine) or ground)
    )
    assert asked[1:] == [fits[large]]
