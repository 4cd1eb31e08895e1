"""The next model of a discovery: the best proposal that obeys the rules of a step, and what was tried beside it."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from fitting.diagnosis.course import ModelOnTheWay, values_of
from fitting.diagnosis.diagnose import concluded, one_thread
from fitting.diagnosis.equivalent import leading_of, plainly_there
from fitting.diagnosis.findings import Attempt
from fitting.diagnosis.judging import Judged, fitted, in_order, judge, led_to
from fitting.diagnosis.outcomes import Verdict
from fitting.diagnosis.record import Diagnosis
from fitting.diagnosis.search import Search
from fitting.diagnosis.search_result import SearchResult
from fitting.diagnosis.step_rules import StepRules, is_no_worse_beyond, objections
from fitting.diagnosis.tiers import Tier
from fitting.diagnosis.universe import Universe
from fitting.threads import at_once
from mckibben_jax.effect import Effect, name_of
from mckibben_jax.model import with_effects


def plain_step(
    here: ModelOnTheWay, known: Mapping[str, Effect], begin: Callable[..., Search], rules: StepRules
) -> tuple[Diagnosis | None, ModelOnTheWay | None, tuple[Attempt, ...]]:
    """A step by an effect that is plainly there: it leaves less than it removes, and no other does clearly better.

    It is added before two at once are looked at: beside it they mean something else than without it. What the verdict
    then names is what was added, or, where others do as well, what that was chosen from; what takes its place once the
    others are there is asked at the end. A part whose sizes are stated comes first: a rubber wall before the bending of
    strands, which takes nearly the same pull. Nothing gives way to it before all else was looked at.
    """
    with one_thread():
        result = here.search.glance()
    if result.base_is_adequate:
        return None, None, ()
    with one_thread():
        plain = _plain(result, rules)
    if not plain:
        return None, None, ()
    found = concluded(result)
    leading = [names for names in (e.effects for e in found.tried) if names in plain]
    measured = [names for names in leading if all(_was_measured(result.world, name) for name in names)]
    larger, attempts = next_model(result, here.present, [measured or leading], found, known, begin, rules)
    verdict = Verdict.MISSING if len(leading) == 1 else Verdict.ONE_OF
    return replace(found, verdict=verdict, explanations=tuple(leading), nearest=()), larger, attempts


def _plain(result: SearchResult, rules: StepRules) -> list[tuple[str, ...]]:
    """The effects that are plainly there: what leads, or else all that do as well as the best.

    Of the latter none where one may be the whole of what is missing: which of them it is, a verdict says better.
    """
    asked = result.world, result.base, result.fits, result.examiner
    leads = leading_of(*asked)
    if leads is not None:
        return [(name,) for name in leads.effects if leads.share >= rules.plain]
    there = plainly_there(*asked, rules.plain)
    adequacy = lambda added: result.examiner.adequacy(added, result.fits[added], result.fits)  # noqa: E731
    return [] if any(adequacy(added).why is None for added in there) else [tuple(added) for added in there]


def _was_measured(world: Universe, name: str) -> bool:
    """Whether an effect is a part of the muscle, as a rubber wall is, whose sizes are stated."""
    effect = world.effects[name]
    return bool(effect.gives and effect.needs) and {*effect.needs} <= world.measured


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

    Where none does beside all that was added before, one beside which an earlier effect gives way is taken; before
    that only if it leaves less than half of what the best of those leaves.
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

    def judged(places: Mapping[tuple[str, ...], np.ndarray | None]) -> list[Judged]:
        new = {names: begin for names, begin in places.items() if names not in [fit.names for fit in every]}
        judging = lambda names: judge(here, before, names, rules, names in adequate, added, new[names])  # noqa: E731
        fits = at_once(here.world.settings.workers, judging, list(new))
        attempts.extend(fit.attempt for fit in fits if fit.why)
        every.extend(fits)
        return fits

    yielding = list[Judged]()
    for tier in tiers:
        fits = judged(dict.fromkeys(tier))
        sound = [t for t in (*fits, *judged(led_to(here.world, fits))) if not t.why]
        yielding += [t for t in sound if t.gone and t.names not in adequate]
        standing = in_order([t for t in sound if t not in yielding], rules)
        far_before = _far_before(standing, in_order(yielding, rules), rules)
        yielding = [t for t in yielding if t not in far_before]
        for fit in (*far_before, *standing):
            if (larger := taken(fit, hidden=False)) is not None:
                return larger, tuple(attempts)
    for fit in in_order(yielding, rules):
        if (larger := taken(fit, hidden=False)) is not None:
            return larger, tuple(attempts)
    for names in found.explanations if found.verdict == Verdict.MISSING else ():
        fit = next((fit for fit in every if fit.names == names), None) or judged({names: None})[0]
        hides = is_no_worse_beyond(fit.alike, fit.after, fit.why, rules)
        if hides and (larger := taken(fit, hidden=True)) is not None:
            return larger, tuple(each for each in attempts if each.effects != names)
    return None, tuple(attempts)


def _far_before(standing: Sequence[Judged], yielding: Sequence[Judged], rules: StepRules) -> list[Judged]:
    """Larger models beside which an earlier effect gives way that plainly do better than one beside which none does.

    Rubber in the place of the strand bending that had stood in for it left a tenth of what a tip left beside both.
    """
    if not standing:
        return []
    most = (1 - rules.plain) * standing[0].after.held_out_rmse ** 2
    return [fit for fit in yielding if fit.after.held_out_rmse**2 <= most]
