"""How far apart explanations predict a recording, and how often the test would then reject the wrong one.

The discrepancy of two explanations is what is left of their difference when both may give way as far as the old data
let them: (f_i - f_j)' (V + J_i C_i J_i' + J_j C_j J_j')^-1 (f_i - f_j), V the covariance of the new readings
(Box & Hill 1967). The power is counted, not derived: recordings are drawn from one explanation, the other is refitted
to old and new rows together, and its signs are flipped loop by loop as in the diagnosis.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.linalg import cholesky, solve_triangular

from fitting.diagnosis import flip_groups, omnibus
from fitting.diagnosis.flip_groups import FlipGroups
from fitting.diagnosis.settings import FLIP_TEST
from fitting.instruments.errors import InstrumentErrors
from fitting.least_squares.working_noise import Noise, Whitener, noise_from
from fitting.planning.predictions import Candidates, Explained
from fitting.planning.rejection import Drawn
from fitting.planning.settings import COUNTS
from fitting.problem.kinds import kinds
from fitting.problem.residuals import Samples


@dataclass(frozen=True)
class Readings:
    """How the readings of a new recording will err, and how many of them the test will see."""

    stride: float  # readings from one such sample to the next
    interval: float  # s between readings
    most: float  # readings of one loop that the test keeps

    def covariance(self, noise: Noise, samples: Samples) -> tuple[np.ndarray, float]:
        """Covariance of one cycle's nodes, each the mean of the readings around it, and how many these are."""
        count = len(samples)
        step = float(np.median(np.diff(samples.time)))  # s from node to node; a map has no times
        if step == 0 or len(np.unique(samples.loop)) > 1:  # points without history err one by one
            return (noise.white + noise.shares.sum()) * np.eye(count), 1.0
        kept = min(step / self.interval, self.most / count)  # readings per node
        memory = noise.memories ** (step / self.interval / kept / self.stride)
        apart = np.abs(samples.time[:, None] - samples.time[None, :]) / step * kept
        total = noise.white / kept * np.eye(count)
        for share, phi in zip(noise.shares, memory, strict=True):
            if share > 0:
                total = total + share * of_means(apart, phi, max(kept, 1.0))
        return total, kept


def of_means(apart: np.ndarray, phi: float, m: float) -> np.ndarray:
    """Correlation of means over m neighbours of a first-order autoregression, their centres this far apart."""
    across = (1 - phi**m) / (m * (1 - phi))
    own = (1 + phi) / (1 - phi) / m - 2 * phi * (1 - phi**m) / (m * (1 - phi)) ** 2
    between = phi ** np.maximum(apart - m + 1, 0.0) * across**2
    return np.where(apart == 0, own * (1 + 1e-9), between)


