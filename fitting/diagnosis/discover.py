"""Diagnose and add one effect at a time, until nothing more can be said that a mechanician would sign."""

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

from fitting.diagnosis.course import ModelOnTheWay, OnStep, Step, values_of
from fitting.diagnosis.diagnose import Progress, concluded, library_candidates, one_thread, prepared
from fitting.diagnosis.dropping import smaller_models, without_idle
from fitting.diagnosis.equivalent import leading_of
from fitting.diagnosis.exchanging import exchanged
from fitting.diagnosis.findings import Attempt
from fitting.diagnosis.judging import Judged, fitted, in_order, judge
from fitting.diagnosis.outcomes import NOTHING_MISSING, Reason, Verdict, Why
from fitting.diagnosis.record import Diagnosis
from fitting.diagnosis.search import Search
from fitting.diagnosis.search_result import SearchResult
from fitting.diagnosis.step_rules import RULES, StepRules, gain_is_hidden, objections
from fitting.problem.varying import Varying
from fitting.recordings.records import Experiment
from mckibben_jax.effect import Effect, name_of
from mckibben_jax.model import with_effects

WORTH_IT = 0.99  # of an error: what changes it by less changes it by a rounding error


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
    at the optimum of the model before, so that no step raises the error. Where a step denies a stated size, all stated
    sizes are confined to what was stated (`stated_sizes`) from that step on. In the end, what does not pay any more
    beside what was added later, or what an adequate model does not need, is dropped; what another effect explains
    better is exchanged for that.
    `candidates` as in `diagnose`; `start` gives values (SI, by full name) that were fitted before; `on_step` is called
    with every step as soon as it is made, with all that was tried after it.
    """
    candidates = library_candidates() if candidates is None else candidates
    known = {name_of(effect): effect for effect in (*effects, *candidates)}

    def begin(present: Sequence[Effect], start: Mapping[str, float] | None, confine: bool = False) -> Search:
        varying = Varying(tuple(fix), tuple(free), tuple(own))
        return prepared(
            experiments, present, candidates=list(known.values()), varying=varying, seed=seed, progress=progress,
            start=start, confine=confine,
        )  # fmt: skip

    steps, seen = list[Step](), list[frozenset[str]]()

    def tell(step: Step) -> None:
        steps.append(step)
        if on_step is not None:
            on_step(step)

    # what took the place of an effect stays: without both there would be neither
    families = {effect.family for effect in effects} - {None}
    begun = {name_of(effect) for effect in effects}

    def added(here: ModelOnTheWay) -> list[str]:
        names = (name_of(effect) for effect in here.present if effect.family not in families)
        return [name for name in names if name not in begun]

    def names_of(model: ModelOnTheWay) -> frozenset[str]:
        return frozenset(name_of(effect) for effect in model.present)

    def standing(model: ModelOnTheWay) -> int:
        return sum(not names_of(model).isdisjoint(step.added) for step in (*steps, model))

    def unseen(model: ModelOnTheWay | None) -> ModelOnTheWay | None:
        """The model, unless it was on the way already: what was dropped from it is not added again."""
        return None if model is None or names_of(model) in seen else model

    here = ModelOnTheWay(("baseline",), list(effects), begin(effects, start))
    while True:
        seen.append(names_of(here))
        more = standing(here) < rules.steps and len(steps) < rules.longest
        found, larger, attempts = _plainly(here, known, begin, rules) if more else (None, None, ())
        larger = unseen(larger)
        if found is None or larger is None:
            with one_thread():
                result = here.search.run()
            found = concluded(result)
            if more:
                tiers = worth_judging(found, rules)
                larger, attempts = _next(result, here.present, tiers, found, known, begin, rules, added(here))
                larger = unseen(larger)
        tell(here.step(found, attempts))
        if larger is None and here.added and not result.base_is_adequate:  # once: step by step all would go
            with one_thread():
                larger = without_idle(here, added(here), begin, rules)
        if larger is None and len(steps) < rules.longest:
            with one_thread():
                larger = exchanged(here, added(here), known, begin, rules, result.base_is_adequate, seen)
        if larger is None:
            break
        here = larger
    for smaller in smaller_models(here, result, added(here), begin):
        tell(smaller)
    return tuple(steps)


def _plainly(
    here: ModelOnTheWay, known: Mapping[str, Effect], begin: Callable[..., Search], rules: StepRules
) -> tuple[Diagnosis | None, ModelOnTheWay | None, tuple[Attempt, ...]]:
    """A step by an effect that is plainly there: it leads, and leaves less than it removes.

    It is added before two at once are looked at: beside it they mean something else than without it. What the verdict
    then names is what was added. Nothing gives way to it before all else was looked at.
    """
    with one_thread():
        result = here.search.glance()
    if result.base_is_adequate:
        return None, None, ()
    with one_thread():
        leads = leading_of(result.world, result.base, result.fits, result.examiner)
    if leads is None or leads.share < rules.plain:
        return None, None, ()
    found = concluded(result)
    leading = [names for names in (e.effects for e in found.tried) if set(names) <= set(leads.effects)]
    larger, attempts = _next(result, here.present, [leading], found, known, begin, rules)
    verdict = Verdict.MISSING if len(leading) == 1 else Verdict.ONE_OF
    return replace(found, verdict=verdict, explanations=tuple(leading), nearest=()), larger, attempts


def _next(
    here: SearchResult,
    present: Sequence[Effect],
    tiers: Sequence["Tier"],
    found: Diagnosis,
    known: Mapping[str, Effect],
    begin: Callable[..., Search],
    rules: StepRules,
    added: Sequence[str] = (),
) -> tuple[ModelOnTheWay | None, tuple[Attempt, ...]]:
    """The best proposal of the first tier that has one which obeys the rules, and what was tried and does not.

    Where none does beside all that was added before, one beside which an earlier effect gives way is taken.
    Where no tier has one, and the verdict is that one set is missing, it is kept if its gain only hides behind errors
    of instruments: else a discovery would end with that verdict.
    """
    before, attempts, every = fitted(here.world, here.base, here), list[Attempt](), list[Judged]()
    adequate = {e.effects for e in found.tried if e.adequate}

    def taken(fit: Judged, hidden: bool) -> ModelOnTheWay | None:
        left = [effect for effect in present if name_of(effect) not in fit.gone]
        effects = with_added(left, [known[name] for name in fit.names])
        larger = begin(effects, values_of(here.world, fit.after.fit.vector), fit.after.fit.confined)
        after = fitted(larger.world, larger.base, larger)  # its own search may have ended in a lower valley
        why = objections(before, after, rules, fit.names in adequate, fit.alike)
        if why and not (hidden and gain_is_hidden(before, after, why, rules)):
            attempts.append(Attempt(fit.names, after.rmse, after.held_out_rmse, why, bool(fit.confined)))
            return None
        gone = tuple(each for each in map(name_of, present) if each not in map(name_of, effects))
        return ModelOnTheWay(fit.names, effects, larger, fit.confined, gone)

    def judged(tier: Tier) -> list[Judged]:
        with ThreadPoolExecutor(here.world.settings.workers) as workers:
            fits = list(workers.map(lambda names: judge(here, before, names, rules, names in adequate, added), tier))
        attempts.extend(fit.attempt for fit in fits if fit.why)
        every.extend(fits)
        return fits

    yielding = list[Judged]()
    for tier in tiers:
        sound = [t for t in judged(tier) if not t.why]
        yielding += [t for t in sound if t.gone and t.names not in adequate]
        for fit in in_order([t for t in sound if t not in yielding], rules):
            if (larger := taken(fit, hidden=False)) is not None:
                return larger, tuple(attempts)
    for fit in in_order(yielding, rules):
        if (larger := taken(fit, hidden=False)) is not None:
            return larger, tuple(attempts)
    for names in found.explanations if found.verdict == Verdict.MISSING else ():
        fit = next((fit for fit in every if fit.names == names), None) or judged([names])[0]
        hides = gain_is_hidden(fit.alike, fit.after, fit.why, rules)
        if hides and (larger := taken(fit, hidden=True)) is not None:
            return larger, tuple(each for each in attempts if each.effects != names)
    return None, tuple(attempts)


Tier = list[tuple[str, ...]]


def proposals(found: Diagnosis, rules: StepRules = RULES) -> list[Tier]:
    """What may be added after a diagnosis: the best of the first tier that has something sound.

    First what the verdict names, and at last all three of a set that it names; then what leads; then, where something
    is missing for certain, every other effect. Two at once come after all that stand alone. Each tier is in the order
    of its held-out errors.
    Where instruments had to err by far more than their accuracy, or where the test sees nothing missing though an
    added effect lowers the error, every effect alone is asked.
    """
    if found.verdict in NOTHING_MISSING:
        return [[e.effects for e in found.tried if len(e.effects) == 1]] if found.is_strained else []
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
        [names for names in order if len(names) == 3 and names in named],
        leading,
    ]
    if found.verdict == Verdict.INCONCLUSIVE:
        others = [singles] if found.why in (Why(Reason.TEST_BLIND), Why(Reason.FEW_LOOPS)) else []
    else:
        others = [singles, pairs[: rules.pairs]]
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
    """The proposals that at first sight lower the held-out error enough.

    Whether they do so by more than its standard error is seen when they are judged, by fits that trust every reading:
    beyond the instruments a tip that takes a quarter of a hose's error falls by less.
    """
    by_name = {e.effects: e for e in found.tried}

    def pays(names: tuple[str, ...]) -> bool:
        one = by_name[names]
        share = WORTH_IT if one.adequate else 1 - rules.share
        return one.held_out_rmse < share * found.held_out_rmse

    return _without_repeats([[names for names in tier if pays(names)] for tier in proposals(found, rules)])


def with_added(present: Sequence[Effect], new: Sequence[Effect]) -> list[Effect]:
    """A set of effects with others added, each in place of its rivals."""
    return list(with_effects(present, new))
