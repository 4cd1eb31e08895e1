"""What a gate says of one fitted set: when it rejects, and what it reads off the columns, against plain algebra."""

from dataclasses import replace

import numpy as np
import pytest
from test_flips import autoregression, samples, words

from fitting.diagnosis import omnibus, working_noise
from fitting.diagnosis.between_runs import Nuisance
from fitting.diagnosis.flip_groups import flip_groups, numbered
from fitting.diagnosis.missing_effect import Ground, Whitened, missing_effect_test
from fitting.diagnosis.omnibus import Basis
from fitting.diagnosis.settings import FLIP_TEST, NOISE
from fitting.least_squares import held_out

WHITE = working_noise.Noise(1.0, np.zeros(len(NOISE.memories)))
RUNS, EACH = 10, 40
SAMPLES = samples()
ROWS = np.random.default_rng(1).normal(size=len(SAMPLES))
SLOPES = np.stack([SAMPLES.pressure / 1e5, SAMPLES.branch], axis=1)
COLUMNS = np.stack([SAMPLES.branch * SAMPLES.rate, SAMPLES.contraction, SAMPLES.pressure * SAMPLES.contraction], axis=1)


@pytest.fixture(scope="module")
def verdict():
    """White noise in five runs, tested for three candidates beside two parameters that all runs share."""
    same = Nuisance(SLOPES, np.zeros(0), np.zeros((0, 2)), np.full(2, -1))
    ground = Ground(SAMPLES, flip_groups(SAMPLES, 0.0), omnibus.basis(SAMPLES), WHITE, 0)
    return missing_effect_test(ROWS, same, same, COLUMNS, ground)


def test_sizes_and_angles_are_those_of_least_squares(verdict):
    left = COLUMNS - SLOPES @ np.linalg.lstsq(SLOPES, COLUMNS, rcond=None)[0]
    size = np.linalg.norm(left, axis=0)
    np.testing.assert_allclose(verdict.left, size / np.linalg.norm(COLUMNS, axis=0))
    np.testing.assert_allclose(verdict.cosines, (left / size).T @ (left / size), atol=1e-12)
    assert verdict.rms == pytest.approx(np.sqrt(np.mean(ROWS**2)))
    known = np.hstack([SLOPES, omnibus.basis(SAMPLES).whole])
    around = ROWS - known @ np.linalg.lstsq(known, ROWS, rcond=1e-10)[0]
    free = len(ROWS) - np.linalg.matrix_rank(known, 1e-6)
    assert verdict.floor == pytest.approx(np.sqrt(np.sum(around**2) / free), rel=1e-3)


@pytest.mark.parametrize(
    ("rms", "ratio_p", "rejected"), [(2.6, 1e-4, True), (2.6, 0.01, False), (2.4, 1e-4, False), (2.4, 0.01, False)]
)
def test_many_times_the_noise_is_a_misfit_if_the_bases_see_it(verdict, rms, ratio_p, rejected):
    """Though flips of few units are blind to it."""
    blind = replace(verdict, p=0.5, p_runs=1.0, between_runs=0.0, floor=1.0, inside=1.0)
    assert replace(blind, rms=rms, ratio_p=ratio_p).rejected is rejected


@pytest.mark.parametrize(
    ("p", "p_runs", "spread", "excused"),
    [(0.001, 0.5, 0.3, True), (0.001, 0.005, 0.3, False), (0.001, 0.5, 0.05, False), (0.5, 0.5, 0.3, False)],
)
def test_runs_differ_where_their_loops_are_alike_and_whole_runs_say_nothing(verdict, p, p_runs, spread, excused):
    found = replace(verdict, level=0.01, p=p, p_runs=p_runs, spread=spread, rms=1.0, inside=1.0)
    assert found.runs_differ is excused


@pytest.mark.parametrize("memory", [0.0, 0.8])
def test_blocks_are_counted_and_stay_within_a_branch(memory):
    few = SAMPLES.where((SAMPLES.run == 0) & (SAMPLES.half < 4))
    groups = flip_groups(few, memory)
    assert not groups.trusted
    assert words(groups).startswith(f"signs of {groups.count} blocks")
    assert groups.count == len(np.unique(groups.number))
    assert all(len(np.unique(few.half[groups.number == one])) == 1 for one in range(groups.count))


