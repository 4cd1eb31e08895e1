"""Is anything missing from a fitted model? Candidates, and bases that know no effect, tested by flips of signs.

Three tests, of which any may reject: flips of groups smaller than a run, when runs may differ a little; flips of whole
runs, which may differ as they like; and that runs need not differ by more than they may.
"""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from fitting.diagnosis.between_runs import Nuisance, as_far_as_seen, shares_seen, too_few
from fitting.diagnosis.detection import detectable
from fitting.diagnosis.flip_groups import FlipGroups, numbered
from fitting.diagnosis.omnibus import Basis
from fitting.diagnosis.projected import Projected, projected
from fitting.diagnosis.settings import FLIP_TEST, FlipTestSettings
from fitting.diagnosis.sign_flips import PValues, Scores, flipped_signs, group_scores, similarity_within_runs
from fitting.diagnosis.working_noise import Noise, orthonormal, whitened
from fitting.problem.residuals import Samples


@dataclass(frozen=True)
class MissingEffectTest:
    """The test of one fitted model: is anything missing from it?"""

    p: float  # least of flips of groups, of whole runs, and of differences between runs, each by its share of the level
    p_runs: float  # by flips of whole runs, which may differ as they like; 1 where they are too few
    spread: float  # how alike the groups of one run err, beyond what all runs share
    between_runs: float  # rms of what is left when runs differ as far as they may
    inside: float  # rms of the noise that loops of one run show; infinite where too few do
    p_effects: np.ndarray  # of each candidate column, corrected for all
    p_omnibus: float
    ratio_p: float  # likelihood ratio of the omnibus basis under the noise model
    floor: float  # rms of the rows without what the basis explains, in standard deviations
    detectable: np.ndarray  # the amount of each candidate column that the test would find, if asked; infinite: none
    explained: np.ndarray  # the amount of it that the bases would see under the noise model, if asked
    left: np.ndarray  # share of each column, whitened, that the model's parameters leave
    cosines: np.ndarray  # between the columns after that
    rms: float
    level: float
    settings: FlipTestSettings = field(default=FLIP_TEST, repr=False)

    @property
    def rejected(self) -> bool:
        """Whether something is missing, by `p` or because the misfit is many times the noise."""
        many = self.settings.many
        by_flips = self.p < self.level and not self.runs_differ
        by_size = self.rms > many * self.floor and self.ratio_p < self.settings.misfit_p
        return by_flips or by_size or self.between_runs > many * self.inside

    @property
    def runs_differ(self) -> bool:
        """Whether a spread between runs explains as well what flips of smaller groups reject.

        It is no excuse for many times the noise: then what differs between runs, the pressure or the speed, does what
        the model does not know.
        """
        small = self.rms <= self.settings.many * self.inside
        return self.p < self.level <= self.p_runs and self.spread > self.settings.spread and small


@dataclass(frozen=True)
class Ground:
    """What a test rests on: the samples, what of them is flipped as a whole, the bases, the noise, a seed for signs."""

    samples: Samples
    flip_groups: FlipGroups
    basis: Basis
    noise: Noise
    seed: int
    settings: FlipTestSettings = FLIP_TEST

    @cached_property
    def run(self) -> np.ndarray:
        """The run of each row, from 0."""
        return numbered(self.samples.run)

    @property
    def runs_flip(self) -> bool:
        """Whether there are enough runs to flip them whole."""
        return not too_few(self.samples, self.flip_groups.level / 2)

    def whitened(self, rows: np.ndarray, common: Nuisance, own: Nuisance, signatures: np.ndarray) -> "Whitened":
        """All that is tested, free of the correlation that the noise model knows of."""
        parts = [rows[:, None], common.slopes, own.slopes, signatures, self.basis.smooth, self.basis.fine]
        flat = whitened(np.hstack(parts), self.samples, self.flip_groups.together, self.noise)
        e, j, j_own, z, smooth, fine = np.split(flat, np.cumsum([part.shape[1] for part in parts])[:-1], axis=1)
        return Whitened(e, j, j_own, own.group, z, Basis(smooth, fine), self.settings)

    def p_values(self, what: Projected, number: np.ndarray) -> PValues:
        """Of projected rows, by flips of these groups."""
        return Scores.of(what, number).p_values(self.signs(number))

    def signs(self, number: np.ndarray) -> np.ndarray:
        """Flips (flips, groups)."""
        return flipped_signs(number.max() + 1, self.seed, self.settings)

    def amount_found(self, what: Projected, number: np.ndarray, level: float) -> np.ndarray:
        """The amount of each candidate that flips of these groups find."""
        alone = what.clean * np.sqrt(len(what.e) / what.freedom)
        size = detectable(what.z / what.kept, alone, number, self.signs(number), level, self.seed)
        return what.dull * size / what.kept


