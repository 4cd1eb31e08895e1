"""Runs that differ from the others by more than their instruments may err by: somebody bumped into them.

Flips of signs hardly notice a single odd run; who reads the verdict has to. Each is named with the error that it seems
to have, and with what the test says without it: its rows, and all that could explain them, are set to zero.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy import stats

from fitting.diagnosis.candidate_fit import CandidateFit
from fitting.diagnosis.examine import Examiner
from fitting.diagnosis.findings import OddRun
from fitting.diagnosis.missing_effect import Ground, missing_effect_test
from fitting.diagnosis.nuisance import Nuisance
from fitting.diagnosis.omnibus import Basis
from fitting.diagnosis.search_result import SearchResult
from fitting.diagnosis.settings import ODD_RUNS, OddRunSettings
from fitting.instruments.sources import Source
from fitting.least_squares.decomposed import svd


def odd_runs(search: SearchResult, named: Sequence[frozenset[str]]) -> tuple[OddRun, ...]:
    """The odd runs of what fits best: the first set that is named, else the model if nothing is missing from it."""
    if not search.examiner.flip_groups.trusted or not (named or search.base_is_adequate):
        return ()
    found = _odd(search.examiner, search.fits[named[0]] if named else search.base)
    if not found:
        return ()
    _, columns = search.examiner.columns(search.base, {}, glance=True)
    return tuple(
        OddRun(*search.run_names[run], source, size, without_run(search.examiner, search.base, columns, run))
        for run, source, size in found
    )


def _odd(examiner: Examiner, fit: CandidateFit, settings: OddRunSettings = ODD_RUNS) -> list[tuple[int, Source, float]]:
    """Odd runs of a fitted set, each with its largest error; none where more than a few are: then accuracies are wrong.

    Whitened by noise and instruments, what a run shows along the columns of its own errors are standard normal scores.
    """
    ground, by, errors = examiner.ground(fit), Nuisance.of(fit), examiner.errors(fit)
    nothing = np.zeros((len(errors.run), 0))
    rows = ground.whitened(fit.rows, by, nothing).project_out(by).e
    columns = ground.without_noise(errors.per_run)
    runs, found = np.unique(errors.run), []
    for run in runs:
        at = errors.run == run
        side, strength, back = svd(columns[at])
        score = side.T @ rows[at]
        if stats.chi2.sf(score @ score, len(score)) * len(runs) < settings.p_value:
            widths = back.T @ (strength / np.sqrt(1 + strength**2) * score)  # the most likely errors, in widths
            worst = int(np.argmax(np.abs(widths)))
            if abs(widths[worst]) > settings.widths:
                source = errors.sources_per_run[worst]
                sign = -1.0 if source.channel is None else 1.0  # its column is what friction does to the prediction
                found.append((int(run), source, sign * float(widths[worst]) * source.width))
    return found if len(found) <= settings.most * len(runs) else []


def without_run(examiner: Examiner, fit: CandidateFit, columns: np.ndarray, run: int) -> float:
    """The p-value of a fitted set where the readings of one run say nothing; `columns` (rows, q) are candidates."""
    keep = (examiner.world.samples.run != run).astype(float)
    on = keep[:, None]
    by, errors, basis = Nuisance.of(fit), examiner.errors(fit), examiner.basis
    left = errors.changed(errors.per_run * on, errors.shared * on)
    noise = examiner.kinds.noise_beside(fit.rows * keep, fit.slopes * on, left)
    scale = len(keep) / keep.sum()  # the mean product was taken over rows of zero, too
    ground = Ground(
        examiner.world.samples,
        examiner.flip_groups,
        Basis(basis.smooth * on, basis.fine * on),
        replace(noise, white=noise.white * scale, shares=noise.shares * scale),
        left,
        examiner.seed,
        examiner.settings.flip_test,
    )
    return missing_effect_test(fit.rows * keep, replace(by, slopes=by.slopes * on), columns * on, ground).p
