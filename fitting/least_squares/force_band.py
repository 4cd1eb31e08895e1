"""Where a force reading of a new run will lie, also if the model is wrong: what fits without a run say of that run."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from fitting.least_squares.band_level import band_edges, cautious_width, expected_width, runs_needed
from fitting.least_squares.held_out import HELD_OUT, left_out_steps
from fitting.least_squares.record import Fit
from fitting.least_squares.refits import without_each

LEVEL = 0.9  # of readings of a new run that lie in the band: 9 runs are enough for it, 95 % would need 19; chosen


@dataclass(frozen=True)
class ForceBand:
    """The band of one kind of test, N, around the force that the model predicts (`band_level` says what it states).

    It is for the readings that carry weight, in the range of pressures and contractions where runs were measured.
    """

    test: str
    runs: int
    fitted: bool  # to these runs, each of which was left out in turn; else the values come from elsewhere
    # N, of each run, sorted: how far readings lie from fits without it
    scores: tuple[np.ndarray, ...] = field(repr=False)
    vectors: np.ndarray = field(repr=False)  # (runs, unknowns) of the fits without each run
    level: float = LEVEL

    @property
    def needed(self) -> int:
        """The fewest runs for such a band."""
        return runs_needed(self.level)

    @property
    def known(self) -> bool:
        """Whether there are enough runs."""
        return self.runs >= self.needed

    @cached_property
    def half_width(self) -> float:
        """The band reaches so far to either side, N; infinite where runs are too few."""
        return expected_width(self.scores, self.level)

    @cached_property
    def cautious(self) -> float:
        """The same if nothing is presumed of a new run, N."""
        return cautious_width(self.scores, self.level)

    def edges(self, predictions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper edge (points,), N, where the fits without each run predict these forces (runs, points)."""
        return band_edges(self.scores, predictions, self.half_width)


def force_bands(fit: Fit) -> tuple[ForceBand, ...]:
    """One for each kind of test that measures force, in the order of the recordings; none where there is none."""
    tests = [block.test if block.of_force else "" for block in fit.problem.blocks]
    kinds = np.array(tests)[fit.samples.recording]
    runs, fitted = np.unique(fit.samples.run[kinds != ""]), fitted_to_these(fit)
    vectors, residual = (
        left_out_runs(fit, runs) if fitted else (np.repeat(fit.vector[None], len(runs), 0), fit.residual)
    )
    bands = []
    for kind in dict.fromkeys(test for test in tests if test):
        mine = np.unique(fit.samples.run[kinds == kind])
        scores = tuple(np.sort(np.abs(residual[fit.samples.run == run])) for run in mine)
        bands.append(ForceBand(kind, len(mine), fitted, scores, vectors[np.isin(runs, mine)]))
    return tuple(bands)


def left_out_runs(fit: Fit, runs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Every unknown in the fit without each of these runs (runs, unknowns), and residuals, each in the fit without it.

    Refitted where readings are few; else in one step from the whole fit.
    """
    vectors, residual = np.repeat(fit.vector[None], len(runs), axis=0), fit.residual.copy()
    refits = _refits if len(fit.samples) < HELD_OUT.refit_below else _steps
    for number, (run, (vector, rows)) in enumerate(zip(runs, refits(fit, runs), strict=True)) if fit.free else ():
        mine = fit.samples.run == run
        vectors[number], residual[mine] = vector, rows[mine] * fit.samples.sigma[mine]
    return vectors, residual


def _refits(fit: Fit, runs: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Unknowns and rows of a new search without each run."""
    return without_each(fit, [fit.samples.run == run for run in runs])


def _steps(fit: Fit, runs: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """The same to first order; what ended at an end of its range stays there."""
    count, at = len(fit.samples), fit.layout.at(fit.free)
    moves = np.array([name not in fit.at_bound for name in fit.free])
    slopes, rows = fit.slopes * moves, fit.residual / fit.samples.sigma
    group = np.searchsorted(runs, fit.samples.run) + np.where(np.isin(fit.samples.run, runs), 0, len(runs))
    for step in left_out_steps(rows, slopes[:count], slopes[count:], group)[: len(runs)]:
        vector = fit.vector.copy()
        vector[at] = np.clip(vector[at] - step, fit.layout.lower[at], fit.layout.upper[at])
        yield vector, rows + slopes[:count] @ (vector[at] - fit.vector[at])


def fitted_to_these(fit: Fit) -> bool:
    """Whether the values were fitted to these readings: a step to first order takes little more from their error.

    Of a model file that was fitted to other data they were not; of a fit to every third reading they count as fitted.
    """
    if not fit.free:
        return False
    free = np.array([name not in fit.at_bound for name in fit.free])
    slopes = fit.slopes[:, free]
    priors = fit.prior_rows
    rows = np.concatenate([fit.residual / fit.samples.sigma, priors])
    scale = 1 / np.maximum(np.linalg.norm(slopes, axis=0), 1e-300)
    gradient = scale * (slopes.T @ rows)
    curvature = np.linalg.pinv((slopes * scale).T @ (slopes * scale), rcond=1e-12, hermitian=True)
    return bool(gradient @ curvature @ gradient <= HELD_OUT.at_best * np.sum(rows**2))
