"""E-values of a model: evidence against it that is multiplied from session to session, and may be looked at any time.

If a model lacks nothing, each loop's score is as often positive as negative whatever its size. Whoever bets on its sign
then multiplies his stake by exp(a s)/cosh(a s), which is 1 in the mean: a fair game. What he has won after all loops is
the evidence against the model (Ville 1939; Ramdas, Grunwald, Vovk & Shafer 2023). He splits his stake evenly between
the candidates, their shapes, both signs, and several stakes a.
What all loops share is not fair: parameters fitted to all of them, and errors that are the same in every session, as a
gauge's gain. Each bet pays exp(-a^2 v/2) for that, v being the variance that the signs of loops do not show. What errs
alike adds up in v with the square of the sessions, so that recording the same again proves nothing an instrument could
have made.
"""

from collections.abc import Sequence

import numpy as np
from scipy.special import logsumexp

from fitting.evidence.bets import Bets, Column
from fitting.evidence.settings import EVIDENCE, EvidenceSettings


def log_evidence(sessions: Sequence[Bets], settings: EvidenceSettings = EVIDENCE) -> dict[str, np.ndarray]:
    """Natural logarithm of the evidence along each candidate after every session: (sessions,) by its name."""
    columns = tuple(dict.fromkeys(column for session in sessions for column in session.columns))
    stakes = np.array(settings.stakes)
    each = [_laid_out(session, columns) for session in sessions]
    score = np.cumsum([scores.sum(axis=0) for scores, *_ in each], axis=0)[..., None] * stakes
    paid = np.cumsum([np.sum(_log_cosh(scores[..., None] * stakes), axis=0) for scores, *_ in each], axis=0)
    unseen = _unseen(*(np.array(part) for part in list(zip(*each, strict=True))[1:]))
    fee = 0.5 * unseen[..., None] * stakes**2
    log = np.logaddexp(score, -score) - np.log(2) - paid - fee  # (sessions, columns, stakes)
    by_column = logsumexp(log, axis=2) - np.log(len(stakes))
    names = tuple(dict.fromkeys(name for name, _ in columns))
    return {name: _mean(by_column[:, [c[0] == name for c in columns]]) for name in names}


def log_mean(evidence: dict[str, np.ndarray]) -> np.ndarray:
    """Logarithm of the evidence of all candidates together, by whose mean it is as fair (sessions,)."""
    return _mean(np.stack(list(evidence.values()), axis=1))


def _mean(logs: np.ndarray) -> np.ndarray:
    return logsumexp(logs, axis=1) - np.log(logs.shape[1])


def _laid_out(session: Bets, columns: Sequence[Column]) -> tuple[np.ndarray, ...]:
    """Scores (groups, columns), variances and common errors of a session for these columns; zero where it has none."""
    at = [columns.index(column) for column in session.columns]
    wide = [np.zeros((*part.shape[:-1], len(columns))) for part in _parts(session)]
    for out, part in zip(wide, _parts(session), strict=True):
        out[..., at] = part
    return tuple(wide)


def _parts(session: Bets) -> tuple[np.ndarray, ...]:
    return session.scores, session.variance, session.own, session.common


def _unseen(variance: np.ndarray, own: np.ndarray, common: np.ndarray) -> np.ndarray:
    """Variance of the sum of all scores so far that the signs of groups do not show; all (sessions, columns)."""
    alone = np.cumsum(np.maximum(variance - common**2, 0.0), axis=0)
    return np.maximum(alone + np.cumsum(common, axis=0) ** 2 - np.cumsum(own, axis=0), 0.0)


def _log_cosh(x: np.ndarray) -> np.ndarray:
    return np.logaddexp(x, -x) - np.log(2)
