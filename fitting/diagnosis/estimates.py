"""Values of the parameters of a fitted set, with their standard errors."""

from collections.abc import Sequence

import numpy as np

from fitting.diagnosis.universe import CandidateFit, Universe
from fitting.least_squares.uncertainty import clusters, covariances


def estimate(world: Universe, fit: CandidateFit, name: str) -> dict[str, tuple[float, float]]:
    """An effect's parameters as fitted, SI, each with its robust standard error; NaN at an end of the range.

    Without those along which nothing changes: they stand where the search began.
    """
    if not len(fit.free):
        return {}
    cluster = clusters(world.samples, np.vstack([fit.slopes, fit.prior_slopes]))
    _, robust = covariances(fit.slopes, fit.rows, fit.prior_slopes, cluster)
    names = [entry for entry in world.layout.of_effect(name) if entry in fit.free]
    found = {}
    for entry, i in zip(names, world.layout.at(names), strict=True):
        value, k = float(fit.vector[i]), fit.free.index(entry)
        error = np.nan if entry in fit.at_bound else np.sqrt(robust[k, k])  # what stands at its bound has none
        if error != 0:
            found[entry.split(".")[-1]] = value, float(error) * world.layout.entries[i].slope(value)
    return found


def estimates(world: Universe, fit: CandidateFit, effects: Sequence[str]) -> dict[str, tuple[float, float, str]]:
    """The parameters of several effects by full name, with their units."""
    units = {entry.name: entry.unit for entry in world.layout.entries}
    every = ((effect, *each) for effect in effects for each in estimate(world, fit, effect).items())
    named = ((f"{effect}.{name}", known) for effect, name, known in every)
    return {full: (*known, units.get(full, "1")) for full, known in named}
