"""Is anything missing? Scores of every candidate, and of a basis that knows none, with signs flipped loop by loop.

Only the mean has to be right: errors may be correlated within a unit, drift, and differ in size between units
(Hemerik, Goeman & Finos 2020; Canay, Romano & Shaikh 2017). The flips are the same for all candidates and all their
hidden shapes, so the largest score of many is compared with the largest of many.
"""

from dataclasses import dataclass

import numpy as np
from scipy import stats

from fitting.detection import detectable
from fitting.residuals import Samples
from fitting.working_noise import Noise, orthonormal, removed, whitened

FLIPS = 1999
LEVEL = 0.01
FEW_LEVEL = 0.005
ENOUGH = 12  # units below which smaller ones are flipped
MANY = 2.5  # times the noise: so much misfit is a misfit, though flips may be blind to it
SPREAD = 0.1  # likeness of the units of one run above which they cannot count as independent; noise alone: below 0


@dataclass(frozen=True)
class Units:
    """What is flipped as a whole: a number for each row, the test's level, and in words."""

    number: np.ndarray
    level: float
    words: str
    trusted: bool  # false where the units are blocks of samples and the verdict rests on the noise model

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


def units(samples: Samples, memory: float) -> Units:
    """Whole loops; where they are few, half loops; where those are few, blocks of samples within a branch."""
    loops, halves = numbered(samples.run, samples.loop), numbered(samples.run, samples.half)
    if ENOUGH <= loops.max() + 1 == len(samples):
        return Units(loops, LEVEL, f"signs of {len(samples)} single points flipped", True)
    if loops.max() + 1 >= ENOUGH:
        return Units(loops, LEVEL, f"signs of {loops.max() + 1} loops flipped", True)
    if halves.max() + 1 >= ENOUGH:
        return Units(halves, LEVEL, f"signs of {halves.max() + 1} half loops flipped: few loops", True)
    size = int(max(20, np.ceil(8 * (1 + memory) / max(1 - memory, 1e-3))))
    place = np.concatenate([np.arange(n) for n in np.bincount(halves)])
    order = np.argsort(halves, kind="stable")
    within = np.empty(len(halves), int)
    within[order] = place
    blocks = numbered(halves, within // size)
    words = (
        f"signs of {blocks.max() + 1} blocks of {size} samples flipped: too few loops, this rests on the noise model"
    )
    return Units(blocks, FEW_LEVEL, words, False)


@dataclass(frozen=True)
class Verdict:
    """The test of one fitted model: is anything missing from it?"""

    p: float
    p_runs: float  # the same, had only whole runs been flipped
    spread: float  # how alike the units of one run err, beyond what all runs share
    p_effects: np.ndarray  # of each candidate column, corrected for all
    p_omnibus: float
    ratio_p: float  # likelihood ratio of the omnibus basis under the noise model
    floor: float  # rms of the rows without what the basis explains, in standard deviations
    detectable: np.ndarray  # the amount of each candidate column that the test would find, if asked; infinite: none
    left: np.ndarray  # share of each column, whitened, that the model's parameters leave
    cosines: np.ndarray  # between the columns after that
    rms: float
    level: float

    @property
    def rejected(self) -> bool:
        """Whether something is missing, by flips or because the misfit is many times the noise."""
        by_flips = self.p < self.level and not self.runs_differ
        return by_flips or (self.rms > MANY * self.floor and self.ratio_p < 1e-3)

    @property
    def runs_differ(self) -> bool:
        """Whether a spread of parameters from run to run explains as well what flips of smaller units reject."""
        return self.p < self.level <= self.p_runs and self.spread > SPREAD


def test(
    rows: np.ndarray,
    slopes: np.ndarray,
    prior_rows: np.ndarray,
    prior_slopes: np.ndarray,
    signatures: np.ndarray,
    basis: np.ndarray,
    samples: Samples,
    unit: Units,
    noise: Noise,
    seed: int,
    limits: bool,
) -> Verdict:
    """Test a fitted model against candidate `signatures` (rows, candidates) and the omnibus `basis` (rows, q).

    With `limits` it also says how much of each candidate would be found.
    """
    plain_floor = float(np.sqrt(np.mean(removed(rows[:, None], np.hstack([basis, slopes])) ** 2)))
    k, m = slopes.shape[1], signatures.shape[1]
    together = unit.number if unit.trusted else samples.run  # neighbouring blocks err together, loops hardly do
    stacked = whitened(np.hstack([rows[:, None], slopes, signatures, basis]), samples, together, noise)
    e, j, z, o = stacked[:, 0], stacked[:, 1 : 1 + k], stacked[:, 1 + k : 1 + k + m], stacked[:, 1 + k + m :]
    curvature = np.linalg.pinv(j.T @ j + prior_slopes.T @ prior_slopes, rcond=1e-13, hermitian=True)
    step = curvature @ (j.T @ e + prior_slopes.T @ prior_rows)  # to the optimum of the whitened rows
    e = e - j @ step
    z_left, z_prior = _beside(z, j, curvature, prior_slopes)
    o_left = orthonormal(_beside(o, j, curvature, prior_slopes)[0])
    kept = np.maximum(np.linalg.norm(z_left, axis=0), 1e-300)
    scores = _Scores(
        np.where(kept > 1e-6 * np.linalg.norm(z, axis=0), _by_unit(z_left * e[:, None], unit) / kept, 0.0),
        z_prior.T @ (prior_rows - prior_slopes @ step) / kept,
        _by_unit(o_left * e[:, None], unit),
    )
    clean = e - o_left @ (o_left.T @ e)
    run = unit.runs(samples)
    signs = np.random.default_rng(seed).choice([-1.0, 1.0], size=(FLIPS, unit.count))
    by_unit, by_run = scores.under(signs), scores.under(signs[:, np.unique(run, return_inverse=True)[1]])
    q, freedom = np.sum(scores.omnibus.sum(0) ** 2), max(len(e) - k - o_left.shape[1], 1)
    ratio = (q / o_left.shape[1]) / (max(np.sum(e**2) - q, 1e-300) / freedom)
    found = np.full(m, np.nan)
    if limits:
        alone = clean * np.sqrt(len(e) / freedom)
        found = detectable(z_left / kept, alone, unit.number, signs, unit.level / 2, seed) / kept
    return Verdict(
        p=by_unit.p,
        p_runs=by_run.p,
        spread=alike_within(_by_unit(o_left * clean[:, None], unit), run),
        p_effects=by_unit.p_effects,
        p_omnibus=by_unit.p_omnibus,
        ratio_p=float(stats.f.sf(ratio, o_left.shape[1], freedom)),
        floor=plain_floor,
        detectable=found,
        left=kept / np.maximum(np.linalg.norm(z, axis=0), 1e-300),
        cosines=(z_left / kept).T @ (z_left / kept),
        rms=float(np.sqrt(np.mean(rows**2))),
        level=unit.level,
    )


@dataclass(frozen=True)
class _Scores:
    """Of every candidate (units, candidates) and of the omnibus basis (units, q); `prior` is what never flips."""

    effects: np.ndarray
    prior: np.ndarray
    omnibus: np.ndarray

    def under(self, signs: np.ndarray) -> "_Chance":
        """The largest of all candidates, and the omnibus sum, compared with what flips (flips, units) make of them."""
        seen = np.abs(self.effects.sum(0) + self.prior)
        top = np.abs(signs @ self.effects + self.prior).max(axis=1, initial=0.0)
        q = np.sum(self.omnibus.sum(0) ** 2)
        p_omnibus = _share(np.sum((signs @ self.omnibus) ** 2, axis=1) >= q)
        p_effects = np.array([_share(top >= value) for value in seen])
        return _Chance(float(min(1.0, 2 * min(p_effects.min(initial=1.0), p_omnibus))), p_effects, p_omnibus)


@dataclass(frozen=True)
class _Chance:
    p: float
    p_effects: np.ndarray
    p_omnibus: float


def alike_within(scores: np.ndarray, run: np.ndarray) -> float:
    """How alike the scores (units, q) of one run's units are, beyond what all runs share: 0 for noise, 1 for a spread.

    `scores` are of rows from which the smooth misfit that runs have in common is removed. A parameter that differs from
    run to run leaves the same trace in all units of a run; then these do not err independently.
    """
    pairs = (run[:, None] == run[None, :]) & ~np.eye(len(run), dtype=bool)
    products, squares = scores @ scores.T, np.sum(scores**2, axis=1)
    both = 0.5 * (squares[:, None] + squares[None, :])
    return float(products[pairs].sum() / both[pairs].sum()) if pairs.any() and both[pairs].sum() > 0 else 0.0


def _beside(
    columns: np.ndarray, slopes: np.ndarray, curvature: np.ndarray, prior_slopes: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """What the model's parameters, held by their priors, leave of columns; and what falls on the prior rows."""
    taken = curvature @ (slopes.T @ columns)
    return columns - slopes @ taken, -prior_slopes @ taken


def _by_unit(products: np.ndarray, unit: Units) -> np.ndarray:
    sums = np.zeros((unit.count, products.shape[1]))
    np.add.at(sums, unit.number, products)
    return sums


def _share(at_least: np.ndarray) -> float:
    return float((1 + np.sum(at_least)) / (1 + len(at_least)))
