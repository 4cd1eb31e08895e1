"""Values of the parameters of a fitted set, with their standard errors."""

from collections.abc import Iterable

import numpy as np

from fitting.diagnosis.candidate_fit import CandidateFit
from fitting.diagnosis.universe import Universe
from fitting.least_squares.uncertainty import clusters, covariances
from fitting.problem.estimate import Estimate


def estimate(world: Universe, fit: CandidateFit, name: str) -> dict[str, Estimate]:
    """An effect's parameters by their short names; see `estimates`."""
    return {full.split(".")[-1]: known for full, known in estimates(world, fit, [name]).items()}


def estimates(world: Universe, fit: CandidateFit, effects: Iterable[str]) -> dict[str, Estimate]:
    """The parameters of several effects as fitted, by full name, SI, each with its robust standard error.

    The error is NaN at an end of the range. `world` is that in which the set was fitted. Without those along which
    nothing changes: they stand where the search began.
    """
    names = [name for effect in effects for name in world.layout.of_effect(effect) if name in fit.free]
    if not names:
        return {}
    rows, slopes = world.as_seen(fit.rows), world.as_seen(fit.slopes)
    cluster = clusters(world.samples, np.vstack([slopes, fit.prior_slopes]))
    _, robust = covariances(slopes, rows, fit.prior_slopes, cluster)
    found = {}
    for name, i in zip(names, world.layout.at(names), strict=True):
        value, k = float(fit.vector[i]), fit.free.index(name)
        error = np.nan if name in fit.at_bound else np.sqrt(robust[k, k])  # what stands at its bound has none
        if error != 0:
            unknown = world.layout.entries[i]
            found[name] = Estimate(value, float(error) * unknown.slope(value), unknown.unit)
    return found


def untold(world: Universe, added: frozenset[str], fit: CandidateFit, least: float) -> tuple[str, ...]:
    """The effects of a set of several of which the data tell nothing: no value is so many standard errors large.

    At one speed a friction that depends on speed may have any value, if another friction gives way. An effect
    with a value at its bound is taken to be told: other rules are about bounds.
    """
    if len(added) < 2:
        return ()
    known = {name: estimates(world, fit, [name]) for name in sorted(added)}
    vague = lambda full, each: world.layout.entry(full).size_of(each.value) < least * each.error  # noqa: E731
    return tuple(name for name, found in known.items() if found and all(vague(*each) for each in found.items()))
