"""What one session's readings say against a fitted model, along everything that could be missing from it."""

from dataclasses import dataclass

import numpy as np

from fitting.diagnosis.candidate_fit import CandidateFit
from fitting.diagnosis.examine import Examiner
from fitting.diagnosis.nuisance import Nuisance
from fitting.diagnosis.sign_flips import group_scores
from fitting.diagnosis.signatures import signatures

Column = tuple[str, int]  # a candidate, and the number of its shape


@dataclass(frozen=True)
class Bets:
    """Scores of every column, loop by loop, and the variance of their sum that the signs of loops do not show.

    Scores are in standard deviations of a session's whole score. Arrays are of shape (columns,) unless said otherwise.
    """

    columns: tuple[Column, ...]
    scores: np.ndarray  # (groups, columns)
    variance: np.ndarray  # of a session's whole score, were the noise model right
    own: np.ndarray  # the sum of the variances of its groups: less, for all share the fitted parameters
    common: np.ndarray  # standard deviation of what errs alike in all sessions: stated sizes, zeros and gains


def bets_of(examiner: Examiner, fit: CandidateFit) -> Bets:
    """Those of one session against one fitted model; a column that its recordings cannot see has scores of zero."""
    wanted = examiner.wanted(fit, {})
    found = signatures(examiner.world, fit, wanted)
    by, ground = Nuisance.of(fit), examiner.ground(fit)
    white = ground.whitened(fit.rows, by, np.where(np.all(np.isfinite(found), axis=0), found, 0.0))
    left, number = white.project_out(by), ground.flip_groups.number
    z = np.where(left.seen, left.z / left.kept, 0.0)
    scores = group_scores(z, left.e[:, None], number)[:, :, 0]
    curvature = np.linalg.pinv(white.j.T @ white.j + by.prior_slopes.T @ by.prior_slopes, rcond=1e-13, hermitian=True)
    overlaps = group_scores(white.j, z, number)  # (groups, parameters, columns)
    taken = np.einsum("gpk,pq,gqk->k", overlaps, curvature, overlaps)
    whole = overlaps.sum(axis=0)
    size = np.sum(z**2, axis=0)
    variance = size - np.einsum("pk,pq,qk->k", whole, curvature, whole)
    common = np.hypot(left.pulled, np.linalg.norm(white.shared.T @ z, axis=0))
    return Bets(_numbered([name for name, _ in wanted]), scores, variance, size - taken, common)


def _numbered(names: list[str]) -> tuple[Column, ...]:
    """Each name with how often it came before."""
    return tuple((name, names[:i].count(name)) for i, name in enumerate(names))
