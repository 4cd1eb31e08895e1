"""Sets of effects fitted with every reading trusted: what people read of errors is of such fits.

A set is judged by a fit through instruments, which gives way where instruments may err: where each held length may be
off by a millimetre, two frictions that left 20 N so leave 6 N once they are fitted to the readings as they are.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from fitting.diagnosis.candidate_fit import CandidateFit
from fitting.diagnosis.examine import Examiner


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


def begun_again(
    examiner: Examiner, fits: Mapping[frozenset[str], CandidateFit], sets: Sequence[frozenset[str]]
) -> dict[frozenset[str], CandidateFit]:
    """Those of these sets that end better through instruments if they begin where a fit of every reading ends.

    It is better if it makes the readings far likelier, when instruments have given way. A delay of 60 ms ended at
    26 ms, beside a skew between the clocks: a search has no way from there to the place that leaves a ninth.
    """
    if not examiner.seen.allows_for_instruments:
        return {}
    unasked = [s for s in sets if s not in examiner.trusting]
    found = examiner.world.fit_all([(fits[s].effects, fits[s].vector, ()) for s in unasked], decide=False)
    trusting = examiner.trusting | dict(zip(unasked, found, strict=True))
    near = [s for s in sets if _is_far_likelier(examiner, trusting[s], fits[s])]
    again = examiner.seen.fit_all([(fits[s].effects, trusting[s].vector, ()) for s in near], decide=False)
    left = examiner.left
    return {s: fit for s, fit in zip(near, again, strict=True) if np.isfinite(fit.cost) and left(fit) < left(fits[s])}


def _is_far_likelier(examiner: Examiner, one: CandidateFit, other: CandidateFit) -> bool:
    """Whether a fit leaves so much less beyond the instruments that the readings are far likelier."""
    ratio = examiner.left(other) / max(examiner.left(one), 1e-300)
    return len(one.rows) * np.log(ratio) > 2 * np.log(examiner.settings.verdict.likelier)
