"""Diagnose and add one effect at a time, until nothing more can be said that a mechanician would sign."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import combinations

from fitting.diagnosis.diagnose import Progress, concluded, library_candidates, one_thread, prepared
from fitting.diagnosis.record import Diagnosis
from fitting.diagnosis.search import Search, SearchResult
from fitting.diagnosis.step_rules import RULES, Fitted, Objection, StepRules, objections
from fitting.diagnosis.universe import CandidateFit
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

    effect: str  # "baseline" first; names joined by "+" where two were added at once
    rmse: float
    held_out_rmse: float
    verdict: str
    diagnosis: Diagnosis
    attempts: tuple[Attempt, ...] = ()


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
    at the optimum of the model before, so that no step raises the error. `candidates` as in `diagnose`; `start` gives
    values (SI, by full name) that were fitted before; `on_step` is called with every step as soon as it is made, with
    all that was tried after it.
    """
    candidates = library_candidates() if candidates is None else candidates
    known = {name_of(effect): effect for effect in (*effects, *candidates)}
    begin = partial(
        prepared, experiments, candidates=list(known.values()), varying=Varying(fix, free, own), seed=seed,
        progress=progress,
    )  # fmt: skip
    steps: list[Step] = []
    present, added, here = list(effects), ("baseline",), begin(effects, start=start)
    while True:
        with one_thread():
            result = here.run()
        found = concluded(result)
        step = Step("+".join(added), found.rmse, found.held_out_rmse, found.verdict, found)
        larger: Larger | None = None
        attempts: tuple[Attempt, ...] = ()
        if len(steps) < rules.steps:
            larger, attempts = _next(result, found, present, known, begin, rules)
        steps.append(replace(step, attempts=attempts))
        if on_step is not None:
            on_step(steps[-1])
        if larger is None:
            return tuple(steps)
        present, added, here = larger.present, larger.added, larger.search


@dataclass(frozen=True)
class Larger:
    """A larger model that obeys the rules: what was added, all its effects, and its search, prepared."""

    added: tuple[str, ...]
    present: list[Effect]
    search: Search


def _next(
    here: SearchResult,
    found: Diagnosis,
    present: Sequence[Effect],
    known: Mapping[str, Effect],
    begin: Callable[..., Search],
    rules: StepRules,
) -> tuple[Larger | None, tuple[Attempt, ...]]:
    """The first proposal that obeys the rules, and those before it that do not."""
    before, attempts = _fitted(here, here.base), []
    adequate = {e.effects for e in found.tried if e.adequate}
    for names in worth_judging(found, rules):
        identified = names in adequate
        fit = _in_lowest_valley(here, names)
        after = _fitted(here, fit)
        why = objections(before, after, rules, identified)
        if not why:
            effects = with_added(present, [known[name] for name in names])
            search = begin(effects, start=_values(here, fit))
            after = _fitted(search, search.base)  # its own search may have ended in a lower valley
            why = objections(before, after, rules, identified)
            if not why:
                return Larger(names, effects, search), tuple(attempts)
        attempts.append(Attempt(names, after.rmse, after.held_out_rmse, why))
    return None, tuple(attempts)


def proposals(found: Diagnosis, rules: StepRules = RULES) -> Iterator[tuple[str, ...]]:
    """What may be added after a diagnosis, in the order in which it is tried.

    First what the verdict names, then what leads; then, where something is missing for certain, every other effect by
    its held-out error. Two at once come after all that stand alone.
    """
    if found.verdict == "nothing detectable":
        return
    named = sorted(found.explanations, key=len)
    order = [e.effects for e in found.tried]  # by held-out error
    singles = [names for names in order if len(names) == 1]
    members = [names for names in singles if any(names[0] in group for group in named)]
    whole = [names for names in named if len(names) <= 2]
    parts = [pair for group in named if len(group) > 2 for pair in combinations(group, 2)]
    leading = [] if found.leading is None else [(name,) for name in found.leading.effects]
    yield from dict.fromkeys(
        [*(names for names in members if names in named), *members, *whole, *(p for p in parts if p in order), *leading]
        + ([] if found.verdict == "inconclusive" else singles + _pairs(order, rules))
    )


def _pairs(order: Sequence[tuple[str, ...]], rules: StepRules) -> list[tuple[str, ...]]:
    return [names for names in order if len(names) == 2][: rules.pairs]


def worth_judging(found: Diagnosis, rules: StepRules = RULES) -> list[tuple[str, ...]]:
    """The proposals that at first sight lower the held-out error enough, and all that is named or leads."""
    by_name = {e.effects: e for e in found.tried}
    wanted = []
    for names in proposals(found, rules):
        share = 1 - rules.share if not by_name[names].adequate else WORTH_IT
        if by_name[names].fall > rules.errors and by_name[names].held_out_rmse < share * found.held_out_rmse:
            wanted.append(names)
    return wanted


def _in_lowest_valley(here: SearchResult, names: Sequence[str]) -> CandidateFit:
    """A larger model as the search has fitted it, or from the smaller one's optimum, whichever ended lower."""
    fit = here.fits[frozenset(names)]
    return min(fit, here.world.fit_from_smaller(fit.effects, here.base), key=lambda each: each.cost)


def _fitted(search: Search | SearchResult, fit: CandidateFit) -> Fitted:
    examiner = search.examiner
    return Fitted(search.world, fit, examiner.left_out(fit), examiner.groups)


def _values(search: SearchResult, fit: CandidateFit) -> dict[str, float]:
    """The values of a fit by full name, SI."""
    return dict(zip(search.world.layout.names, map(float, fit.vector), strict=True))


def with_added(present: Sequence[Effect], new: Sequence[Effect]) -> list[Effect]:
    """A set of effects with others added, each in place of its rivals."""
    return list(with_effects(present, new))
