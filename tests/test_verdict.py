"""What a gate says of one fitted set: when it rejects, and what it reads off the columns, against plain algebra."""

from dataclasses import replace

import numpy as np
import pytest
from test_flips import autoregression, samples, words

from fitting.diagnosis import omnibus
from fitting.diagnosis.flip_groups import flip_groups
from fitting.diagnosis.missing_effect import Ground, missing_effect_test
from fitting.diagnosis.nuisance import Nuisance
from fitting.diagnosis.settings import FLIP_TEST
from fitting.instruments.errors import InstrumentErrors
from fitting.least_squares import held_out, working_noise

EXACT = InstrumentErrors.none(samples().run)
WHITE = working_noise.white_noise(1.0)
SAMPLES = samples()
ROWS = np.random.default_rng(1).normal(size=len(SAMPLES))
SLOPES = np.stack([SAMPLES.pressure / 1e5, SAMPLES.branch], axis=1)
COLUMNS = np.stack([SAMPLES.branch * SAMPLES.rate, SAMPLES.contraction, SAMPLES.pressure * SAMPLES.contraction], axis=1)


@pytest.fixture(scope="module")
def verdict():
    """White noise in five runs, tested for three candidates beside two parameters that all runs share."""
    same = Nuisance(SLOPES, np.zeros(0), np.zeros((0, 2)))
    ground = Ground(SAMPLES, flip_groups(SAMPLES, 0.0), omnibus.basis(SAMPLES), WHITE, EXACT, 0)
    return missing_effect_test(ROWS, same, COLUMNS, ground)


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


def test_many_times_the_noise_is_a_misfit_where_few_groups_are_blind_to_it():
    """An effect of one run alone: flips of its four loops hardly tell it from noise, its size does."""
    alone = SAMPLES.run == 0
    left = SAMPLES.contraction - 0.1
    ground = Ground(SAMPLES, flip_groups(SAMPLES, 0.0), omnibus.basis(SAMPLES), WHITE, EXACT, 0)
    same, none = Nuisance(SLOPES, np.zeros(0), np.zeros((0, 2))), np.zeros((len(SAMPLES), 0))
    for size, by_size in ((200.0, True), (15.0, False)):
        found = missing_effect_test(ROWS + size * alone * left, same, none, ground)
        assert (found.p_misfit < 1) is by_size
        assert found.rejected is by_size
    assert found.p_omnibus > 0.01


@pytest.mark.parametrize("memory", [0.0, 0.8])
def test_blocks_are_counted_and_stay_within_a_branch(memory):
    few = SAMPLES.where((SAMPLES.run == 0) & (SAMPLES.half < 4))
    groups = flip_groups(few, memory)
    assert not groups.trusted
    assert f"{groups.count} blocks of {groups.block_samples} samples" in words(groups)
    assert groups.count == len(np.unique(groups.number))
    assert all(len(np.unique(few.half[groups.number == one])) == 1 for one in range(groups.count))


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
    same = Nuisance(SLOPES, np.zeros(0), np.zeros((0, 2)))
    ground = Ground(SAMPLES, flip_groups(SAMPLES, 0.0), omnibus.basis(SAMPLES), WHITE, EXACT, 0)
    limit = missing_effect_test(ROWS, same, COLUMNS, ground, limits=True).detectable[0]
    random = np.random.default_rng(2)

    def found(amount):
        rows = random.normal(size=len(SAMPLES)) + amount * COLUMNS[:, 0]
        return missing_effect_test(rows, same, COLUMNS, ground).rejected

    assert np.mean([found(0.5 * limit) for _ in range(25)]) < 0.5
    assert 0.6 <= np.mean([found(limit) for _ in range(35)]) <= 0.98


def test_no_p_is_smaller_than_one_of_all_flips():
    """Zero would say more than can be known."""
    same = Nuisance(SLOPES, np.zeros(0), np.zeros((0, 2)))
    ground = Ground(SAMPLES, flip_groups(SAMPLES, 0.0), omnibus.basis(SAMPLES), WHITE, EXACT, 0)
    found = missing_effect_test(ROWS + 100 * COLUMNS[:, 0], same, COLUMNS, ground)
    assert 1 / (1 + FLIP_TEST.flips) <= found.p_effects[0] < 0.01


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
