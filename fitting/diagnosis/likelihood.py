"""How likely one fitted set is beside another, with the same noise and the same errors of instruments for both.

A test asks of each set whether it can stand, a ratio of likelihoods compares two.
"""

from collections.abc import Callable

import numpy as np

from fitting.diagnosis.candidate_fit import CandidateFit
from fitting.diagnosis.missing_effect import Ground
from fitting.diagnosis.settings import VERDICT, VerdictSettings
from fitting.least_squares.decomposed import lstsq


def free_of_noise(ground: Ground) -> Callable[[np.ndarray], np.ndarray]:
    """What takes noise and the errors of instruments out of columns (rows, q), as a fit leaves them."""
    instruments = ground.instruments()
    return lambda columns: instruments(ground.without_noise(columns))


def criterion(fit: CandidateFit, free: Callable[[np.ndarray], np.ndarray]) -> float:
    """n log(left/n) + what stated sizes leave + k log n, of n readings and k parameters."""
    both = free(np.column_stack([fit.rows, fit.slopes]))
    whole = np.vstack([both[:, 1:], fit.prior_slopes])
    target = np.concatenate([both[:, 0], fit.prior_rows])
    squares = (target - whole @ lstsq(whole, target, 1e-12)) ** 2
    count = len(fit.rows)
    left, stated = float(np.sum(squares[:count])), float(np.sum(squares[count:]))
    return count * np.log(left / count) + stated + len(fit.free) * np.log(count)


def is_far(fall: float, candidates: int, settings: VerdictSettings = VERDICT) -> bool:
    """Whether a criterion falls so far that what stood before is out of the question.

    What makes it fall was chosen among all candidates, and the best of many always fits a little better: the ratio has
    to be larger by their number (the extended criterion of Chen and Chen, Biometrika 95, 759, 2008).
    """
    return fall > 2 * np.log(settings.likelier * candidates)


def is_far_likelier(
    fit: CandidateFit, smaller: CandidateFit, ground: Ground, candidates: int, settings: VerdictSettings = VERDICT
) -> bool:
    """Whether a fitted set, tested on this ground, makes the readings likelier by that much than a smaller one does."""
    free = free_of_noise(ground)
    return is_far(criterion(smaller, free) - criterion(fit, free), candidates, settings)
