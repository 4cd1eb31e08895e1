"""Sets of effects fitted with every reading trusted: what people read of errors is of such fits.

A set is judged by a fit through instruments, which gives way where instruments may err: where each held length may be
off by a millimetre, two frictions that left 20 N so leave 6 N once they are fitted to the readings as they are.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from fitting.diagnosis.candidate_fit import CandidateFit
from fitting.diagnosis.examine import Examiner
from fitting.least_squares.unbent import UNBENT


def fit_trusting(
    examiner: Examiner, fits: Mapping[frozenset[str], CandidateFit], sets: Sequence[frozenset[str]]
) -> None:
    """Fit these sets once more, as far as that was not done yet; the examiner keeps what comes out.

    Each begins at the base, and at the fit through instruments: from the base alone, strand bending ended at 31 N on a
    hose where 8 N can be had.
    """
    new, world = [added for added in sets if added not in examiner.trusting], examiner.world
    if examiner.seen.allows_for_instruments:
        effects = [world.with_added(added) for added in new]
        jobs = [(each, examiner.base.vector, sorted(added)) for each, added in zip(effects, new, strict=True)]
        jobs += [(each, fits[added].vector, ()) for each, added in zip(effects, new, strict=True)]
        ends = world.fit_all(jobs, decide=False)
        pairs = zip(ends[: len(new)], ends[len(new) :], strict=True)
        found = [min(pair, key=lambda fit: fit.cost) for pair in pairs]
    else:
        found = [fits[added] for added in new]
    examiner.trusting.update(zip(new, found, strict=True))


def fit_from_trusting(
    examiner: Examiner, fits: Mapping[frozenset[str], CandidateFit], sets: Sequence[frozenset[str]]
) -> dict[frozenset[str], CandidateFit]:
    """These sets fitted through instruments from where they end with every reading trusted, where that is better.

    It is better if it leaves clearly less beyond the instruments. A delay of 60 ms ended at 26 ms: there the skew of
    the clocks, which is a slope, makes of the jumps at the turning points what no instrument makes at 60 ms.
    """
    trusting, left = examiner.trusting, examiner.left
    near = [s for s in sets if s in fits and left(trusting[s]) < UNBENT.clearly**2 * left(fits[s])]
    found = examiner.seen.fit_all([(fits[s].effects, trusting[s].vector, ()) for s in near])
    return {s: fit for s, fit in zip(near, found, strict=True) if np.isfinite(fit.cost) and left(fit) < left(fits[s])}
