"""Is anything missing? Scores of every candidate, and of a basis that knows none, with signs flipped loop by loop.

Only the mean has to be right: errors may be correlated within a unit, drift, and differ in size between units
(Hemerik, Goeman & Finos 2020; Canay, Romano & Shaikh 2017). The flips are the same for all candidates and all their
hidden shapes, so the largest score of many is compared with the largest of many.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fitting.diagnosis import omnibus
from fitting.diagnosis.between_runs import DENIED_P, Nuisance, as_far_as_seen, shares_seen, too_few
from fitting.diagnosis.detection import detectable
from fitting.diagnosis.omnibus import Basis
from fitting.diagnosis.projected import MISFIT_P, Projected, projected
from fitting.diagnosis.working_noise import Noise, orthonormal, whitened
from fitting.problem.residuals import Samples

FLIPS = 1999
LEVEL = 0.01
FEW_LEVEL = 0.005
ENOUGH = 12  # units below which smaller ones are flipped
MANY = 2.5  # times the noise: so much misfit is a misfit, though flips may be blind to it
RAISED = 1.1  # times the share by which runs seem to differ: then an effect of that size is taken for such a difference
READINGS = 10  # of a loop, or what loops share cannot be told from their noise
SPREAD = 0.1  # likeness of the units of one run above which they cannot count as independent; noise alone: below 0


@dataclass(frozen=True)
class FlipGroups:
    """What is flipped as a whole: a number for each row, the test's level, and in words."""

    number: np.ndarray
    level: float
    words: str
    together: np.ndarray  # rows with equal numbers may err together: whole loops and points, else whole runs
    trusted: bool = True  # false where the units are blocks of samples and the verdict rests on the noise model

    @property
    def count(self) -> int:
        """How many."""
        return int(self.number.max()) + 1

    def runs(self, samples: Samples) -> np.ndarray:
        """The run of each unit."""
        run = np.empty(self.count, int)
        run[self.number] = samples.run
        return run


def numbered(*keys: np.ndarray) -> np.ndarray:
    """Rows with equal keys get equal numbers, in order."""
    return np.unique(np.stack(keys), axis=1, return_inverse=True)[1]


def flip_groups(samples: Samples, memory: float) -> FlipGroups:
    """Whole loops; half loops of a kind of test that has few; where all are few, blocks of samples within a branch."""
    few = few_loops(samples)
    number = loops_or_halves(samples, few)
    count, halves = number.max() + 1, numbered(samples.run, samples.half)
    if count < ENOUGH:
        return _blocks(samples, halves, memory)
    together = numbered(samples.run, np.where(few, 0, 1 + samples.loop))
    words = f"signs of {count} {_in_words(few, omnibus.kinds(samples) == omnibus.POINTS)}"
    return FlipGroups(number, LEVEL, words, together)


def _in_words(few: np.ndarray, points: np.ndarray) -> str:
    kinds = {"loops": ~few & ~points, "half loops": few & ~points, "single points": points}
    words = " and ".join(name for name, rows in kinds.items() if rows.any())
    scarce = few & ~points
    reason = ("", ": one kind of test has few", ": few loops")[int(scarce.any()) + int(scarce.all())]
    return f"{words} flipped{reason}"


def few_loops(samples: Samples) -> np.ndarray:
    """Rows of a kind of test of which there are few loops, a mask.

    What only loops show cannot be seen in a few of them, however many isometric cycles stand beside them.
    """
    loops, kind = numbered(samples.run, samples.loop), omnibus.kinds(samples)
    few = np.zeros(len(samples), bool)
    for each in np.unique(kind):
        few[kind == each] = len(np.unique(loops[kind == each])) < ENOUGH
    return few


def loops_or_halves(samples: Samples, few: np.ndarray) -> np.ndarray:
    """The number of each row's loop, or of its half of one where there are `few`."""
    return numbered(samples.run, few, np.where(few, samples.half, samples.loop))


