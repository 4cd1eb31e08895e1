"""What an effect does in a muscle of believable sizes.

A fit believes every reading to within its noise. Where a model errs by many times the noise, and errs alike along a
whole loop, thousands of readings say one thing thousands of times, and outweigh a caliper that is right: the ideal
cylinder buys the pull of a rubber wall with twice the radius. Once a free fit denies a stated size, all stated sizes
are therefore confined to two standard errors of what was stated, within which 95 of 100 honest measurements lie, and
the effect is judged by what it does there.
"""

from fitting.diagnosis.candidate_fit import CandidateFit
from fitting.diagnosis.universe import Universe


def believable(world: Universe, fit: CandidateFit) -> CandidateFit:
    """The same effects fitted with the stated sizes confined, if the fit denies any of them; else the fit."""
    return with_sizes_confined(world, fit) if world.contradicted(fit) else fit


def with_sizes_confined(world: Universe, fit: CandidateFit) -> CandidateFit:
    """The same effects fitted with the stated sizes confined; those that do not vary stay where they are."""
    begin, there = fit.vector.copy(), world.confined()
    stated = world.layout.at([name for name in world.from_stated(fit) if name in fit.free])
    begin[stated] = world.start[stated]
    return min((there.fit(fit.effects, place) for place in (begin, fit.vector)), key=lambda end: end.cost)
