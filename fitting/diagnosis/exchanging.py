"""Whether another effect explains the readings better in the place of one that was added early.

What is added first has to explain alone what several effects cause. Conical ends may so stand in for a tip correction,
and beside the rubber and the compliant rig that came later the tip correction leaves far less. No step that only adds
gets there, and conical ends do too much to be dropped. Added effects are therefore exchanged one by one, after the
forward steps (Miller 2002, Subset Selection in Regression, 3: replacing predictors). A rubber of two numbers that
stood in for what came later may so become one of a single number, too.
"""

from collections.abc import Callable, Collection, Mapping, Sequence

import numpy as np

from fitting.diagnosis.candidate_fit import CandidateFit
from fitting.diagnosis.course import ModelOnTheWay, values_of
from fitting.diagnosis.findings import Fault
from fitting.diagnosis.judging import fitted
from fitting.diagnosis.likelihood import criteria
from fitting.diagnosis.linear_look import LinearLook
from fitting.diagnosis.next_sets import simpler_relatives
from fitting.diagnosis.search import Search
from fitting.diagnosis.settings import VERDICT, VerdictSettings
from fitting.diagnosis.step_rules import Fitted, StepRules, unsound
from fitting.least_squares import held_out
from mckibben_jax.effect import Effect


def exchanged(
    here: ModelOnTheWay,
    added: Sequence[str],
    known: Mapping[str, Effect],
    begin: Callable[..., Search],
    rules: StepRules,
    adequate: bool = False,
    seen: Collection[frozenset[str]] = (),
    settings: VerdictSettings = VERDICT,
) -> ModelOnTheWay | None:
    """The model with another effect in place of one of its `added` ones; None where none explains the readings better.

    What takes the place has no more parameters: with more of them it would have to pay as a step must that adds. The
    readings must be far likelier, or no less likely where parameters are saved; held-out runs must be predicted no
    worse beyond what instruments can make of them, and the new model must be as sound as one that a step comes to.
    Nothing may be missing from it where the model is `adequate`. `known` are all effects by name; `begin(effects,
    values, confine)` prepares the search of a model. A set of effects that was `seen` on the way is not taken again.
    """
    search, confine = here.search, here.search.base.confined
    world = search.world.confined() if confine else search.world
    before = fitted(search.world, search.base, search)
    for fit in likelier(search, _in_place_of_one(search, added), settings):
        if fit.effects in seen:
            continue
        if adequate and search.examiner.adequacy(frozenset(), fit, search.fits).why is not None:
            continue
        if not _is_sound(before, fitted(world, world.fit(fit.effects, fit.vector), search), rules):
            continue
        present = [known[name] for name in search.world.effects if name in fit.effects]
        other = begin(present, values_of(search.world, fit.vector), confine)
        if _is_sound(before, fitted(other.world, other.base, other), rules):
            new, old = fit.effects - search.base.effects, search.base.effects - fit.effects
            return ModelOnTheWay(tuple(new), present, other, dropped=tuple(old), exchanged=True)
    return None


def likelier(search: Search, others: Sequence[CandidateFit], settings: VerdictSettings) -> list[CandidateFit]:
    """Models that are far likelier than that of a search, or likelier with fewer parameters; the likeliest first.

    By Schwarz's criterion, which counts the parameters: one that is saved may cost as much as it is worth there.
    """
    fits = {fit.effects: fit for fit in (search.alone, *others)}
    found = criteria(list(fits), fits, search.examiner)
    far = 2 * np.log(settings.likelier)
    most = lambda fit: found[search.alone.effects] - far * (len(fit.free) >= len(search.alone.free))  # noqa: E731
    return sorted((fit for fit in others if found[fit.effects] < most(fit)), key=lambda fit: found[fit.effects])


def _in_place_of_one(search: Search, added: Sequence[str]) -> list[CandidateFit]:
    """The models with another effect in place of each of the `added` that a linear look promises the most of."""
    seen, whole = search.seen, search.alone
    jobs = list[tuple[frozenset[str], np.ndarray, Sequence[str]]]()
    for old in added:
        rest = whole.effects - {old}
        if not seen.lacking(rest):
            left = seen.fit(rest, whole.vector, decide=False)
            promise = LinearLook(search.examiner, {frozenset(): left, **search.fits}, left).one_more(frozenset())
            best = [min(new) for new in sorted(promise, key=promise.__getitem__)]
            others = [(seen.with_added([new], rest), left.vector, [new]) for new in best]
            alone = [job for job in others if rest < job[0] and len(seen.free(job[0])) <= len(whole.free)]
            simpler = simpler_relatives(search.world, old)
            jobs += [
                *alone[: search.settings.grown],
                *(job for job in alone[search.settings.grown :] if job[2][0] in simpler),
            ]
    return [fit for fit in seen.fit_all(jobs, decide=False) if np.isfinite(fit.cost)]


def _is_sound(before: Fitted, after: Fitted, rules: StepRules) -> bool:
    """Whether nothing speaks against a model in the place of another with as many effects.

    With fewer parameters it may leave a little more, and predict held-out runs worse by a standard error. Nor may it
    predict them clearly worse as they were read: a lag, likelier if clocks err, took the place of stress softening that
    had taken half of the error.
    """
    simpler = len(after.fit.free) < len(before.fit.free)
    rise, error = held_out.difference(after.beyond(), before.beyond(), before.groups)
    against = [why for why in unsound(before, after, rules) if not (simpler and why.reason is Fault.RISES)]
    as_read, scatter = held_out.difference(after.left_out, before.left_out, before.groups)
    clearly_worse = np.isfinite(scatter) and as_read > VERDICT.clearly * scatter
    allowed = error if simpler and np.isfinite(error) else 0.0  # infinite: of one group
    return rise <= allowed and not clearly_worse and not against
