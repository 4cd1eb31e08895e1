"""Schwarz's criterion of a fitted set, and by how much one must beat another to be far likelier."""

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


def far_likelier(fall: float, chosen_among: int, settings: VerdictSettings = VERDICT) -> bool:
    """Whether the criterion falls so far to a larger set that a smaller one is out of the question beside it.

    What the larger one has more was chosen among so many, and the best of many always fits a little better: the ratio
    has to be larger by their number (the extended criterion of Chen and Chen, Biometrika 95, 759, 2008).
    """
    return bool(fall > 2 * np.log(settings.likelier * chosen_among))