@dataclass(frozen=True)
class Whitened:
    """Rows (rows, 1), slopes of one model for all runs and for each its own, candidates and bases: not correlated."""

    e: np.ndarray
    j: np.ndarray
    j_between_runs: np.ndarray
    group: np.ndarray  # of each column of `j_between_runs`, as in `Nuisance`
    z: np.ndarray
    basis: Basis
    settings: FlipTestSettings = FLIP_TEST

    @cached_property
    def common_or_smooth(self) -> np.ndarray:
        """An orthonormal basis of what is common to all runs or smooth."""
        return orthonormal(np.hstack([self.j, self.basis.whole]))

    def project_out_common(self, by: Nuisance) -> Projected:
        """What is left when all runs have the same parameters."""
        return projected(self.e[:, 0], self.j, self.z, self.basis, by, self.settings)

    def project_out_differences(self, by: Nuisance, as_seen: bool = True) -> Projected:
        """What is left when runs may differ: by as much as these do, or by as much as any may."""
        own = self.j_between_runs
        if as_seen:
            own = as_far_as_seen(own, self.group, self.e[:, 0], self.common_or_smooth, by.settings)
        return projected(self.e[:, 0], own, self.z, self.basis, by, self.settings)

    def taken_for_difference(self, amount: np.ndarray) -> np.ndarray:
        """Which of the candidates, so much of each added, would make runs seem to differ by more than they do."""
        added = self.z * np.where(np.isfinite(amount), amount, 0.0)
        shares = lambda rows: shares_seen(self.j_between_runs, self.group, rows, self.common_or_smooth)  # noqa: E731
        now, then = shares(self.e), shares(self.e + added)
        raised = [then[each] > self.settings.raised * now[each] for each in now]
        return np.any(raised, axis=0) if raised else np.zeros(added.shape[1], bool)


def missing_effect_test(
    rows: np.ndarray, common: Nuisance, own: Nuisance, signatures: np.ndarray, ground: Ground, limits: bool = False
) -> MissingEffectTest:
    """Test a fitted model against candidate `signatures` (rows, candidates) and the bases that know no effect.

    Groups smaller than a run are flipped after the model has given way with its `own` parameters, a little different in
    every run; where there are enough runs, whole runs are flipped after it has given way as the `common` one of all, at
    half the level. With `limits` it is also said how much of each candidate would be found.
    """
    groups, white = ground.flip_groups, ground.whitened(rows, common, own, signatures)
    shared, differing = white.project_out_common(common), white.project_out_differences(own)
    by_group = ground.p_values(differing, groups.number)
    p_runs = float(ground.p_values(shared, ground.run).least[0]) if ground.runs_flip else 1.0
    found = explained = np.full(signatures.shape[1], np.nan)
    if limits:
        free = white.project_out_differences(own, as_seen=False)
        found, explained = _limits(ground, white, shared, differing, free), free.explained
    smooth = group_scores(shared.o, shared.clean[:, None], groups.number)[:, :, 0]
    return MissingEffectTest(
        p=_least(by_group, p_runs, differing, ground),
        p_runs=p_runs,
        between_runs=float(np.sqrt(np.mean(own.left_at_most(rows) ** 2))),
        inside=_noise_inside(rows, ground),
        spread=similarity_within_runs(smooth, groups.runs(ground.samples)),
        p_effects=by_group.effects[:, 0],
        p_omnibus=float(by_group.bases[0]),
        ratio_p=float(differing.ratio_p),
        floor=_floor(rows, np.hstack([ground.basis.whole, common.slopes])),
        detectable=found,
        explained=explained,
        left=shared.kept / np.maximum(np.linalg.norm(white.z, axis=0), 1e-300),
        cosines=(shared.z / shared.kept).T @ (shared.z / shared.kept),
        rms=float(np.sqrt(np.mean(rows**2))),
        level=groups.level,
        settings=ground.settings,
    )


def _least(by_group: PValues, p_runs: float, differing: Projected, ground: Ground) -> float:
    """Of the three tests, each by its share of the level; never below that of one of all flips."""
    level = ground.flip_groups.level
    differ = float(differing.differ_p) * level / differing.differ_p_bound
    return min(float(by_group.least[0]), 2 * p_runs, max(differ, 1 / (1 + ground.settings.flips)), 1.0)


def _floor(rows: np.ndarray, columns: np.ndarray) -> float:
    """Rms of the rows without what the columns explain, for each that is still free."""
    known = orthonormal(columns)
    left = rows - known @ (known.T @ rows)
    return float(np.linalg.norm(left) / np.sqrt(max(len(rows) - known.shape[1], 1)))


def _noise_inside(rows: np.ndarray, ground: Ground) -> float:
    """Rms of what loops of one run do not share, in standard deviations, at least 1; infinite where too few tell.

    What they share is smooth along them, so that nothing else leaves their noise, slow or fast. Not whitened: the noise
    model takes what differs between runs for slow noise.
    """
    noise, known = 0.0, 0
    for run in range(ground.run.max() + 1):
        mine = ground.run == run
        loops, count = len(np.unique(ground.samples.loop[mine])), int(mine.sum())
        if 1 < loops <= count / ground.settings.readings_of_loop:
            shared = orthonormal(ground.basis.smooth[mine])
            noise += np.sum((rows[mine] - shared @ (shared.T @ rows[mine])) ** 2) * loops / (loops - 1)
            known += count
    return max(float(np.sqrt(noise / known)), 1.0) if known >= len(rows) / 2 else float("inf")


def _limits(ground: Ground, white: Whitened, shared: Projected, differing: Projected, free: Projected) -> np.ndarray:
    """The amount of each candidate that one of the three tests would find.

    What is taken for a difference between runs is found only with all the difference that is allowed (`free`).
    """
    groups = ground.flip_groups
    found = ground.amount_found(differing, groups.number, groups.level / 2)
    taken = white.taken_for_difference(found)
    if taken.any():
        found = np.where(taken, ground.amount_found(free, groups.number, groups.level / 2), found)
    found = np.minimum(found, free.denied)
    if ground.runs_flip:
        found = np.minimum(found, ground.amount_found(shared, ground.run, groups.level / 4))
    return found
