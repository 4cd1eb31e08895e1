"""How well a model predicts a muscle that it has not seen: each data set beside a fit of all others."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from fitting.least_squares.record import Fit
from fitting.least_squares.searches import Alone
from fitting.least_squares.subset import subset_of
from fitting.least_squares.unbent import left_beyond

BLIND = 1e-6  # of what all readings change by: data sets that change by less tell nothing of a value; rounding


@dataclass(frozen=True)
class LeftOutSet:
    """One data set beside the fit of the others: root mean square errors in its unit, N (or m, of positions alone).

    `predicted` is the error with nothing fitted to these data but `fitted_first`, of which nobody knows anything else.
    `then` is that with `then_fitted` fitted to it: the sizes of its own muscle, the length among them. `beyond` is what
    instruments within their accuracy cannot make of `then`: a length that is held to a millimetre hides much.
    `together` is what the fit of all data sets leaves of it.
    """

    dataset: str
    predicted: float
    then: float
    beyond: float
    together: float
    full_scale: float  # largest reading of this data set
    unit: str
    fitted_first: tuple[str, ...]
    then_fitted: tuple[str, ...]

    @property
    def share(self) -> float:
        """The predicted error as a share of full scale."""
        return self.predicted / self.full_scale

    @property
    def then_share(self) -> float:
        """The error with its own sizes fitted as a share of full scale."""
        return self.then / self.full_scale


def each_left_out(fit: Fit) -> Iterator[LeftOutSet]:
    """Every data set of a fit in turn. A search begins where the fit of all of them has ended."""
    for number in range(len(fit.layout.templates)):
        yield _without(fit, number)


def _without(fit: Fit, number: int) -> LeftOutSet:
    left_out = fit.samples.dataset == number
    own = (*_own_names(fit, number), *_told_by_nobody_else(fit, number, left_out))
    sizes = tuple(name for name in own if fit.layout.entry(name).prior is not None)
    unknown = tuple(name for name in own if name not in sizes)  # the other data sets say nothing of these
    searches, vector = Alone.of(fit.problem), fit.vector.copy()
    vector[fit.layout.at(own)] = fit.layout.start[fit.layout.at(own)]
    others, these = searches.without(left_out), searches.without(~left_out)
    vector = _searched(fit, others, vector, tuple(name for name in fit.free if name not in own))
    first = _searched(fit, these, vector, unknown)
    then = _searched(fit, these, first, own)
    mine = left_out & fit.problem.of_force(fit.samples)
    mine = mine if mine.any() else left_out
    rms = lambda residual: float(np.sqrt(np.mean(residual[mine] ** 2)))  # noqa: E731
    at_last = _residual(fit, searches, then)
    block = fit.problem.blocks[int(fit.samples.recording[mine][0])]
    return LeftOutSet(
        dataset=fit.layout.datasets[number],
        predicted=rms(_residual(fit, searches, first)),
        then=rms(at_last),
        beyond=rms(_beyond_instruments(fit, at_last, left_out)),
        together=rms(fit.residual),
        full_scale=float(np.max(np.abs(fit.samples.measured[mine]))),
        unit="N" if block.of_force else "m",
        fitted_first=unknown,
        then_fitted=sizes,
    )


def _searched(fit: Fit, searches: Alone, vector: np.ndarray, names: tuple[str, ...]) -> np.ndarray:
    """Every unknown after a search of these, from where the others stand."""
    if not names:
        return vector
    subset = subset_of(fit.layout, vector, names)
    return subset.vector(np.asarray(searches.solved(subset, subset.place(subset.full)).place))


def _residual(fit: Fit, searches: Alone, vector: np.ndarray) -> np.ndarray:
    """Model minus measurement at these values, as the fit's samples."""
    rows = searches.at(subset_of(fit.layout, vector, ()), np.zeros(0)).rows
    return np.asarray(rows)[searches.standard.rows[: len(fit.samples)]] * fit.samples.sigma


def _beyond_instruments(fit: Fit, residual: np.ndarray, mine: np.ndarray) -> np.ndarray:
    """The residual of one data set (a mask) without what its instruments can have made of it."""
    sigma, beyond = fit.samples.sigma, residual.copy()
    rows = (residual / sigma)[mine]
    beyond[mine] = left_beyond(rows, np.zeros((len(rows), 1)), fit.errors.at(np.flatnonzero(mine))) * sigma[mine]
    return beyond


def _told_by_nobody_else(fit: Fit, number: int, left_out: np.ndarray) -> tuple[str, ...]:
    """What varies and is shared, but changes nothing in the other data sets: a friction, beside points at rest.

    A search without this data set would leave it where these very readings have put it.
    """
    slopes = np.nan_to_num(fit.slopes[: len(left_out)], posinf=0.0, neginf=0.0)
    others, all_of_them = (np.linalg.norm(part, axis=0) for part in (slopes[~left_out], slopes))
    own = _own_names(fit, number)
    blind = others <= BLIND * all_of_them
    return tuple(name for name, unseen in zip(fit.free, blind, strict=True) if unseen and name not in own)


def _own_names(fit: Fit, number: int) -> tuple[str, ...]:
    """What varies that only this data set's model has."""
    places = fit.layout.places
    elsewhere = {int(at) for other, mine in enumerate(places) if other != number for at in mine}
    return tuple(name for name in fit.free if int(fit.layout.at([name])[0]) not in elsewhere)
