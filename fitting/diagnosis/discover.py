"""Diagnose and add one effect at a time, until nothing more can be said that a mechanician would sign."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

from fitting.diagnosis.diagnose import Progress, concluded, library_candidates, one_thread, prepared
from fitting.diagnosis.outcomes import NOTHING_MISSING
from fitting.diagnosis.record import Diagnosis
from fitting.diagnosis.search import Search, SearchResult
from fitting.diagnosis.step_rules import RULES, Fitted, Objection, StepRules, denied_sizes, objections
from fitting.diagnosis.universe import CandidateFit, Universe
from fitting.problem.varying import Varying
from fitting.recordings.records import Experiment
from mckibben_jax.effect import Effect, name_of
from mckibben_jax.model import with_effects

WORTH_IT = 0.99  # of an error: what changes it by less changes it by a rounding error


@dataclass(frozen=True)
class Attempt:
    """A larger model that was fitted and not kept, its errors (N), and why."""

    effects: tuple[str, ...]
    rmse: float
    held_out_rmse: float
    why: tuple[Objection, ...]


@dataclass(frozen=True)
class Step:
    """One model on the way: what was added to the one before, its errors (N), and what is said of it.

    `attempts` are the larger models that were tried after this one, in their order, and not kept.
    """

    added: tuple[str, ...]  # names of effects; "baseline" first
    rmse: float
    held_out_rmse: float
    verdict: str
    diagnosis: Diagnosis
    attempts: tuple[Attempt, ...] = ()
    held: tuple[str, ...] = ()  # stated sizes of the muscle that are held since this step, for a free fit denies them

    @property
    def effect(self) -> str:
        """What was added, as one name."""
        return "+".join(self.added)


OnStep = Callable[[Step], None]


def discover(
    experiments: Sequence[Experiment],
    effects: Sequence[Effect],
    *,
    candidates: Sequence[Effect] | None = None,
    fix: Sequence[str] = (),
    free: Sequence[str] = (),
    own: Sequence[str] = (),
    seed: int = 0,
    start: Mapping[str, float] | None = None,
    rules: StepRules = RULES,
    on_step: OnStep | None = None,
    progress: Progress | None = None,
) -> tuple[Step, ...]:
    """Diagnose, add one effect, and diagnose again, until no step is left that obeys the rules.

    Whatever the verdict, an effect that leads is added; two at once only where neither is kept alone. Every fit begins
    at the optimum of the model before, so that no step raises the error. Stated sizes that a step denies are held at
    what was stated, from that step on. `candidates` as in `diagnose`; `start` gives values (SI, by full name) that were
    fitted before; `on_step` is called with every step as soon as it is made, with all that was tried after it.
    """
    candidates = library_candidates() if candidates is None else candidates
    known = {name_of(effect): effect for effect in (*effects, *candidates)}

    def begin(present: Sequence[Effect], fix: Sequence[str], start: Mapping[str, float] | None) -> Search:
        varying = Varying(tuple(fix), tuple(free), tuple(own))
        return prepared(
            experiments, present, candidates=list(known.values()), varying=varying, seed=seed, progress=progress,
            start=start,
        )  # fmt: skip

    steps: list[Step] = []
    here = Larger(("baseline",), list(effects), begin(effects, fix, start))
    while True:
        with one_thread():
            result = here.search.run()
        found = concluded(result)
        step = Step(here.added, found.rmse, found.held_out_rmse, found.verdict, found, held=here.held)
        larger: Larger | None = None
        attempts: tuple[Attempt, ...] = ()
        if len(steps) < rules.steps:
            larger, attempts = _next(result, here.present, found, known, begin, rules)
        steps.append(replace(step, attempts=attempts))
        if on_step is not None:
            on_step(steps[-1])
        if larger is None:
            return tuple(steps)
        here = larger


@dataclass(frozen=True)
class Larger:
    """A model on the way: what was added, all effects, its search, and the stated sizes that it was first to hold."""

    added: tuple[str, ...]
    present: list[Effect]
    search: Search
    held: tuple[str, ...] = ()


def _next(
    here: SearchResult,
    present: Sequence[Effect],
    found: Diagnosis,
    known: Mapping[str, Effect],
    begin: Callable[..., Search],
    rules: StepRules,
) -> tuple[Larger | None, tuple[Attempt, ...]]:
    """The best proposal of the first tier that has one which obeys the rules, and what was tried and does not."""
    before, attempts = _fitted(here.world, here.base, here), list[Attempt]()
    adequate = {e.effects for e in found.tried if e.adequate}
    for tier in worth_judging(found, rules):
        fits = [_judged(here, before, names, rules, names in adequate) for names in tier]
        attempts += [fit.attempt for fit in fits if fit.why]
        for fit in sorted((t for t in fits if not t.why), key=lambda t: t.after.held_out_rmse):
            effects = with_added(present, [known[name] for name in fit.names])
            larger = begin(effects, fit.after.world.fixed, _values(fit.after))
            after = _fitted(larger.world, larger.base, larger)  # its own search may have ended in a lower valley
            why = objections(before, after, rules, fit.names in adequate)
            if not why:
                return Larger(fit.names, effects, larger, fit.held), tuple(attempts)
            attempts.append(Attempt(fit.names, after.rmse, after.held_out_rmse, why))
    return None, tuple(attempts)


@dataclass(frozen=True)
class Judged:
    """A larger model among the candidates: as it is, or with stated sizes held where a free fit would deny them."""

    names: tuple[str, ...]
    after: Fitted
    held: tuple[str, ...]
    why: tuple[Objection, ...]
    attempt: Attempt


def _judged(search: SearchResult, before: Fitted, names: tuple[str, ...], rules: StepRules, adequate: bool) -> Judged:
    """Fit a larger model, and see what speaks against it."""
    free = _lowest(search.world, search, search.fits[frozenset(names)])
    after, held = free, tuple[str, ...]()
    first = why = objections(before, free, rules, adequate)
    while more := denied_sizes(why):  # what does the effect do in a muscle of the sizes that were stated?
        held = (*held, *more)
        after = _lowest(search.world.holding(held), search, after.fit)
        why = objections(before, after, rules, adequate)
    reasons = tuple(dict.fromkeys((*first, *why)))
    return Judged(names, after, held, why, Attempt(names, free.rmse, free.held_out_rmse, reasons))


Tier = list[tuple[str, ...]]


def proposals(found: Diagnosis, rules: StepRules = RULES) -> list[Tier]:
    """What may be added after a diagnosis: the best of the first tier that has something sound.

    First what the verdict names, then what leads; then, where something is missing for certain, every other effect.
    Two at once come after all that stand alone. Each tier is in the order of its held-out errors.
    """
    if found.verdict in NOTHING_MISSING:
        return []
    named = set(found.explanations)
    order = [e.effects for e in found.tried]  # by held-out error
    singles = [names for names in order if len(names) == 1]
    pairs = [names for names in order if len(names) == 2]
    inside = [names for names in order if any(set(names) <= set(group) for group in named)]
    leading = [] if found.leading is None else [names for names in singles if names[0] in found.leading.effects]
    tiers = [
        [names for names in singles if names in named],
        [names for names in singles if names in inside],
        [names for names in pairs if names in inside],
        leading,
    ]
    others = [] if found.verdict == "inconclusive" else [singles, pairs[: rules.pairs]]
    return _without_repeats([*tiers, *others])


def _without_repeats(tiers: Sequence[Tier]) -> list[Tier]:
    """Each proposal in the first tier that has it; no empty tiers."""
    seen: set[tuple[str, ...]] = set()
    kept = []
    for tier in tiers:
        kept.append([names for names in tier if names not in seen])
        seen.update(tier)
    return [tier for tier in kept if tier]


def worth_judging(found: Diagnosis, rules: StepRules = RULES) -> list[Tier]:
    """The proposals that at first sight lower the held-out error enough."""
    by_name = {e.effects: e for e in found.tried}

    def pays(names: tuple[str, ...]) -> bool:
        one = by_name[names]
        share = WORTH_IT if one.adequate else 1 - rules.share
        return one.fall > rules.errors and one.held_out_rmse < share * found.held_out_rmse

    return _without_repeats([[names for names in tier if pays(names)] for tier in proposals(found, rules)])


def _lowest(world: Universe, search: SearchResult, fit: CandidateFit) -> Fitted:
    """A larger model fitted from where it ended before and from the smaller one's optimum, whichever ends lower."""
    held = world.layout.at(set(world.fixed) - set(search.world.fixed))
    begin, smaller = fit.vector.copy(), search.base.vector.copy()
    begin[held] = smaller[held] = world.start[held]
    from_smaller = world.fit_from_smaller(fit.effects, replace(search.base, vector=smaller))
    return _fitted(world, min(world.fit(fit.effects, begin), from_smaller, key=lambda end: end.cost), search)


def _fitted(world: Universe, fit: CandidateFit, search: Search | SearchResult) -> Fitted:
    groups = search.examiner.groups
    return Fitted(world, fit, world.left_out(fit, groups), groups)


def _values(model: Fitted) -> dict[str, float]:
    """A model's values by full name, SI."""
    return dict(zip(model.world.layout.names, map(float, model.fit.vector), strict=True))


def with_added(present: Sequence[Effect], new: Sequence[Effect]) -> list[Effect]:
    """A set of effects with others added, each in place of its rivals."""
    return list(with_effects(present, new))
