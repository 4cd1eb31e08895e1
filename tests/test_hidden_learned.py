"""The rival that learns a function: its errors on left-out groups are those of refits, and its p-values hold."""

import numpy as np
from hidden.study.learned import flipped_p, held_out
from sklearn.kernel_ridge import KernelRidge

GROUPS = np.repeat(np.arange(12), 20)
COUNT = len(GROUPS)


def state(seed):
    """Where readings were taken, alike in every group: loops."""
    along = np.tile(np.linspace(-1.5, 1.5, 20), 12)
    return np.column_stack([along, np.random.default_rng(seed).standard_normal(12)[GROUPS]])


def noise(seed):
    """Readings that err together within a group."""
    drawn = np.random.default_rng(seed)
    return drawn.standard_normal(COUNT) + 2.0 * drawn.standard_normal(12)[GROUPS]


def test_errors_of_groups_left_out_are_those_of_refits():
    at, left = state(1), noise(2)
    errors = held_out(at, GROUPS, 0.7, 3.0) @ left
    for group in (0, 7):
        mine = group == GROUPS
        fitted = KernelRidge(alpha=3.0, kernel="rbf", gamma=0.5 / 0.7**2).fit(at[~mine], left[~mine])
        np.testing.assert_allclose(errors[mine], left[mine] - fitted.predict(at[mine]), atol=1e-9)


def test_it_finds_a_function_of_the_state_that_all_groups_share():
    at = state(1)
    assert flipped_p(noise(2) + 5.0 * np.sin(2 * at[:, 0]), at, GROUPS) < 0.01  # few flips change no sign, or all


def test_it_is_rarely_wrong_on_noise_that_errs_together():
    p = [flipped_p(noise(seed), state(seed), GROUPS, seed) for seed in range(24)]
    assert sum(each < 0.05 for each in p) <= 4  # of 24, where 1.2 are expected: more come in one of 170 such tests
    assert np.median(p) > 0.2


def test_one_group_alone_says_nothing():
    assert flipped_p(noise(1)[:20], state(1)[:20], GROUPS[:20]) == 1.0
