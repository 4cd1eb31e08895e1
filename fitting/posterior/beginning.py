"""Where the search for a posterior's mode begins: not where the curve of least error lies, if instruments bent it."""

import numpy as np

from fitting.instruments.errors import InstrumentErrors
from fitting.least_squares.held_out import rms
from fitting.least_squares.record import Fit
from fitting.least_squares.search import Evaluated
from fitting.least_squares.searches import Alone
from fitting.least_squares.starts import starting_places
from fitting.least_squares.subset import Subset
from fitting.least_squares.unbent import left_beyond, through_instruments
from fitting.posterior.instruments import visible
from fitting.posterior.settings import DENSITY
from fitting.problem.residuals import Problem
from fitting.problem.sizes import Standard


def beginnings(begun: Evaluated, given: Problem, subset: Subset, fit: Fit, errors: InstrumentErrors) -> list[Evaluated]:
    """Where to begin: where the fit ended, and the best of several searches of rows seen through the instruments.

    The second is left out where it is the same, where something moves, or where there are more errors than a search has
    room for.
    """
    if any(block.steps for block in given.blocks):
        return [begun]
    felt = visible(errors)
    size = rms(left_beyond(begun.rows, begun.slopes, felt))
    starts = starting_places(fit.layout, subset, fit.free, DENSITY.starts, 0)
    searches = Alone(Standard(given, np.arange(given.count)))
    found = through_instruments(searches, subset, starts, felt, size)
    if found is None or np.max(np.abs(np.asarray(found.place) - np.asarray(begun.place))) < DENSITY.apart:
        return [begun]
    return [begun, found]
