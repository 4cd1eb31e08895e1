"""Whether larger sets are worth a search: a linear look says what all effects together would leave."""

from collections.abc import Mapping

import numpy as np

from fitting.diagnosis.candidate_fit import CandidateFit
from fitting.diagnosis.examine import Examiner
from fitting.diagnosis.nuisance import Nuisance
from fitting.diagnosis.settings import SEARCH, SearchSettings
from fitting.least_squares.decomposed import orthonormal


def is_hopeless(
    examiner: Examiner,
    fit: CandidateFit,
    fits: Mapping[frozenset[str], CandidateFit],
    settings: SearchSettings = SEARCH,
) -> bool:
    """Whether no set that holds a fitted one can be adequate, for all effects together are not.

    Every effect is put beside the fitted set in all of its shapes, and as much of it as one likes. What this leaves a
    set of three leaves too, as far as a linear look goes. It goes less far where effects are large, but then it leaves
    little of them all the same: hopeless is what leaves a good part of the misfit and is rejected.
    """
    _, columns = examiner.columns(fit, fits)
    together = Nuisance.of(fit).beside(columns)
    test = examiner.rejecting(fit, together)
    if not test.rejected:
        return False
    rows, given = examiner.without_instruments(fit.rows), examiner.without_instruments(together.slopes)
    known = orthonormal(given)
    before, after = (float(np.mean(e**2)) - test.floor**2 for e in (rows, rows - known @ (known.T @ rows)))
    return after > settings.hopeless * before
