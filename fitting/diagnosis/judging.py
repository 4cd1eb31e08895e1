"""A larger model in a discovery: fitted from where it is likely to end, and what speaks against it."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from fitting.diagnosis.among_all import fit_from_smaller
from fitting.diagnosis.candidate_fit import CandidateFit
from fitting.diagnosis.findings import Attempt, Objection
from fitting.diagnosis.search import Search
from fitting.diagnosis.search_result import SearchResult
from fitting.diagnosis.step_rules import Fitted, StepRules, denied_sizes, objections
from fitting.diagnosis.universe import Universe
from fitting.least_squares import held_out
from fitting.least_squares.unbent import UNBENT


@dataclass(frozen=True, eq=False)
class Judged:
    """A larger model among the candidates, beside the smaller one with stated sizes confined alike.

    `confined` are the stated sizes if they had to be, for a free fit would deny some.
    """

    names: tuple[str, ...]
    after: Fitted
    alike: Fitted
    confined: tuple[str, ...]
    why: tuple[Objection, ...]

    @property
    def attempt(self) -> Attempt:
        """As what was tried and not kept."""
        return Attempt(self.names, self.after.rmse, self.after.held_out_rmse, self.why)


def in_order(sound: Sequence[Judged], rules: StepRules) -> list[Judged]:
    """Sound models in the order in which they are kept: by the error on held-out runs, as far as that tells.

    Where the best is not better than another by its standard error, held-out runs do not decide between them. Then one
    that stays by itself within the stated sizes comes first, then fewer numbers, then the smaller error in sample.
    """
    order = sorted(sound, key=lambda t: t.after.held_out_rmse)
    if not order:
        return []

    def rivals_the_best(t: Judged) -> bool:
        best = order[0].after
        fall, error = held_out.difference(t.after.left_out, best.left_out, best.groups)
        return fall <= rules.errors * error

    first = [t for t in order if rivals_the_best(t)]
    first.sort(key=lambda t: (t.after.fit.confined, len(t.after.fit.free), t.after.rmse))
    return [*first, *(t for t in order if t not in first)]


def judge(search: SearchResult, before: Fitted, names: tuple[str, ...], rules: StepRules, adequate: bool) -> Judged:
    """Fit a larger model, and see what speaks against it.

    Where it denies a stated size, nothing else that it says counts: both models are fitted again with sizes confined.
    """
    ends = ends_of(search.world, search, search.fits[frozenset(names)].vector, before, names, adequate)
    after = first_sound(ends, lambda end: objections(before, end, rules, adequate))
    why = objections(before, after, rules, adequate)
    if not denied_sizes(why):
        return Judged(names, after, before, (), why)
    world = search.world.confined()
    smaller = fitted(world, world.fit(search.base.effects, search.base.vector), search)
    ends = ends_of(world, search, after.fit.vector, smaller, names, adequate)
    again = first_sound(ends, lambda end: objections(before, end, rules, adequate, smaller))
    why = objections(before, again, rules, adequate, smaller)
    return Judged(names, again, smaller, tuple(world.from_stated(again.fit)), why)


def first_sound(ends: Iterable[Fitted], against: Callable[[Fitted], tuple[Objection, ...]]) -> Fitted:
    """The first of these ends of a search against which nothing speaks; the first of all, if something does of each."""
    every = list[Fitted]()
    for end in ends:
        if not against(end):
            return end
        every.append(end)
    return every[0]


def ends_of(
    world: Universe, search: SearchResult, begin: np.ndarray, smaller: Fitted, names: Sequence[str], adequate: bool
) -> Iterator[Fitted]:
    """A larger model fitted from where it ended before and from the smaller one's optimum, whichever ends lower.

    An adequate one stays where it is so, unless it errs far more there: the lowest valley may be one that instruments
    made, with an effect at the wrong end of its range. Where the way to it leads down from where the model is right,
    that place itself comes first.
    """
    effects, left = world.with_added(names), search.examiner.left
    there = world.fit(effects, begin, decide=False)
    other = fit_from_smaller(world, effects, smaller.fit, decide=False)
    if adequate:
        before = world.at(effects, begin)
        if left(before) < UNBENT.clearly**2 * left(there) and before.cost < UNBENT.dearer * other.cost:
            yield fitted(world, before, search)
    stays = adequate and there.cost < UNBENT.dearer * other.cost
    ended = there if stays else min((there, other), key=lambda end: end.cost)
    yield fitted(world, world.decided(ended), search)


def fitted(world: Universe, fit: CandidateFit, search: Search | SearchResult) -> Fitted:
    """A fit with its rows on held-out runs, in the groups of a search."""
    groups = search.examiner.groups
    return Fitted(world, fit, world.left_out(fit, groups), groups)
