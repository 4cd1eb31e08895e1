"""How likely each of several sets is, with the same noise and the same errors of instruments for all.

A test asks of each set whether it can stand, a ratio of likelihoods compares two: another may leave so much less that a
set is out of the question. Few loops make a test that sees little, for it rests on symmetry alone, and there a set may
stand that lacks a whole effect.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from fitting.diagnosis.candidate_fit import CandidateFit
from fitting.diagnosis.examine import Examiner
from fitting.diagnosis.schwarz import criterion, far_likelier, free_of_noise
from fitting.diagnosis.settings import VERDICT, VerdictSettings


def criteria(
    sets: Sequence[frozenset[str]], fits: Mapping[frozenset[str], CandidateFit], examiner: Examiner
) -> dict[frozenset[str], float]:
    """Schwarz's criterion of each fitted set; half a difference is the logarithm of how much likelier the smaller is.

    Noise and what instruments may err by are those of the set that leaves least for its numbers: it is the best guess
    at what is no misfit. Every set is moved to its optimum under them, to first order.
    """
    if len(sets) < 2:
        return dict.fromkeys(sets, 0.0)

    def plainly(added: frozenset[str]) -> float:
        """The criterion were every reading for itself: of two sets that leave the same the smaller is the better."""
        count = len(fits[added].rows)
        return count * np.log(examiner.left(fits[added])) + len(fits[added].free) * np.log(count)

    best = min(sets, key=plainly)
    free = free_of_noise(examiner.ground(fits[best]))
    return {added: criterion(fits[added], free) for added in sets}


def likeliest(
    adequate: Sequence[frozenset[str]],
    fits: Mapping[frozenset[str], CandidateFit],
    examiner: Examiner,
    settings: VerdictSettings = VERDICT,
) -> list[frozenset[str]]:
    """Adequate sets, the likeliest first, without those that are out of the question beside it."""
    found = criteria(adequate, fits, examiner)
    least = min(found.values(), default=0.0)
    order = sorted(adequate, key=lambda added: found[added])
    return [added for added in order if found[added] - least <= 2 * np.log(settings.likelier)]


def outdone(
    adequate: Sequence[frozenset[str]],
    larger: Sequence[frozenset[str]],
    fits: Mapping[frozenset[str], CandidateFit],
    examiner: Examiner,
    settings: VerdictSettings = VERDICT,
) -> bool:
    """Whether a set with an effect more is so much likelier that none of these adequate ones can be the whole of it."""
    if not adequate or not larger:
        return False
    found = criteria([*adequate, *larger], fits, examiner)
    fall = min(found[added] for added in adequate) - min(found[added] for added in larger)
    return far_likelier(fall, len(examiner.world.candidates), settings)
