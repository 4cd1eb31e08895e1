"""The sign-flip test itself: scores of groups, their signs flipped, and how often flips reach what was measured.

Only the mean has to be right: errors may be correlated within a group, drift, and differ in size between groups
(Hemerik, Goeman & Finos 2020; Canay, Romano & Shaikh 2017). The flips are the same for all candidates and all their
shapes, so the largest score of many is compared with the largest of many. Many draws of rows are tested at once.
"""

from dataclasses import dataclass

import numpy as np

from fitting.diagnosis.projected import Projected
from fitting.diagnosis.settings import FLIP_TEST, FlipTestSettings

ROUNDING = 1e-9  # relative: flips that differ by less from what was measured reach it


@dataclass(frozen=True)
class Scores:
    """Scores of each group and draw: of candidates (groups, candidates, draws), of the bases (groups, q, draws).

    `dull` (candidates,) is how much larger a candidate's score must be than its flips.
    """

    candidates: np.ndarray
    smooth: np.ndarray
    fine: np.ndarray
    dull: np.ndarray

    @classmethod
    def of(cls, what: Projected, number: np.ndarray) -> "Scores":
        """Those of projected rows (rows,) or (rows, draws), by the number of each row's group."""
        rows = what.e.reshape(len(what.e), -1)
        candidates = np.where(what.seen, what.z / what.kept, 0.0)
        bases = group_scores(what.o, rows, number)
        return cls(group_scores(candidates, rows, number), bases[:, : what.smooth], bases[:, what.smooth :], what.dull)

    def p_values(self, signs: np.ndarray) -> "PValues":
        """Against flips (flips, groups) of the same groups."""
        seen = np.abs(self.candidates.sum(axis=0)) / self.dull[:, None]
        top = np.abs(np.tensordot(signs, self.candidates, axes=1)).max(axis=1, initial=0.0)
        effects = np.array([_share(top, one) for one in seen]).reshape(seen.shape)
        least = np.minimum(_p_of_sum(self.smooth, signs), _p_of_sum(self.fine, signs))
        return PValues(effects, np.minimum(1.0, 2 * least))


@dataclass(frozen=True)
class PValues:
    """Of each candidate, corrected for all (candidates, draws), and of the bases that know no effect (draws,)."""

    effects: np.ndarray
    bases: np.ndarray

    @property
    def least(self) -> np.ndarray:
        """Of the whole test (draws,): half the level is for the candidates, a quarter for either basis."""
        return np.minimum(1.0, 2 * np.minimum(self.effects.min(axis=0, initial=1.0), self.bases))


def group_scores(columns: np.ndarray, rows: np.ndarray, number: np.ndarray) -> np.ndarray:
    """Sums over each group of columns (rows, q) times rows (rows, draws): (groups, q, draws)."""
    groups = (np.flatnonzero(number == one) for one in range(number.max() + 1))
    return np.stack([columns[at].T @ rows[at] for at in groups])


def flipped_signs(groups: int, seed: int, settings: FlipTestSettings = FLIP_TEST) -> np.ndarray:
    """Signs (flips, groups), the first as measured; all that differ by more than one common sign, or a draw of them."""
    random = np.random.default_rng(seed)
    groups = int(groups)  # numpy's integers would overflow below
    if 2 ** (groups - 1) > 1 + settings.flips:
        return np.vstack([np.ones(groups), random.choice([-1.0, 1.0], size=(settings.flips, groups))])
    bits = np.arange(2 ** (groups - 1))[:, None] >> np.arange(groups)
    return np.vstack([np.ones(groups), random.permutation(1.0 - 2.0 * (bits[1:] & 1))])


def _p_of_sum(scores: np.ndarray, signs: np.ndarray) -> np.ndarray:
    """How often flips reach the sum of squares of these scores (groups, q, draws); 1 where there are none."""
    flipped = np.tensordot(signs, scores, axes=1)
    return _share(np.sum(flipped**2, axis=1), np.sum(scores.sum(axis=0) ** 2, axis=0))


def _share(flipped: np.ndarray, seen: np.ndarray) -> np.ndarray:
    """Share of flips (flips, draws) that reach what was seen (draws,); one of them is what was measured."""
    return np.mean(flipped >= seen * (1 - ROUNDING), axis=0)
