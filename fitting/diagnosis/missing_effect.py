"""Is anything missing from a fitted model? Candidates, and bases that know no effect, tested by flips of signs.

What instruments within their accuracy could have made, and what friction may differ by from run to run, is part of the
null: rows and candidates are whitened by it before anything is flipped. Two rules may reject, each by its share of the
level: flips of groups of readings, and a misfit of many times the noise to which flips may be blind.
"""

from dataclasses import dataclass, field, replace

import numpy as np

from fitting.diagnosis.detection import detectable
from fitting.diagnosis.flip_groups import FlipGroups
from fitting.diagnosis.nuisance import Nuisance
from fitting.diagnosis.omnibus import Basis
from fitting.diagnosis.projected import Projected, projected
from fitting.diagnosis.settings import FLIP_TEST, FlipTestSettings
from fitting.diagnosis.sign_flips import PValues, Scores, flipped_signs
from fitting.instruments.errors import InstrumentErrors, InstrumentWhitener
from fitting.least_squares.decomposed import orthonormal
from fitting.least_squares.working_noise import Noise, Whitener
from fitting.problem.residuals import Samples


@dataclass(frozen=True)
class MissingEffectTest:
    """The test of one fitted model: is anything missing from it?"""

    p: float  # the least of both rules, each by its share of the level
    p_effects: np.ndarray  # of each candidate column, corrected for all
    p_omnibus: float
    p_misfit: float  # of the rule for a misfit of many times the noise, by its share of the level; 1 where it is less
    ratio_p: float  # likelihood ratio of the omnibus basis under the noise model
    floor: float  # rms of the rows without what instruments and the basis explain, in standard deviations
    detectable: np.ndarray  # the amount of each candidate column that the test would find, if asked; infinite: none
    explained: np.ndarray  # the amount of it that the bases would see under the noise model, if asked
    left: np.ndarray  # share of each column, free of correlated noise, that the model's parameters leave
    cosines: np.ndarray  # between the columns after that
    rms: float  # of the rows
    rms_beyond: float  # of the rows without what instruments within their accuracy can make of them
    level: float
    settings: FlipTestSettings = field(default=FLIP_TEST, repr=False)

    @property
    def rejected(self) -> bool:
        """Whether something is missing."""
        return self.p < self.level

    @property
    def by_size(self) -> bool:
        """Whether the size of the misfit says so, and flips do not."""
        return self.rejected and self.p_misfit <= self.p and min(self.p_omnibus, *self.p_effects, 1.0) > self.level


@dataclass(frozen=True)
class Ground:
    """What a test rests on: samples, what of them is flipped as a whole, bases, noise, instruments, a seed.

    `whitener` is that of the noise, and `explained` an orthonormal basis (rows, q) of what the fitted model and the
    bases that know no effect can make of rows; both are found where they are not given.
    """

    samples: Samples
    flip_groups: FlipGroups
    basis: Basis
    noise: Noise
    errors: InstrumentErrors
    seed: int
    settings: FlipTestSettings = FLIP_TEST
    whitener: Whitener | None = None
    explained: np.ndarray | None = None

    def prepared(self, by: Nuisance) -> "Ground":
        """The same with all that tests of one fitted model share, whatever its instruments err by."""
        explained = orthonormal(np.hstack([self.basis.whole, by.slopes]))
        return replace(self, whitener=self._noise_whitener(), explained=explained)

    def _noise_whitener(self) -> Whitener:
        return self.whitener or Whitener.of(self.noise, self.samples, self.flip_groups.together)

    def without_noise(self, columns: np.ndarray) -> np.ndarray:
        """Rows (rows, q) free of the correlation that noise makes."""
        return self._noise_whitener()(columns)

    def instruments(self) -> InstrumentWhitener:
        """What takes the errors of instruments out of columns that are free of the correlation of noise."""
        felt = self.errors
        return felt.changed(self.without_noise(felt.per_run), self.without_noise(felt.shared)).whitener()

    def whitened(self, rows: np.ndarray, by: Nuisance, signatures: np.ndarray) -> "Whitened":
        """All that is tested, free of the correlation that noise and instruments make."""
        errors, felt = self.instruments(), self.errors
        parts = [rows[:, None], by.slopes, signatures, self.basis.smooth, self.basis.fine, felt.shared]
        plain = self.without_noise(np.hstack(parts))
        split = lambda flat: np.split(flat, np.cumsum([part.shape[1] for part in parts])[:-1], axis=1)  # noqa: E731
        e, j, z, smooth, fine, shared = split(errors(plain))
        _, j_plain, z_plain, *_ = split(plain)
        left = Nuisance(j_plain, by.prior_rows, by.prior_slopes).project_out(z_plain)
        share = np.linalg.norm(left, axis=0) / np.maximum(np.linalg.norm(z_plain, axis=0), 1e-300)
        return Whitened(e, j, z, Basis(smooth, fine), share, shared, self.settings)

    def p_values(self, what: Projected) -> PValues:
        """Of projected rows."""
        return Scores.of(what, self.flip_groups.number).p_values(self.signs)

    @property
    def signs(self) -> np.ndarray:
        """Flips (flips, groups)."""
        return flipped_signs(self.flip_groups.count, self.seed, self.settings)

    def amount_found(self, what: Projected) -> np.ndarray:
        """The amount of each candidate that flips find: half their share of the level is for candidates."""
        level = 0.5 * (self.flip_groups.level - self.settings.misfit_p)
        alone = what.clean * np.sqrt(len(what.e) / what.freedom)
        size = detectable(what.z / what.kept, alone, self.flip_groups.number, self.signs, level, self.seed)
        return what.dull * size / what.kept


