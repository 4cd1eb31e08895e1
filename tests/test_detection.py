"""Detection limits and the spread between runs, against noise whose answer is known."""

import numpy as np

from fitting.detection import detectable
from fitting.flips import SPREAD, alike_within

UNITS, EACH, LEVEL = 20, 50, 0.005
NUMBER = np.repeat(np.arange(UNITS), EACH)


def scores_of(columns, noise):
    return np.array([(columns * noise[:, None])[unit == NUMBER].sum(axis=0) for unit in range(UNITS)])


def power_at_its_limit(seed):
    """The flip test itself, with critical values from its own flips, at the amount printed for one draw of noise."""
    rng = np.random.default_rng(seed)
    column = rng.normal(size=(UNITS * EACH, 1))
    column /= np.linalg.norm(column)
    signs = rng.choice([-1.0, 1.0], size=(1999, UNITS))
    limit = detectable(column, scores_of(column, rng.normal(size=UNITS * EACH)), NUMBER, signs, LEVEL)[0]
    fresh = (scores_of(column, rng.normal(size=UNITS * EACH) + limit * column[:, 0])[:, 0] for _ in range(60))
    return np.mean([abs(score.sum()) > np.quantile(np.abs(signs @ score), 1 - LEVEL) for score in fresh])


def test_at_the_limit_four_of_five_are_found_on_average():
    """A single limit scatters with the noise that it was read off: of one column and 20 units by a quarter."""
    assert 0.7 < np.mean([power_at_its_limit(seed) for seed in range(16)]) < 0.92


def test_what_one_unit_alone_carries_is_never_found_by_flips():
    rng = np.random.default_rng(1)
    column = rng.normal(size=(UNITS * EACH, 1)) * (NUMBER == 3)[:, None]
    column /= np.linalg.norm(column)
    signs = rng.choice([-1.0, 1.0], size=(1999, UNITS))
    assert np.isinf(detectable(column, scores_of(column, rng.normal(size=UNITS * EACH)), NUMBER, signs, LEVEL)[0])


def test_loops_of_one_run_are_alike_only_where_runs_differ():
    rng = np.random.default_rng(2)
    run = np.repeat(np.arange(10), 2)
    noise = rng.normal(size=(20, 30))
    assert alike_within(noise, run) < SPREAD
    assert alike_within(noise + np.repeat(rng.normal(size=(10, 30)), 2, axis=0), run) > 0.3
