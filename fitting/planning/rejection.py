"""How often the diagnosis would reject an explanation, counted over many drawn sets of rows at once."""

from dataclasses import dataclass

import numpy as np

from fitting.diagnosis import omnibus
from fitting.diagnosis.between_runs import Nuisance, as_far_as_seen
from fitting.diagnosis.flip_groups import FlipGroups
from fitting.diagnosis.projected import Projected, projected
from fitting.diagnosis.settings import FLIP_TEST, NUISANCE, FlipTestSettings, NuisanceSettings
from fitting.diagnosis.sign_flips import Scores, flipped_signs
from fitting.diagnosis.working_noise import orthonormal
from fitting.planning.settings import COUNTS, CountSettings


@dataclass(frozen=True)
class Drawn:
    """Drawn sets of whitened rows (rows, draws) of one explanation, and what the test looks along."""

    rows: np.ndarray
    slopes: np.ndarray
    prior_slopes: np.ndarray
    differing: np.ndarray  # by what runs may differ
    group: np.ndarray  # parameter of each of these columns
    columns: np.ndarray  # signatures
    basis: omnibus.Basis
    flip_groups: FlipGroups
    old: int = 0  # rows that were measured before; they come first
    settings: FlipTestSettings = FLIP_TEST
    nuisance_settings: NuisanceSettings = NUISANCE

    def rejections(self, seed: int, counts: CountSettings = COUNTS) -> np.ndarray:
        """Which draws (draws,) the test of a diagnosis rejects, but for its flips of whole runs."""
        nuisance = self._nuisance(counts.draws_of_spread)
        left = projected(self.rows, nuisance.slopes, self.columns, self.basis, nuisance, self.settings)
        signs = flipped_signs(self.flip_groups.count, seed, self.settings)[: counts.flips]
        by_flips = self._undulled(left, signs) < self.flip_groups.level
        return by_flips | (left.differ_p < left.differ_p_bound) | self._misfit(left)

    def _undulled(self, left: Projected, signs: np.ndarray) -> np.ndarray:
        """The p-values (draws,) of draws that err in nothing that is stated."""
        scores = Scores.of(left, self.flip_groups.number)
        return Scores(scores.candidates, scores.smooth, scores.fine, np.ones_like(left.dull)).p_values(signs).least

    def _nuisance(self, draws: int) -> Nuisance:
        """How the model may give way: with what is stated of it, and with what runs may differ by."""
        slopes, prior = self.slopes, self.prior_slopes
        if self.differing.shape[1]:
            common = orthonormal(np.hstack([slopes, self.basis.whole]))
            some = self.rows[:, :draws]
            own = as_far_as_seen(self.differing, self.group, some, common, self.nuisance_settings)
            count, known = own.shape[1], prior.shape
            slopes = np.hstack([slopes, own])
            prior = np.block([[prior, np.zeros((known[0], count))], [np.zeros((count, known[1])), np.eye(count)]])
        group = np.concatenate([np.full(self.slopes.shape[1], -1), self.group])
        return Nuisance(slopes, np.zeros(len(prior)), prior, group, self.nuisance_settings)

    def _misfit(self, left: Projected) -> np.ndarray:
        """Where (draws,) a misfit is many times the noise and the bases take it up."""
        large = np.sum(left.e**2, axis=0) > self.settings.many**2 * left.unexplained
        return large & (left.ratio_p < left.misfit_p_bound)
