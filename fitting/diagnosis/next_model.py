"""The next model of a discovery: the best proposal that obeys the rules of a step, and what was tried beside it."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

from fitting.diagnosis.course import ModelOnTheWay, values_of
from fitting.diagnosis.diagnose import concluded, one_thread
from fitting.diagnosis.equivalent import leading_of
from fitting.diagnosis.findings import Attempt
from fitting.diagnosis.judging import Judged, fitted, in_order, judge
from fitting.diagnosis.outcomes import Verdict
from fitting.diagnosis.record import Diagnosis
from fitting.diagnosis.search import Search
from fitting.diagnosis.search_result import SearchResult
from fitting.diagnosis.step_rules import StepRules, is_no_worse_beyond, objections
from fitting.diagnosis.tiers import Tier
from fitting.threads import at_once
from mckibben_jax.effect import Effect, name_of
from mckibben_jax.model import with_effects


def plain_step(
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
    larger, attempts = next_model(result, here.present, [leading], found, known, begin, rules)
    verdict = Verdict.MISSING if len(leading) == 1 else Verdict.ONE_OF
    return replace(found, verdict=verdict, explanations=tuple(leading), nearest=()), larger, attempts


def next_model(
    here: SearchResult,
    present: Sequence[Effect],
    tiers: Sequence[Tier],
    found: Diagnosis,
    known: Mapping[str, Effect],
    begin: Callable[..., Search],
    rules: StepRules,
    added: Sequence[str] = (),
) -> tuple[ModelOnTheWay | None, tuple[Attempt, ...]]:
    """The best proposal of the first tier that has one which obeys the rules, and what was tried and does not.

    Where none does beside all that was added before, one beside which an earlier effect gives way is taken.
    Where no tier has one, and the verdict is that one set is missing, it is kept unless it predicts runs left out
    worse beyond errors of instruments: else a discovery would end with that verdict.
    """
    before, attempts, every = fitted(here.world, here.base, here), list[Attempt](), list[Judged]()
    adequate = {e.effects for e in found.tried if e.adequate}

    def taken(fit: Judged, hidden: bool) -> ModelOnTheWay | None:
        left = [effect for effect in present if name_of(effect) not in fit.gone]
        effects = list(with_effects(left, [known[name] for name in fit.names]))
        larger = begin(effects, values_of(here.world, fit.after.fit.vector), fit.after.fit.confined)
        after = fitted(larger.world, larger.base, larger)  # its own search may have ended in a lower valley
        why = objections(before, after, rules, fit.names in adequate, fit.alike)
        if why and not (hidden and is_no_worse_beyond(before, after, why, rules)):
            attempts.append(Attempt(fit.names, after.rmse, after.held_out_rmse, why, bool(fit.confined)))
            return None
        gone = tuple(each for each in map(name_of, present) if each not in map(name_of, effects))
        return ModelOnTheWay(fit.names, effects, larger, fit.confined, gone)

    def judged(tier: Tier) -> list[Judged]:
        judging = lambda names: judge(here, before, names, rules, names in adequate, added)  # noqa: E731
        fits = at_once(here.world.settings.workers, judging, tier)
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
        hides = is_no_worse_beyond(fit.alike, fit.after, fit.why, rules)
        if hides and (larger := taken(fit, hidden=True)) is not None:
            return larger, tuple(each for each in attempts if each.effects != names)
    return None, tuple(attempts)
