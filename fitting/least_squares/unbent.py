"""The curve of least error may lie in a valley that instruments made: where a search through the instruments ends.

A small effect can end where it helps a gain that is off: an end stop at the wrong end of the stroke had a smaller error
than the true one. Only beside the errors that instruments may make does it show which valley leaves noise alone.
"""

from dataclasses import dataclass

import numpy as np

from fitting.instruments.errors import InstrumentErrors
from fitting.instruments.through import SIZES
from fitting.least_squares.decomposed import lstsq
from fitting.least_squares.held_out import rms
from fitting.least_squares.search import Evaluated
from fitting.least_squares.searches import Searches
from fitting.least_squares.subset import Array, Subset


@dataclass(frozen=True)
class UnbentSettings:
    """When a fit is looked for in another valley. All were chosen."""

    rounds: int = 3  # of asking how large the noise is beside what instruments explain
    nearly: float = 3.0  # times the noise: a model that leaves more beyond the instruments lacks something anyway
    noise: float = 1.1  # times the noise: a fit that leaves less beyond the instruments is where it should be
    clearly: float = 0.9  # of what is left beyond the instruments, from which another valley is the better one
    dearer: float = 2.5  # times the sum of squares that the curve in another valley may leave


UNBENT = UnbentSettings()
MOST_NUMBERS = SIZES[-1] * 20_000  # in the columns of all errors, of so many rows at most: 160 MB


def left_beyond(residual: Array, slopes: Array, errors: InstrumentErrors) -> np.ndarray:
    """What neither the parameters nor instruments within their accuracy explain, in units of a reading's noise.

    `residual` (rows,) and `slopes` (rows, parameters) are those of the measurements. How far an instrument's error goes
    depends on how large the noise is: both are asked in turn.
    """
    rows = np.asarray(residual)
    for _ in range(UNBENT.rounds if errors.sources else 0):
        size = max(rms(rows), 1e-12)
        white = errors.changed(errors.per_run / size, errors.shared / size).whitener()
        rows = residual - slopes @ lstsq(white(np.asarray(slopes)), white(np.asarray(residual)), 1e-12)
        rows = white.residual(rows)
    return rows


def through_instruments(
    searches: Searches, subset: Subset, starts: np.ndarray, errors: InstrumentErrors, size: float
) -> Evaluated | None:
    """The best end of searches from these starts, seen through instruments that err beside noise so large.

    What is found has the rows of the measurements alone. None where there are more errors than a search has room for,
    or where it met no finite numbers.
    """
    room = searches.room(errors.count)
    if not errors.count or room is None or len(errors.run) * room > MOST_NUMBERS:
        return None
    found = searches.search(subset, starts, errors.columns / max(size, 1e-12))
    if not np.isfinite(found.cost):
        return None
    return found.best.at(searches.standard.rows[: len(errors.run)])


def unbent(
    searches: Searches, subset: Subset, plain: Evaluated, starts: np.ndarray, errors: InstrumentErrors
) -> Evaluated | None:
    """A point in the valley that leaves less beyond the instruments than the curve of least error, if there is one.

    `plain` is that curve, with the rows of the measurements alone. Nothing is looked for where it leaves noise alone,
    or where the model misses so much that instruments matter little.
    """
    left = rms(left_beyond(plain.rows, plain.slopes, errors)) if errors.sources else 0.0
    if not UNBENT.noise < left < UNBENT.nearly:
        return None
    begin = np.concatenate([np.asarray(plain.place)[None], starts])[: len(starts)]
    found = through_instruments(searches, subset, begin, errors, left)
    return None if found is None or not is_better(found, plain, errors) else found


def leaves_noise(at: Evaluated, errors: InstrumentErrors) -> bool:
    """Whether what a point leaves beyond the instruments is noise alone."""
    return rms(left_beyond(at.rows, at.slopes, errors)) < UNBENT.noise


def is_better(found: Evaluated, plain: Evaluated, errors: InstrumentErrors) -> bool:
    """Whether a point leaves clearly less beyond instruments than the curve of least error, and errs little more."""
    left = [rms(left_beyond(at.rows, at.slopes, errors)) for at in (found, plain)]
    squares = [float(np.sum(np.square(at.rows))) for at in (found, plain)]
    return left[0] < UNBENT.clearly * left[1] and squares[0] < UNBENT.dearer * squares[1]
