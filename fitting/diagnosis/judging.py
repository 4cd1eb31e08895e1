"""A larger model in a discovery: fitted from where it is likely to end, and what speaks against it."""

from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fitting.diagnosis.among_all import fit_from_smaller
from fitting.diagnosis.candidate_fit import CandidateFit
from fitting.diagnosis.findings import Attempt, Fault, Objection
from fitting.diagnosis.next_sets import simpler_relatives
from fitting.diagnosis.search import Search
from fitting.diagnosis.search_result import SearchResult
from fitting.diagnosis.step_rules import Fitted, StepRules, denied_sizes, objections
from fitting.diagnosis.universe import Universe
from fitting.full_names import owner_of
from fitting.least_squares import held_out
from fitting.least_squares.unbent import UNBENT


@dataclass(frozen=True, eq=False)
class Judged:
    """A larger model among the candidates, beside the smaller one with stated sizes confined alike.

    `confined` are the stated sizes if they had to be, for a free fit would deny some; `gone` are effects of the smaller
    model that the larger one has not.
    """

    names: tuple[str, ...]
    after: Fitted
    alike: Fitted
    confined: tuple[str, ...]
    why: tuple[Objection, ...]
    gone: tuple[str, ...] = ()

    @property
    def attempt(self) -> Attempt:
        """As what was tried and not kept."""
        return Attempt(self.names, self.after.rmse, self.after.held_out_rmse, self.why, bool(self.confined))


def in_order(sound: Sequence[Judged], rules: StepRules) -> list[Judged]:
    """Sound models in the order in which they are kept: by the error on held-out runs, as far as that tells.

    Where the best is not better than another by its standard error, held-out runs do not decide between them. Then one
    that stays by itself within the stated sizes comes first, then fewer numbers, then the smaller error in sample.
    Stated sizes are no such numbers: that a rubber can tell its wall says nothing against it.
    """
    order = sorted(sound, key=lambda t: t.after.held_out_rmse)
    if not order:
        return []

    def rivals_the_best(t: Judged) -> bool:
        best = order[0].after
        fall, error = held_out.difference(t.after.left_out, best.left_out, best.groups)
        return fall <= rules.errors * error

    first = [t for t in order if rivals_the_best(t)]
    stated = lambda t: t.after.world.from_stated(t.after.fit)  # noqa: E731
    numbers = lambda t: len({*t.after.fit.free} - {*stated(t)})  # noqa: E731
    first.sort(key=lambda t: (t.after.fit.confined, numbers(t), t.after.rmse))
    return [*first, *(t for t in order if t not in first)]


def judge(
    search: SearchResult,
    before: Fitted,
    names: tuple[str, ...],
    rules: StepRules,
    adequate: bool,
    added: Collection[str] = (),
    begin: np.ndarray | None = None,
) -> Judged:
    """Fit a larger model, and see what speaks against it.

    Where effects of the smaller one have become idle beside what is new, they give way: friction that was Coulomb's
    while there was no other ends at 0 where friction is constant. If something is missing from the larger model still,
    only what was `added` on the way may go: what stands in for another effect would else keep it out.
    `begin` are values (unknowns,) where the search begins, of a set that the diagnosis did not fit.
    """
    found = _with_all(
        search, before, names, rules, adequate, search.fits[frozenset(names)].vector if begin is None else begin
    )
    return _giving_way(search, before, found, rules, None if adequate else added) or found


def led_to(world: Universe, fits: Sequence[Judged]) -> dict[tuple[str, ...], np.ndarray]:
    """The sets that larger models lead to which are refused for a new value at its bound, and where to begin them.

    There the effect is a simpler one of its family: rubber of Mooney and Rivlin whose second constant is 0 is
    neo-Hookean, against which nothing may speak.
    """
    found = dict[tuple[str, ...], np.ndarray]()
    for fit in fits:
        ends = {owner_of(why.about) for why in fit.why if why.reason is Fault.BOUND}
        for name in ends & {*fit.names}:
            for other in simpler_relatives(world, name):
                names = tuple(sorted({*fit.names} - {name} | {other}))
                found.setdefault(names, fit.after.fit.vector)
    return found


def _with_all(
    search: SearchResult, before: Fitted, names: tuple[str, ...], rules: StepRules, adequate: bool, begin: np.ndarray
) -> Judged:
    """The larger model with every effect of the smaller one.

    Where it denies a stated size, nothing else that it says counts: both models are fitted again with sizes confined.
    """
    ends = ends_of(search.world, search, begin, before, names, adequate)
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


def _giving_way(
    search: SearchResult, before: Fitted, found: Judged, rules: StepRules, added: Collection[str] | None
) -> Judged | None:
    """A larger model without the effects of the smaller one that all objections are about; None unless that is sound.

    All of them go or, where that is too much, one of them; none, where an objection is about what may not go. It is
    sound if it obeys every rule; where the larger model
    is adequate (`added` is None), nothing may be missing from it either.
    """
    idle = {owner_of(why.about) if why.reason in (Fault.BOUND, Fault.UNKNOWN) else "" for why in found.why}
    if not idle or not idle <= (before.fit.effects if added is None else {*added}):
        return None
    ways = [idle, *({name} for name in sorted(idle))] if len(idle) > 1 else [idle]
    return next((fit for gone in ways if (fit := _without(search, found, gone, rules, added is None, before))), None)


def _without(
    search: SearchResult, found: Judged, gone: set[str], rules: StepRules, adequate: bool, before: Fitted
) -> Judged | None:
    """A larger model without some effects of the smaller one; None unless that is sound."""
    world, effects = found.after.world, found.after.fit.effects - gone
    if world.lacking(effects) or (adequate and not _lacks_nothing(search, effects, found.after.fit.vector)):
        return None
    after = fitted(world, world.fit(effects, found.after.fit.vector), search)
    sound = not objections(before, after, rules, adequate, found.alike)
    return replace(found, after=after, why=(), gone=tuple(sorted(gone))) if sound else None


def _lacks_nothing(search: SearchResult, effects: frozenset[str], start: np.ndarray) -> bool:
    """Whether the test sees nothing missing from a model."""
    through = search.examiner.seen.settled(effects, start)
    return search.examiner.adequacy(frozenset(), through, search.fits).why is None


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
    return Fitted(world, fit, world.left_out(fit, groups), groups, lambda: search.examiner.beyond_instruments(fit))
