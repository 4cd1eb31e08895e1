"""Values of the parameters of a fitted set, with their standard errors."""

from collections.abc import Sequence

import numpy as np

from fitting.diagnosis.candidate_fit import CandidateFit
from fitting.diagnosis.universe import Universe
from fitting.least_squares.uncertainty import clusters, covariances
from fitting.problem.estimate import Estimate


def estimate(world: Universe, fit: CandidateFit, name: str) -> dict[str, Estimate]:
    """An effect's parameters as fitted, SI, each with its robust standard error; NaN at an end of the range.

    `world` is that in which the set was fitted. Without those along which nothing changes: they stand where the search
    began.
    """
    if not len(fit.free):
        return {}
    rows, slopes = world.as_seen(fit.rows), world.as_seen(fit.slopes)
    cluster = clusters(world.samples, np.vstack([slopes, fit.prior_slopes]))
    _, robust = covariances(slopes, rows, fit.prior_slopes, cluster)
    names = [entry for entry in world.layout.of_effect(name) if entry in fit.free]
    found = {}
    for entry, i in zip(names, world.layout.at(names), strict=True):
        value, k = float(fit.vector[i]), fit.free.index(entry)
        error = np.nan if entry in fit.at_bound else np.sqrt(robust[k, k])  # what stands at its bound has none
        if error != 0:
            unknown = world.layout.entries[i]
            found[entry.split(".")[-1]] = Estimate(value, float(error) * unknown.slope(value), unknown.unit)
    return found


def estimates(world: Universe, fit: CandidateFit, effects: Sequence[str]) -> dict[str, Estimate]:
    """The parameters of several effects by full name, with their units."""
    return {f"{effect}.{name}": e for effect in effects for name, e in estimate(world, fit, effect).items()}