@dataclass(frozen=True)
class Whitened:
    """Rows (rows, 1), slopes of the model's parameters, candidates, bases and what instruments err by: not correlated.

    `shared` (rows, errors) are the errors that all runs share.
    """

    e: np.ndarray
    j: np.ndarray
    z: np.ndarray
    basis: Basis
    share_left: np.ndarray  # of each candidate, what the parameters leave where instruments do not err
    shared: np.ndarray
    settings: FlipTestSettings = FLIP_TEST

    def project_out(self, by: Nuisance) -> Projected:
        """What is left when the model's parameters have given way."""
        return projected(self.e[:, 0], self.j, self.z, self.basis, by, self.settings)


def missing_effect_test(
    rows: np.ndarray, by: Nuisance, signatures: np.ndarray, ground: Ground, limits: bool = False
) -> MissingEffectTest:
    """Test a fitted model against candidate `signatures` (rows, candidates) and the bases that know no effect.

    `by` says how its parameters may give way. With `limits` it is also said how much of each candidate would be found.
    """
    ground = ground if ground.explained is not None else ground.prepared(by)
    assert ground.explained is not None
    white = ground.whitened(rows, by, signatures)
    left = white.project_out(by)
    p_values, level, misfit_p = ground.p_values(left), ground.flip_groups.level, ground.settings.misfit_p
    rest = ground.errors.whitener().residual(rows)
    floor = _floor(rest, ground.explained)
    beyond = float(np.sqrt(np.mean(rest**2)))
    large = beyond > ground.settings.many * floor
    least = 1 / (1 + ground.settings.flips)  # no p is smaller than one of all flips
    p_misfit = float(np.clip(left.ratio_p * level / misfit_p, least, 1.0)) if large else 1.0
    p_flips = float(p_values.least[0]) * level / (level - misfit_p)
    found = explained = np.full(signatures.shape[1], np.nan)
    if limits:
        found, explained = ground.amount_found(left), left.explained
    return MissingEffectTest(
        p=min(p_flips, p_misfit, 1.0),
        p_effects=p_values.effects[:, 0],
        p_omnibus=float(p_values.bases[0]),
        p_misfit=p_misfit,
        ratio_p=float(left.ratio_p),
        floor=floor,
        detectable=found,
        explained=explained,
        left=white.share_left,
        cosines=(left.z / left.kept).T @ (left.z / left.kept),
        rms=float(np.sqrt(np.mean(rows**2))),
        rms_beyond=beyond,
        level=level,
        settings=ground.settings,
    )


def _floor(rows: np.ndarray, known: np.ndarray) -> float:
    """Rms of the rows without what an orthonormal basis (rows, q) explains, for each that is still free."""
    left = rows - known @ (known.T @ rows)
    return float(np.linalg.norm(left) / np.sqrt(max(len(rows) - known.shape[1], 1)))