def _blocks(samples: Samples, halves: np.ndarray, memory: float) -> FlipGroups:
    """As long as the noise remembers, but not across turning points."""
    size = int(max(20, np.ceil(8 * (1 + memory) / max(1 - memory, 1e-3))))
    place = np.concatenate([np.arange(n) for n in np.bincount(halves)])
    order = np.argsort(halves, kind="stable")
    within = np.empty(len(halves), int)
    within[order] = place
    blocks = numbered(halves, within // size)
    words = (
        f"signs of {blocks.max() + 1} blocks of {size} samples flipped: too few loops, this rests on the noise model"
    )
    return FlipGroups(blocks, FEW_LEVEL, words, samples.run, trusted=False)


@dataclass(frozen=True)
class Verdict:
    """The test of one fitted model: is anything missing from it?"""

    p: float  # least of flips of units, of whole runs, and of differences between runs, each by its share of the level
    p_runs: float  # by flips of whole runs, which may differ as they like; 1 where they are too few
    spread: float  # how alike the units of one run err, beyond what all runs share
    apart: float  # rms of what is left when runs differ as far as they may
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

    @property
    def rejected(self) -> bool:
        """Whether something is missing, by `p` or because the misfit is many times the noise."""
        in_turn = self.p < self.level and not self.runs_differ
        many = self.rms > MANY * self.floor and self.ratio_p < MISFIT_P
        return in_turn or many or self.apart > MANY * self.inside

    @property
    def runs_differ(self) -> bool:
        """Whether a spread from run to run explains as well what flips of smaller units reject.

        It is no excuse for many times the noise: then what differs between runs, the pressure or the speed, does what
        the model does not know.
        """
        small = self.rms <= MANY * self.inside
        return self.p < self.level <= self.p_runs and self.spread > SPREAD and small


@dataclass(frozen=True)
class Ground:
    """What a test rests on: the samples, what of them is flipped as a whole, the bases, the noise, a seed for signs."""

    samples: Samples
    flip_groups: FlipGroups
    basis: Basis
    noise: Noise
    seed: int

    @cached_property
    def run(self) -> np.ndarray:
        """The run of each row, from 0."""
        return numbered(self.samples.run)

    @property
    def runs_flip(self) -> bool:
        """Whether there are enough runs to flip them whole."""
        return not too_few(self.samples, self.flip_groups.level / 2)

    def white(self, rows: np.ndarray, same: Nuisance, apart: Nuisance, signatures: np.ndarray) -> "White":
        """All that is tested, free of the correlation that the noise model knows of."""
        parts = [rows[:, None], same.slopes, apart.slopes, signatures, self.basis.smooth, self.basis.fine]
        flat = whitened(np.hstack(parts), self.samples, self.flip_groups.together, self.noise)
        e, j, j_between_runs, z, smooth, fine = np.split(
            flat, np.cumsum([part.shape[1] for part in parts])[:-1], axis=1
        )
        return White(e, j, j_between_runs, apart.group, z, Basis(smooth, fine))


@dataclass(frozen=True)
class White:
    """Rows (rows, 1), slopes of one model for all runs and for each its own, candidates and bases: not correlated."""

    e: np.ndarray
    j: np.ndarray
    j_between_runs: np.ndarray
    group: np.ndarray  # of each column of `j_apart`, as in `Yielding`
    z: np.ndarray
    basis: Basis

    @cached_property
    def common_or_smooth(self) -> np.ndarray:
        """An orthonormal basis of what is common to all runs or smooth."""
        return orthonormal(np.hstack([self.j, self.basis.whole]))

    def project_out_differences(self, by: Nuisance, as_seen: bool = True) -> Projected:
        """What is left when runs may differ: by as much as these do, or by as much as any may."""
        own = (
            as_far_as_seen(self.j_between_runs, self.group, self.e[:, 0], self.common_or_smooth)
            if as_seen
            else self.j_between_runs
        )
        return projected(self.e[:, 0], own, self.z, self.basis, by)

    def taken_for_difference(self, amount: np.ndarray) -> np.ndarray:
        """Which of the candidates, so much of each added, would make runs seem to differ by more than they do."""
        added = self.z * np.where(np.isfinite(amount), amount, 0.0)
        now, then = (
            shares_seen(self.j_between_runs, self.group, rows, self.common_or_smooth)
            for rows in (self.e, self.e + added)
        )
        raised = [then[each] > RAISED * now[each] for each in now]
        return np.any(raised, axis=0) if raised else np.zeros(added.shape[1], bool)


def judged(
    rows: np.ndarray, same: Nuisance, apart: Nuisance, signatures: np.ndarray, ground: Ground, limits: bool = False
) -> Verdict:
    """Test a fitted model against candidate `signatures` (rows, candidates) and the bases that know no effect.

    Three tests, of which any may reject. Groups smaller than a run are flipped after the model has given way `apart`,
    with parameters a little different in every run; where there are enough runs, whole runs are flipped after it has
    given way as the `same` in all, at half the level; and runs must not have to differ by more than they may. With
    `limits` it is also said how much of each candidate would be found.
    """
    groups, seed, white = ground.flip_groups, ground.seed, ground.white(rows, same, apart, signatures)
    common, own = projected(white.e[:, 0], white.j, white.z, white.basis, same), white.project_out_differences(apart)
    by_group = _scores(own, groups.number).under(flipped_signs(groups.count, seed))
    p_runs = 1.0
    if ground.runs_flip:
        p_runs = _scores(common, ground.run).under(flipped_signs(ground.run.max() + 1, seed)).p
    found = explained = np.full(signatures.shape[1], np.nan)
    if limits:
        free = white.project_out_differences(apart, as_seen=False)
        found, explained = _limits(ground, white, common, own, free), free.explained
    return Verdict(
        p=min(by_group.p, 2 * p_runs, max(own.differ_p * groups.level / DENIED_P, 1 / (1 + FLIPS)), 1.0),
        p_runs=p_runs,
        apart=float(np.sqrt(np.mean(apart.left_at_most(rows) ** 2))),
        inside=_noise_inside(rows, ground),
        spread=similarity_within_runs(
            _by_group(common.o * common.clean[:, None], groups.number), groups.runs(ground.samples)
        ),
        p_effects=by_group.p_effects,
        p_omnibus=by_group.p_omnibus,
        ratio_p=own.ratio_p,
        floor=_floor(rows, np.hstack([ground.basis.whole, same.slopes])),
        detectable=found,
        explained=explained,
        left=common.kept / np.maximum(np.linalg.norm(white.z, axis=0), 1e-300),
        cosines=(common.z / common.kept).T @ (common.z / common.kept),
        rms=float(np.sqrt(np.mean(rows**2))),
        level=groups.level,
    )


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
        if 1 < loops <= count / READINGS:
            shared = orthonormal(ground.basis.smooth[mine])
            noise += np.sum((rows[mine] - shared @ (shared.T @ rows[mine])) ** 2) * loops / (loops - 1)
            known += count
    return max(float(np.sqrt(noise / known)), 1.0) if known >= len(rows) / 2 else float("inf")


def _limits(ground: Ground, white: White, common: Projected, own: Projected, free: Projected) -> np.ndarray:
    """The amount of each candidate that one of the three tests would find.

    What is taken for a difference between runs is found only beside all the difference that is allowed (`free`).
    """
    groups, seed = ground.flip_groups, ground.seed
    found = _found(own, groups.number, groups.level / 2, seed)
    taken = white.taken_for_difference(found)
    if taken.any():
        found = np.where(taken, _found(free, groups.number, groups.level / 2, seed), found)
    found = np.minimum(found, free.denied)
    if ground.runs_flip:
        found = np.minimum(found, _found(common, ground.run, groups.level / 4, seed))
    return found


def _scores(what: Projected, number: np.ndarray) -> "_Scores":
    """Unit by unit."""
    effects = np.where(what.seen, _by_group(what.z * what.e[:, None], number) / what.kept, 0.0)
    omnibus = _by_group(what.o * what.e[:, None], number)
    return _Scores(effects, what.dull, omnibus[:, : what.smooth], omnibus[:, what.smooth :])


def _found(what: Projected, number: np.ndarray, level: float, seed: int) -> np.ndarray:
    """The amount of each candidate that flips of these units find."""
    alone = what.clean * np.sqrt(len(what.e) / what.freedom)
    signs = flipped_signs(number.max() + 1, seed)
    return what.dull * detectable(what.z / what.kept, alone, number, signs, level, seed) / what.kept


@dataclass(frozen=True)
class _Scores:
    """Of every candidate (units, candidates) and of the omnibus bases (units, q)."""

    effects: np.ndarray
    dull: np.ndarray
    smooth: np.ndarray
    fine: np.ndarray

    def under(self, signs: np.ndarray) -> "_Chance":
        """The largest of all candidates, and the omnibus sums, compared with what flips (flips, units) make of them.

        Half the level is for the candidates, a quarter for either omnibus basis.
        """
        seen = np.abs(self.effects.sum(0)) / self.dull
        top = np.abs(signs @ self.effects).max(axis=1, initial=0.0)
        p_omnibus = min(1.0, 2 * min(_share_of_sum(self.smooth, signs), _share_of_sum(self.fine, signs)))
        p_effects = np.array([_share(top, value) for value in seen])
        return _Chance(float(min(1.0, 2 * min(p_effects.min(initial=1.0), p_omnibus))), p_effects, p_omnibus)


@dataclass(frozen=True)
class _Chance:
    p: float
    p_effects: np.ndarray
    p_omnibus: float


def similarity_within_runs(scores: np.ndarray, run: np.ndarray) -> float:
    """How alike the scores (units, q) of one run's units are, beyond what all runs share: 0 for noise, 1 for a spread.

    `scores` are of rows from which the smooth misfit that runs have in common is removed. A parameter that differs from
    run to run leaves the same trace in all units of a run; then these do not err independently.
    """
    pairs = (run[:, None] == run[None, :]) & ~np.eye(len(run), dtype=bool)
    products, squares = scores @ scores.T, np.sum(scores**2, axis=1)
    both = 0.5 * (squares[:, None] + squares[None, :])
    return float(products[pairs].sum() / both[pairs].sum()) if pairs.any() and both[pairs].sum() > 0 else 0.0


def flipped_signs(units: int, seed: int) -> np.ndarray:
    """Signs (flips, units), the first as measured; all that differ by more than one sign for all, or a draw of them."""
    random = np.random.default_rng(seed)
    units = int(units)  # numpy's integers would overflow below
    if 2 ** (units - 1) > 1 + FLIPS:
        return np.vstack([np.ones(units), random.choice([-1.0, 1.0], size=(FLIPS, units))])
    bits = np.arange(2 ** (units - 1))[:, None] >> np.arange(units)
    return np.vstack([np.ones(units), random.permutation(1.0 - 2.0 * (bits[1:] & 1))])


def _by_group(products: np.ndarray, number: np.ndarray) -> np.ndarray:
    sums = np.zeros((number.max() + 1, products.shape[1]))
    np.add.at(sums, number, products)
    return sums


def _share_of_sum(scores: np.ndarray, signs: np.ndarray) -> float:
    """How often flips reach the sum of squares of these scores (units, q); 1 where there are none."""
    return _share(np.sum((signs @ scores) ** 2, axis=1), np.sum(scores.sum(0) ** 2))


def _share(flipped: np.ndarray, seen: float) -> float:
    return float(np.mean(flipped >= seen * (1 - 1e-9)))  # one of the flips is what was measured