def test_an_effect_that_differs_from_run_to_run_is_taken_for_a_difference():
    """And one that all runs share is not, of whatever size; nor a little of the first."""
    random = np.random.default_rng(3)
    run, up = np.repeat(np.arange(RUNS), EACH), np.tile([1.0, -1.0], RUNS * EACH // 2)
    own = 20 * np.stack([np.where(run == one, up, 0.0) for one in range(RUNS)], axis=1)
    rows = random.normal(size=(RUNS * EACH, 1)) + own @ random.normal(size=(RUNS, 1)) * 0.05
    changing, common = up * np.where(run % 2, 1.0, -1.0), up * np.tile(np.linspace(-1, 1, EACH), RUNS)
    candidates = np.stack([changing, common, changing], axis=1)
    nothing = np.zeros((len(rows), 0))
    white = Whitened(rows, up[:, None], own, np.zeros(RUNS, int), candidates, Basis(nothing, nothing))
    np.testing.assert_array_equal(white.taken_for_difference(np.array([20.0, 20.0, 0.01])), [True, False, False])
    np.testing.assert_array_equal(white.taken_for_difference(np.array([np.inf] * 3)), [False] * 3)
    shared = replace(white, j_between_runs=nothing, group=np.zeros(0, int))
    np.testing.assert_array_equal(shared.taken_for_difference(np.full(3, 20.0)), [False] * 3)


@pytest.mark.parametrize(("count", "groups"), [(4, 4), (30, 30), (31, 10), (47, 10)])
def test_runs_are_left_out_one_by_one_up_to_thirty(count, groups):
    """Then in ten groups; a run is never split."""
    run = np.repeat(np.arange(count), 8)
    zero = np.zeros(len(run))
    left = held_out.folds(replace(SAMPLES.where(np.arange(len(run)) % len(SAMPLES)), run=run, contraction=zero))
    assert len(np.unique(left)) == groups
    assert all(len(np.unique(left[run == one])) == 1 for one in range(count))


def test_few_points_are_left_out_by_contraction():
    """Of a map every point is a run of its own: those of one contraction go together."""
    contraction = np.repeat([0.0, 0.05, 0.1, 0.15], 3)
    points = replace(SAMPLES.where(np.arange(12)), run=np.arange(12), contraction=contraction)
    np.testing.assert_array_equal(held_out.folds(points), np.repeat([0, 1, 2, 3], 3))


def test_slow_noise_is_told_from_white_at_the_lags_that_runs_have():
    """Memory of 0.9 beside as much white noise, in runs of very different lengths."""
    random = np.random.default_rng(5)
    run = np.repeat([0, 1, 2], [6000, 300, 5])
    position = np.concatenate([*map(np.arange, (6000, 300, 5))])
    some = replace(SAMPLES.where(np.zeros(len(run), int)), run=run, half=run, position=position)
    slow = np.concatenate([autoregression(0.9, count, random) for count in (6000, 300, 5)])
    noise = working_noise.noise_from(slow + random.normal(size=len(run)), np.ones((len(run), 1)), some)
    assert noise.white == pytest.approx(1.0, abs=0.1)
    assert noise.shares.sum() == pytest.approx(1.0, abs=0.15)
    assert noise.memory == pytest.approx(0.45, abs=0.06)


def test_an_amount_as_large_as_its_limit_is_found_four_times_in_five():
    """By the whole gate, in noise drawn anew; half as much is missed more often than not."""
    same = Nuisance(SLOPES, np.zeros(0), np.zeros((0, 2)), np.full(2, -1))
    ground = Ground(SAMPLES, flip_groups(SAMPLES, 0.0), omnibus.basis(SAMPLES), WHITE, 0)
    limit = missing_effect_test(ROWS, same, same, COLUMNS, ground, limits=True).detectable[0]
    random = np.random.default_rng(2)

    def found(amount):
        rows = random.normal(size=len(SAMPLES)) + amount * COLUMNS[:, 0]
        return missing_effect_test(rows, same, same, COLUMNS, ground).rejected

    assert np.mean([found(0.5 * limit) for _ in range(25)]) < 0.5
    assert 0.6 <= np.mean([found(limit) for _ in range(35)]) <= 0.98


def test_no_p_is_smaller_than_one_of_all_flips():
    """Of runs that differ by a hundred times what is allowed, neither: zero would say more than can be known."""
    run = numbered(SAMPLES.run)
    own = np.stack([np.where(run == one, SAMPLES.branch, 0.0) for one in range(run.max() + 1)], axis=1)
    same = Nuisance(SLOPES, np.zeros(0), np.zeros((0, 2)), np.full(2, -1))
    count = own.shape[1]
    apart = Nuisance(
        np.hstack([SLOPES, own]), np.zeros(count), np.hstack([np.zeros((count, 2)), np.eye(count)]),
        np.concatenate([np.full(2, -1), np.zeros(count, int)]),
    )  # fmt: skip
    rows = ROWS + 100 * own @ np.array([1.0, -1.0, 1.0, -1.0, 0.0])
    ground = Ground(SAMPLES, flip_groups(SAMPLES, 0.0), omnibus.basis(SAMPLES), WHITE, 0)
    assert missing_effect_test(rows, same, apart, COLUMNS, ground).p == pytest.approx(1 / (1 + FLIP_TEST.flips))


def test_what_one_group_alone_knows_stays_when_that_group_is_left_out():
    """Where the others say nothing of a parameter, one step from the whole fit leaves it where it was."""
    random = np.random.default_rng(6)
    slopes = random.normal(size=(60, 2))
    group = np.repeat([0, 1, 2], 20)
    slopes[group != 2, 1] = 1e-12 * random.normal(size=40)  # next to nothing, as rounding leaves it
    target = random.normal(size=60)
    rows = slopes @ np.linalg.lstsq(slopes, target, rcond=1e-10)[0] - target
    left = held_out.left_out_rows(rows, slopes, np.zeros(0), np.zeros((0, 2)), group)
    assert np.max(np.abs(left)) < 2 * np.max(np.abs(rows))
    known = np.linalg.lstsq(slopes[group != 0], target[group != 0], rcond=1e-10)[0]
    np.testing.assert_allclose(left[group == 0], (slopes @ known - target)[group == 0], rtol=1e-6)
