"""By how much runs differ at most, as their recordings show it: what nobody stated is not taken for larger than that.

What the friction of a muscle or the gain of a cell differs by from run to run is presumed where it is not stated. Two
per cent of a drag that gives half the force would move readings by thirty times their noise. Where the runs of a
recording agree to their noise, they show that they do not differ so much, and errors of parameters that rest on such a
difference would be stated dozens of times too large.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from fitting.instruments.errors import InstrumentErrors
from fitting.instruments.sources import Source


@dataclass(frozen=True)
class DifferenceSettings:
    """Settings of what runs show of their differences."""

    doubted: float = 1.353  # of a log-likelihood: beyond it a size is above the one-sided bound of 95 %; derived
    smallest: float = 1e-3  # of what is presumed: nothing smaller is looked for; chosen
    steps: int = 31  # sizes that are tried, equally apart in their logarithms: a quarter from one to the next; chosen
    rounding: float = 1e-12  # of a matrix of unit columns; derived


SETTINGS = DifferenceSettings()


def as_runs_show(
    errors: InstrumentErrors, group: np.ndarray, data: np.ndarray, rows: np.ndarray, priors: np.ndarray
) -> InstrumentErrors:
    """The errors, those that are presumed of each run made as small as the upper bound that the runs set to them."""
    return _made_smaller(errors, group, bounds(errors, group, data, rows, priors))


def bounds(
    errors: InstrumentErrors, group: np.ndarray, data: np.ndarray, rows: np.ndarray, priors: np.ndarray
) -> dict[tuple[Source, int], float]:
    """What runs show of each error that is presumed of each run: the largest share of its size that agrees with them.

    `data` (rows, k) and `priors` are slopes of the free parameters in standard deviations, `rows` what a fit leaves,
    that of priors last. The bound is that of 95 % by the restricted likelihood (Patterson & Thompson 1971), in which
    parameters and all other errors have their freedom; what differs from run to run and is no error bounds little.
    There is one for each `group` (rows,): the runs of one muscle say nothing of another's.
    """
    presumed = dict.fromkeys(each for each in errors.sources_per_run if each.presumed)
    if not presumed:
        return {}
    try:
        runs, first = _Runs.of(errors, data, rows, priors), np.unique(errors.run, return_index=True)[1]
    except np.linalg.LinAlgError:  # of numbers that are not finite: what changes readings by 1e140 bounds nothing
        return {}
    sizes, found = np.ones(runs.own.shape[:2]), {}
    for source in presumed:
        for one in np.unique(group).tolist():
            mine = np.equal(group[first], one)[:, None] & _columns_of(errors, source)  # (runs, errors)
            found[source, one] = _bound(runs, sizes, mine)
            sizes[mine] = found[source, one]
    return found


def _made_smaller(
    errors: InstrumentErrors, group: np.ndarray, shares: Mapping[tuple[Source, int], float]
) -> InstrumentErrors:
    per_run = errors.per_run
    for (source, one), share in shares.items():
        mine = np.equal(group, one)[:, None] & _columns_of(errors, source)
        per_run = per_run * np.where(mine, share, 1.0)
    return errors.changed(per_run, errors.shared)


def _columns_of(errors: InstrumentErrors, source: Source) -> np.ndarray:
    """Which columns (e,) of single runs are of a presumed source."""
    return np.array([each == source and each.presumed for each in errors.sources_per_run], dtype=bool)


def _bound(runs: "_Runs", sizes: np.ndarray, mine: np.ndarray) -> float:
    """The largest share of the presumed size of the errors `mine` (runs, e) that is not doubted, at most 1.

    The others have the `sizes` (runs, e) that they have.
    """
    shares, varied = np.geomspace(1.0, SETTINGS.smallest, SETTINGS.steps), np.asarray(mine.any(axis=1))
    tried = np.where(mine[varied], shares[:, None, None], sizes[varied])
    with np.errstate(over="ignore", invalid="ignore"):
        try:
            likely = runs.settled(~varied, sizes).log_likelihoods(tried)
        except np.linalg.LinAlgError:  # of numbers that are not finite
            return 1.0
    believed = np.flatnonzero(likely >= likely.max() - SETTINGS.doubted)
    return float(shares[believed[0]]) if np.isfinite(likely).all() else 1.0


@dataclass(frozen=True)
class _Runs:
    """Products of all that is needed, run by run, in units of the noise that is left where everything is free."""

    whole: np.ndarray  # (q, q) of parameters and shared errors, and last of the rows
    known: np.ndarray  # (q, q) what priors add
    own: np.ndarray  # (runs, e, e) of the errors of each run
    across: np.ndarray  # (runs, e, q)

    @classmethod
    @np.errstate(over="ignore", invalid="ignore")
    def of(cls, errors: InstrumentErrors, data: np.ndarray, rows: np.ndarray, priors: np.ndarray) -> "_Runs":
        """From slopes (rows, k) and what is left (rows and priors,), both in standard deviations."""
        count, shared = len(data), errors.shared.shape[1]
        beside = np.column_stack([data, errors.shared, rows[:count]])
        taught = np.column_stack([priors, np.zeros((len(priors), shared)), rows[count:]])
        known = taught.T @ taught + np.diag([*np.zeros(data.shape[1]), *np.ones(shared), 0.0])
        at = [np.flatnonzero(errors.run == one) for one in np.unique(errors.run)]
        own = np.stack([errors.per_run[each].T @ errors.per_run[each] for each in at])
        across = np.stack([errors.per_run[each].T @ beside[each] for each in at])
        free = cls(beside.T @ beside, known, own, across)
        scale = np.sqrt(np.maximum(np.diag(free.whole + known), 1e-300))
        scale[-1] = 1.0
        variance = free._noise(count)
        return cls(free.whole / np.outer(scale, scale) / variance, known / np.outer(scale, scale), own / variance,
                   across / scale / variance)  # fmt: skip

    def _noise(self, count: int) -> float:
        """The variance that is left where parameters and all errors may be as large as they like."""
        lost = np.einsum("rep,ref,rfq->pq", self.across, np.linalg.pinv(self.own, hermitian=True), self.across)
        whole = self.whole - lost
        free = whole[:-1, :-1]
        left = (
            whole[-1, -1]
            - whole[-1, :-1] @ np.linalg.pinv(free, rcond=SETTINGS.rounding, hermitian=True) @ whole[:-1, -1]
        )
        used = len(free) + sum(np.linalg.matrix_rank(self.own, hermitian=True))
        return max(left / max(count - used, 1), 1e-12)

    def settled(self, which: np.ndarray, sizes: np.ndarray) -> "_Runs":
        """The other runs alone, where the errors of `which` (runs,) have these sizes (runs, e) whatever others have."""
        made, _ = _made_by(self.own[which], self.across[which], sizes[which][None])
        return replace(self, whole=self.whole - made[0], own=self.own[~which], across=self.across[~which])

    def log_likelihoods(self, sizes: np.ndarray) -> np.ndarray:
        """The restricted log-likelihood (s,) where errors of runs have these sizes (s, runs, e), up to a constant."""
        made, widened = _made_by(self.own, self.across, sizes)
        whole = self.whole + self.known - made
        # of parameters that are tied exactly, what is left is rounding: as large as what it is the rest of
        free = whole[:, :-1, :-1] + SETTINGS.rounding * np.diag(np.diag(self.whole + self.known)[:-1])
        across, fitted = whole[:, :-1, -1], np.linalg.solve(free, whole[:, :-1, -1:])[..., 0]
        left = whole[:, -1, -1] - np.einsum("sp,sp->s", across, fitted)
        return -0.5 * (left + widened + np.linalg.slogdet(free)[1])


def _made_by(own: np.ndarray, across: np.ndarray, sizes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """What errors of these sizes (s, runs, e) take from the products (s, q, q), and log-determinants (s,)."""
    scaled = across * sizes[..., None]
    covariance = np.eye(sizes.shape[2]) + own * (sizes[..., :, None] * sizes[..., None, :])
    made = np.einsum("srep,sreq->spq", scaled, np.linalg.solve(covariance, scaled), optimize=True)
    return made, np.linalg.slogdet(covariance)[1].sum(axis=1)
