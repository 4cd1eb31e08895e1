"""How often the diagnosis would reject an explanation, counted over many drawn sets of rows at once."""

from dataclasses import dataclass

import numpy as np

from fitting.diagnosis import omnibus
from fitting.diagnosis.flip_groups import FlipGroups
from fitting.diagnosis.nuisance import Nuisance
from fitting.diagnosis.projected import Projected, projected
from fitting.diagnosis.settings import FLIP_TEST, FlipTestSettings
from fitting.diagnosis.sign_flips import Scores, flipped_signs
from fitting.instruments.errors import InstrumentErrors
from fitting.planning.settings import COUNTS, CountSettings


@dataclass(frozen=True)
class Drawn:
    """Drawn sets of whitened rows (rows, draws) of one explanation, and what the test looks along."""

    rows: np.ndarray
    slopes: np.ndarray
    prior_slopes: np.ndarray
    errors: InstrumentErrors  # what instruments within their accuracy can do to the whitened rows
    columns: np.ndarray  # signatures
    basis: omnibus.Basis
    flip_groups: FlipGroups
    old: int = 0  # rows that were measured before; they come first
    settings: FlipTestSettings = FLIP_TEST

    def rejections(self, seed: int, counts: CountSettings = COUNTS) -> np.ndarray:
        """Which draws (draws,) the test of a diagnosis rejects."""
        white = self.errors.whitener()
        by = Nuisance(self.slopes, np.zeros(len(self.prior_slopes)), self.prior_slopes)
        basis = omnibus.Basis(white(self.basis.smooth), white(self.basis.fine))
        left = projected(white(self.rows), white(self.slopes), white(self.columns), basis, by, self.settings)
        signs = flipped_signs(self.flip_groups.count, seed, self.settings)[: counts.flips]
        level, misfit_p = self.flip_groups.level, self.settings.misfit_p
        return (self._undulled(left, signs) * level / (level - misfit_p) < level) | self._misfit(left)

    def _undulled(self, left: Projected, signs: np.ndarray) -> np.ndarray:
        """The p-values (draws,) of draws that err in nothing that is stated."""
        scores = Scores.of(left, self.flip_groups.number)
        return Scores(scores.candidates, scores.smooth, scores.fine, np.ones_like(left.dull)).p_values(signs).least

    def _misfit(self, left: Projected) -> np.ndarray:
        """Where (draws,) a misfit is many times the noise and the bases take it up."""
        large = np.sum(left.e**2, axis=0) > self.settings.many**2 * left.unexplained
        return large & (left.ratio_p < left.misfit_p_bound)
