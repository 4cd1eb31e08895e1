"""Where the search for a posterior's mode begins: not where the curve of least error lies, if instruments bent it."""

import numpy as np

from fitting.instruments.errors import InstrumentErrors
from fitting.instruments.through import Through, standard_number
from fitting.least_squares.decomposed import lstsq
from fitting.least_squares.fit import starting_places
from fitting.least_squares.record import Fit
from fitting.least_squares.search import Evaluated, on_the_host, solve
from fitting.least_squares.subset import Array, Subset
from fitting.posterior.instruments import visible
from fitting.posterior.settings import DENSITY, NOISE
from fitting.problem.residuals import Problem


def beginnings(begun: Evaluated, given: Problem, subset: Subset, fit: Fit, errors: InstrumentErrors) -> list[Evaluated]:
    """Where to begin: where the fit ended, and the best of several searches of rows seen through the instruments.

    A fit that trusts every reading may end in another valley than the truth: a small effect ends where it helps a gain
    that is off. The second is left out where it is the same, where something moves, or where there are more errors than
    a search has room for.
    """
    columns = visible(errors).columns
    room = standard_number(columns.shape[1])
    if not columns.shape[1] or room is None or any(block.steps for block in given.blocks):
        return [begun]
    size = float(np.sqrt(np.mean(unexplained(begun.rows, begun.slopes, errors) ** 2)))
    count = len(columns)
    wide = np.vstack([columns / max(size, 1e-12), np.zeros((given.count - count, columns.shape[1]))])
    through = Through.of(wide, room)
    starts = starting_places(fit.layout, subset, fit.free, DENSITY.starts, 0)
    found = on_the_host(solve(given, subset, starts, through=through))
    if not np.isfinite(found.cost) or np.max(np.abs(found.place - np.asarray(begun.place))) < DENSITY.apart:
        return [begun]
    rows, slopes = through.undone(np.asarray(found.rows)), through.undone(np.asarray(found.slopes))
    return [begun, Evaluated(found.place, rows[:count], slopes[:count])]


def unexplained(residual: Array, slopes: Array, errors: InstrumentErrors) -> np.ndarray:
    """What neither the parameters nor instruments within their accuracy explain, in units of a reading's noise.

    How far an instrument's error goes depends on how large the noise is: both are asked in turn.
    """
    if not errors.sources:
        return residual
    columns, rows = errors.columns, residual
    given = np.vstack([np.hstack([slopes, columns]), np.eye(columns.shape[1], slopes.shape[1] + columns.shape[1],
                                                            slopes.shape[1])])  # fmt: skip
    target = np.concatenate([residual, np.zeros(columns.shape[1])])
    for _ in range(NOISE.rounds):
        size = max(float(np.sqrt(np.mean(rows**2))), 1e-12)
        weight = np.where(np.arange(len(target)) < len(residual), 1 / size, 1.0)
        found = lstsq(given * weight[:, None], target * weight, 1e-12)
        rows = residual - given[: len(residual)] @ found
    return rows
