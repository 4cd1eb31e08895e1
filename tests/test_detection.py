"""Detection limits, against noise whose answer is known."""

import numpy as np

from fitting.diagnosis.detection import by_group, detectable, largest

UNITS, EACH, LEVEL = 20, 50, 0.005
NUMBER = np.repeat(np.arange(UNITS), EACH)
SIGNS = np.random.default_rng(0).choice([-1.0, 1.0], size=(1999, UNITS))


def columns_of(rng, count):
    columns = rng.normal(size=(UNITS * EACH, count))
    return columns / np.linalg.norm(columns, axis=0)


def power(columns, limit, rng, times=200):
    """How often the flip test itself, with critical values from its own flips, finds the first column's limit."""
    found = 0
    for _ in range(times):
        rows = rng.normal(size=UNITS * EACH) + limit * columns[:, 0]
        scores = by_group(columns, rows[:, None], NUMBER)[0]
        found += abs(scores[:, 0].sum()) > np.quantile(np.abs(SIGNS @ scores).max(axis=1), 1 - LEVEL)
    return found / times


def test_at_every_printed_limit_four_of_five_are_found():
    for seed in range(4):
        rng = np.random.default_rng(seed)
        columns = columns_of(rng, 1 + 5 * seed)
        limit = detectable(columns, rng.normal(size=UNITS * EACH), NUMBER, SIGNS, LEVEL)[0]
        assert 0.7 < power(columns, limit, rng) < 0.9


def test_four_of_five_are_found_where_effects_are_like_each_other():
    """What is hidden stands in all columns like it, and is flipped in all of them: that raises the critical value."""
    found = []
    for seed in range(12):
        rng = np.random.default_rng(seed)
        columns = columns_of(rng, 1) + 0.5 * columns_of(rng, 16)
        columns /= np.linalg.norm(columns, axis=0)
        limit = detectable(columns, rng.normal(size=UNITS * EACH), NUMBER, SIGNS, LEVEL, seed)[0]
        found.append(power(columns, limit, rng))
    assert 0.77 < np.mean(found) < 0.85


def test_columns_that_are_one_have_one_limit():
    rng = np.random.default_rng(2)
    columns = columns_of(rng, 3)
    twice = np.hstack([columns, -columns])
    noise = rng.normal(size=UNITS * EACH)
    limits = detectable(twice, noise, NUMBER, SIGNS, LEVEL)
    np.testing.assert_array_equal(limits[:3], limits[3:])
    np.testing.assert_array_equal(limits[:3], detectable(columns, noise, NUMBER, SIGNS, LEVEL))


def test_a_limit_hardly_depends_on_the_noise_that_it_was_read_off():
    rng = np.random.default_rng(5)
    column = columns_of(rng, 1)
    limits = [detectable(column, rng.normal(size=UNITS * EACH), NUMBER, SIGNS, LEVEL, s)[0] for s in range(8)]
    assert np.std(limits) < 0.08 * np.mean(limits)


def test_what_one_unit_alone_carries_is_never_found_by_flips():
    rng = np.random.default_rng(1)
    column = rng.normal(size=(UNITS * EACH, 1)) * (NUMBER == 3)[:, None]
    column /= np.linalg.norm(column)
    assert np.isinf(detectable(column, rng.normal(size=UNITS * EACH), NUMBER, SIGNS, LEVEL)[0])


def test_the_largest_score_of_all_columns_is_of_either_sign():
    random = np.random.default_rng(2)
    flipped, added = random.normal(size=(2, 3, 4, 5)).astype(np.float32)
    np.testing.assert_array_equal(largest(flipped, added), np.abs(flipped + added).max(axis=0))