@dataclass(frozen=True)
class Outlook:
    """Explanations in rows without correlation: what they leave of the old data, what they predict."""

    planned: Candidates
    explained: tuple[Explained, ...]
    noise: Noise
    readings: Readings

    @cached_property
    def old_samples(self) -> Samples:
        """Where the measured rows come from."""
        return self.planned.samples.where(self.planned.old)

    @cached_property
    def old_loops(self) -> np.ndarray:
        """Number of the loop of each measured row."""
        return flip_groups.numbered(self.old_samples.run, self.old_samples.loop)

    @cached_property
    def old_white(self) -> Whitener:
        """Takes the correlation out of measured rows, loop by loop."""
        return Whitener.of(self.noise, self.old_samples, self.old_loops)

    @cached_property
    def known(self) -> tuple[np.ndarray, ...]:
        """What the old data and the priors know of each explanation's parameters (information matrices)."""
        return tuple(_information(self.old_white(e.slopes[self.planned.old]), e.prior_slopes) for e in self.explained)

    @cached_property
    def factors(self) -> tuple[tuple[np.ndarray, float], ...]:
        """Of each candidate's cycle: factor of the covariance, readings per node."""
        made = []
        for number, rows in enumerate(self.planned.rows):
            again = self.planned.again(number)
            covariance, mean_of = self.readings.covariance(self.noise, self.planned.samples.where(rows[again]))
            made.append((cholesky(covariance, lower=True), mean_of))
        return tuple(made)

    def new(self, number: int, columns: np.ndarray, repeats: int | None = None) -> np.ndarray:
        """A candidate's rows without correlation: both cycles, the second as often as it is repeated.

        Without `repeats` each cycle comes once.
        """
        rows, again = self.planned.rows[number], self.planned.again(number)
        factor = self.factors[number][0]
        first, later = (solve_triangular(factor, columns[rows[part]], lower=True) for part in (~again, again))
        return np.concatenate([first, *[later] * (1 if repeats is None else repeats - 1)])

    def discrepancy(self, one: int, other: int, number: int, repeats: int) -> float:
        """How far two explanations lie apart in a candidate, in squared standard errors."""
        a, b = self.explained[one], self.explained[other]
        columns = np.hstack([(a.rows - b.rows)[:, None], a.slopes, -b.slopes])
        white = self.new(number, columns)
        half = len(white) // 2
        white[half:] *= np.sqrt(max(repeats - 1, 0))
        difference, slopes = white[:, 0], white[:, 1:]
        k = a.slopes.shape[1]
        known = np.zeros((slopes.shape[1],) * 2)
        known[:k, :k], known[k:, k:] = self.known[one], self.known[other]
        pull = slopes.T @ difference
        return float(difference @ difference - pull @ np.linalg.solve(known + slopes.T @ slopes, pull))

    def conceded(self, wrong: int, number: int, readings: np.ndarray) -> Explained:
        """An explanation refitted to the old data and to readings of a candidate (cycles, nodes)."""
        target = np.zeros(len(self.planned.samples))
        weight = np.zeros(len(target))
        rows, again = self.planned.rows[number], self.planned.again(number)
        weight[self.planned.old] = 1.0
        weight[rows] = np.sqrt(self.factors[number][1] * np.where(again, len(readings) - 1, 1))
        target[rows[~again]], target[rows[again]] = readings[0], readings[1:].mean(axis=0)
        return self.explained[wrong].fitted(target, weight)

    def predicted(self, truth: int, number: int, repeats: int) -> np.ndarray:
        """What an explanation predicts of a candidate's nodes (cycles, nodes), in standard deviations."""
        rows, again = self.planned.rows[number], self.planned.again(number)
        first, later = (self.explained[truth].rows[rows[part]] for part in (~again, again))
        return np.stack([first, *[later] * (repeats - 1)])

    def power(self, truth: int, wrong: int, number: int, repeats: int, seed: int = 0) -> float:
        """Share of drawn recordings after which the wrong explanation is rejected, the truth being the other.

        Readings are drawn with their noise and the errors that instruments make anew in every run, and the true
        explanation's parameters with what the old data leave open.
        """
        readings = self.predicted(truth, number, repeats)
        given = self.conceded(wrong, number, readings)
        random = np.random.default_rng([seed, truth, wrong, number])
        steep = self.new(number, self.explained[truth].slopes, repeats)
        left_open = np.linalg.pinv(self.known[truth], hermitian=True) + 1e-12 * np.eye(steep.shape[1])
        drift = steep @ (np.linalg.cholesky(left_open) @ random.standard_normal((steep.shape[1], COUNTS.draws)))
        laid = self._laid(given, number, readings)
        noise = random.standard_normal((readings.size, COUNTS.draws))
        own = laid.errors.per_run[laid.old :]
        noise += own @ random.standard_normal((own.shape[1], COUNTS.draws))
        rows = np.repeat(laid.rows, COUNTS.draws, axis=1)
        rows[laid.old :] += noise - drift
        counted = np.sum(replace(laid, rows=rows).rejections(seed))
        return float((counted + 0.5) / (COUNTS.draws + 1))  # a hundred draws do not show certainty

    def rejected(self, number: int, readings: np.ndarray, seed: int = 0) -> tuple[bool, ...]:
        """Which explanations the test rejects once a candidate was recorded.

        `readings` (cycles, nodes) are means of what was read around each node, in standard deviations of one reading.
        """
        fitted = [self.conceded(i, number, readings) for i in range(len(self.explained))]
        laid = [self._laid(given, number, readings) for given in fitted]
        return tuple(bool(one.rejections(seed)[0]) for one in laid)

    def _flip_groups(self, number: int, repeats: int) -> FlipGroups:
        """What is flipped over old and new rows: as `flip_groups`, where the new ones have come to the old."""
        rows = self.planned.rows[number]
        cycle = self.planned.samples.where(rows[self.planned.again(number)])
        alike = kinds(self.old_samples) == kinds(cycle)[0]
        loops = len(np.unique(self.old_loops[alike])) + len(np.unique(cycle.loop)) * repeats
        few = np.where(alike, loops < FLIP_TEST.fewest_groups, flip_groups.few_loops(self.old_samples))
        old = flip_groups.loops_or_halves(self.old_samples, few)
        own = np.unique(cycle.half if loops < FLIP_TEST.fewest_groups else cycle.loop, return_inverse=True)[1]
        new = np.concatenate([own + turn * (own.max() + 1) for turn in range(repeats)]) + old.max() + 1
        both = np.concatenate([old, new])
        trusted = both.max() + 1 >= FLIP_TEST.fewest_groups
        together = flip_groups.numbered(
            self.old_samples.run, np.where(few | (not trusted), 0, 1 + self.old_samples.loop)
        )
        return FlipGroups(both, FLIP_TEST.level if trusted else FLIP_TEST.level_of_blocks, together)

    def _laid(self, given: Explained, number: int, readings: np.ndarray) -> Drawn:
        """Old and new rows of a refitted explanation without correlation, and what the test looks along."""
        rows, repeats, old = self.planned.rows[number], len(readings), len(self.planned.old)
        groups, basis = self._flip_groups(number, repeats), self._basis(rows)
        others = [(e.rows - given.rows)[:, None] for e in self.explained if e.effects != given.effects]
        used = self._used(rows)
        errors = given.errors(self.planned, used)
        felt = [_spread(errors.per_run, used), _spread(errors.shared, used)]
        parts = [given.rows[:, None], given.slopes, *felt, np.hstack(others), basis.smooth, basis.fine]
        columns = np.hstack(parts)
        white = Whitener.of(self.noise, self.old_samples, groups.together)
        both = np.concatenate([white(columns[self.planned.old]), self.new(number, columns, repeats)])
        factor = self.factors[number][0]
        both[old:, 0] -= solve_triangular(factor, readings.T, lower=True).T.ravel()
        e, j, own, shared, z, smooth, fine = np.split(both, np.cumsum([part.shape[1] for part in parts])[:-1], axis=1)
        run = np.concatenate([self.old_samples.run, np.full(len(both) - old, -1)])
        made = InstrumentErrors(own, shared, errors.sources_per_run, errors.sources_shared, run)
        return Drawn(e, j, given.prior_slopes, made, z, omnibus.Basis(smooth, fine), groups, old)

    def _used(self, rows: np.ndarray) -> np.ndarray:
        """Which rows are old ones or these (a mask)."""
        used = np.zeros(len(self.planned.samples), bool)
        used[self.planned.old] = used[rows] = True
        return used

    def _basis(self, rows: np.ndarray) -> omnibus.Basis:
        """The bases that know no effect, over all rows: the old ones' and this candidate's."""
        used = self._used(rows)
        found = omnibus.basis(self.planned.samples.where(used))
        return omnibus.Basis(_spread(found.smooth, used), _spread(found.fine, used))


def _spread(part: np.ndarray, used: np.ndarray) -> np.ndarray:
    """Columns of some rows (a mask) among zeros."""
    whole = np.zeros((len(used), part.shape[1]))
    whole[used] = part
    return whole


def _information(slopes: np.ndarray, prior_slopes: np.ndarray) -> np.ndarray:
    return slopes.T @ slopes + prior_slopes.T @ prior_slopes


def noise_of_test(explained: Explained, planned: Candidates) -> Noise:
    """The working noise model, from what neither the parameters nor the smooth basis explain of the old rows."""
    samples = planned.samples.where(planned.old)
    beside = np.hstack([omnibus.basis(samples).whole, explained.slopes[planned.old]])
    return noise_from(explained.rows[planned.old], beside, samples)
