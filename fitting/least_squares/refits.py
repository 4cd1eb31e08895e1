"""Fits without some of the readings, by the program that was compiled for the fit of all of them."""

from collections.abc import Iterable, Iterator

import numpy as np

from fitting.least_squares.record import Fit
from fitting.least_squares.searches import Alone
from fitting.least_squares.subset import subset_of
from fitting.problem.residuals import LIGHT


def without_each(fit: Fit, left_out: Iterable[np.ndarray]) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Every unknown (unknowns,) and all measured rows (rows,) of a new search without each of these rows (masks)."""
    searches, subset = Alone.of(fit.problem), subset_of(fit.layout, fit.vector, fit.free)
    start = subset.place(subset.full)
    for mask in left_out:
        found = searches.without(mask).solved(subset, start)
        rows = np.asarray(found.rows)[searches.standard.rows[: len(mask)]]
        yield subset.vector(np.asarray(found.place)), rows * np.where(mask, LIGHT, 1.0)
