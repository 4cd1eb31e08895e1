"""Diagnose and add one effect at a time, until nothing more can be said that a mechanician would sign."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

from fitting.diagnosis.course import ModelOnTheWay, OnStep, Step, values_of
from fitting.diagnosis.diagnose import Progress, concluded, library_candidates, one_thread, prepared
from fitting.diagnosis.dropping import smaller_models, without_idle
from fitting.diagnosis.exchanging import exchanged
from fitting.diagnosis.findings import Attempt
from fitting.diagnosis.next_model import next_model, plain_step
from fitting.diagnosis.record import Diagnosis
from fitting.diagnosis.search import Search
from fitting.diagnosis.stated_sizes import with_sizes_confined
from fitting.diagnosis.step_rules import RULES, StepRules, denials, denied_sizes
from fitting.diagnosis.tiers import worth_judging
from fitting.problem.varying import Varying
from fitting.recordings.records import Experiment
from mckibben_jax.effect import Effect, name_of


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
    sizes are confined to what was stated (`stated_sizes`) from that step on. Where a model denies one and nothing can
    be added, the next step is the same model with its sizes confined, if something can be added to that; from a model
    that lacks nothing only where it denies one absurdly, and these steps end at a model that lacks nothing either. In
    the end, what does not pay any more beside what was added later, or what an adequate model does not need, is
    dropped; what another effect explains better is exchanged for that.
    `candidates` as in `diagnose`; `start` gives values (SI, by full name) that were fitted before; `on_step` is called
    with every step as soon as it is made, with all that was tried after it.
    """
    known = library_candidates() if candidates is None else candidates
    varying = Varying(tuple(fix), tuple(free), tuple(own))
    way = _Way(experiments, effects, known, varying, seed, rules, on_step, progress)
    last, adequate = way.forward(ModelOnTheWay(("baseline",), list(effects), way.begin(effects, start)))
    for smaller in smaller_models(last, adequate, way.added_to(last), way.begin):
        way.tell(smaller)
    return tuple(way.steps)


class _Way:
    """The way of a discovery: what it is asked, the steps that were told, and the sets of effects that were seen."""

    def __init__(
        self,
        experiments: Sequence[Experiment],
        effects: Sequence[Effect],
        candidates: Sequence[Effect],
        varying: Varying,
        seed: int,
        rules: StepRules,
        on_step: OnStep | None,
        progress: Progress | None,
    ):
        self.experiments, self.varying, self.seed, self.rules = experiments, varying, seed, rules
        self.on_step, self.progress = on_step or (lambda _: None), progress
        self.known = {name_of(effect): effect for effect in (*effects, *candidates)}
        self.begun = {name_of(effect) for effect in effects}
        # what took the place of an effect stays: without both there would be neither
        self.families = {effect.family for effect in effects} - {None}
        self.steps: list[Step] = []
        self.seen: list[frozenset[str]] = []
        self.looked_at: dict[tuple[frozenset[str], bool], tuple[Diagnosis, bool, tuple[Attempt, ...]]] = {}

    def begin(self, present: Sequence[Effect], start: Mapping[str, float] | None, confine: bool = False) -> Search:
        """The search of what is missing from a model."""
        return prepared(
            self.experiments, present, candidates=list(self.known.values()), varying=self.varying, seed=self.seed,
            progress=self.progress, start=start, confine=confine,
        )  # fmt: skip

    def tell(self, step: Step) -> None:
        """Take a step for made."""
        self.steps.append(step)
        self.on_step(step)

    def added_to(self, here: ModelOnTheWay) -> list[str]:
        """The effects of a model that were added on the way, and took no other one's place."""
        names = (name_of(effect) for effect in here.present if effect.family not in self.families)
        return [name for name in names if name not in self.begun]

    def forward(self, here: ModelOnTheWay) -> tuple[ModelOnTheWay, bool]:
        """The last model that steps lead to from here, each of them told, and whether nothing is missing from it."""
        before = here, False
        while True:
            self.seen.append(_names(here))
            found, adequate, larger, attempts = self._larger(here)
            if here.held and not here.added and larger is None and not adequate:
                return before  # nothing can be added with the measured sizes either: they explain no more, and err more
            self.tell(here.step(found, attempts))
            other = larger or self._beside(here, adequate)
            if other is None and (other := self._with_believed_sizes(here, adequate)) is not None and adequate:
                return self._complete_from(other) or (here, adequate)
            if other is None:
                return here, adequate
            before, here = (here, adequate), other

    def _complete_from(self, here: ModelOnTheWay) -> tuple[ModelOnTheWay, bool] | None:
        """The complete model that steps lead to from here, told then; None where they lead to none.

        What lacks nothing is left for another model only if that lacks nothing either: a size may have been read wrong.
        """
        told, first, self.on_step = self.on_step, len(self.steps), lambda _: None
        try:
            last, adequate = self.forward(here)
        finally:
            self.on_step = told
        if not adequate:
            del self.steps[first:]
            return None
        for step in self.steps[first:]:
            told(step)
        return last, adequate

    def _larger(self, here: ModelOnTheWay) -> tuple[Diagnosis, bool, ModelOnTheWay | None, tuple[Attempt, ...]]:
        """What a model lacks, whether that is nothing, the next model with more effects, and what was tried beside.

        Where the way has come back to a model at which all was looked at, that is known, and nothing leads on from it.
        """
        more = self._standing(here) < self.rules.steps and self._is_short
        if more:
            found, larger, attempts = plain_step(here, self.known, self.begin, self.rules)
            if found is not None and (larger := self._unseen(larger)) is not None:
                return found, False, larger, attempts
        place = _names(here), here.search.base.confined
        if place not in self.looked_at:
            with one_thread():
                result = here.search.run()
            found, larger, attempts = concluded(result), None, ()
            if more:
                tiers = worth_judging(found, self.rules)
                larger, attempts = next_model(
                    result, here.present, tiers, found, self.known, self.begin, self.rules, self.added_to(here)
                )
            self.looked_at[place] = found, result.base_is_adequate, attempts
            return found, result.base_is_adequate, self._unseen(larger), attempts
        found, adequate, attempts = self.looked_at[place]
        return found, adequate, None, attempts

    def _beside(self, here: ModelOnTheWay, adequate: bool) -> ModelOnTheWay | None:
        """The model to go on with where none with more effects is: one without what is idle, or one of as many."""
        other = None
        with one_thread():
            if here.added and not adequate:  # once: step by step all would go
                other = without_idle(here, self.added_to(here), self.begin, self.rules)
            if other is None and self._is_short:
                added = self.added_to(here)
                other = exchanged(here, added, self.known, self.begin, self.rules, adequate, self.seen)
        return other

    def _with_believed_sizes(self, here: ModelOnTheWay, adequate: bool) -> ModelOnTheWay | None:
        """The same model with the stated sizes confined, where it denies one and nothing is added.

        Wrong sizes may stand in for what is missing so well that nothing beside them shows it. Where nothing else is
        missing, a size is believed to have been read wrong unless that is absurd. A size that does not vary was fixed
        by the user.
        """
        if not self._is_short or here.search.base.confined:
            return None
        world, fit = here.search.world, here.search.base
        rules = replace(self.rules, denied=self.rules.absurd) if adequate else self.rules
        if not any(denied in fit.free for denied in denied_sizes(denials(world, fit, rules))):
            return None
        search = self.begin(here.present, values_of(world, with_sizes_confined(world, fit).vector), True)
        return ModelOnTheWay((), here.present, search, held=tuple(n for n in world.from_stated(fit) if n in fit.free))

    @property
    def _is_short(self) -> bool:
        """Whether there may be more steps."""
        return len(self.steps) < self.rules.longest

    def _standing(self, here: ModelOnTheWay) -> int:
        """The steps whose effects stand in a model, with its own."""
        return sum(not _names(here).isdisjoint(step.added) for step in (*self.steps, here))

    def _unseen(self, model: ModelOnTheWay | None) -> ModelOnTheWay | None:
        """The model, unless it was on the way already: what was dropped from it is not added again."""
        return None if model is None or _names(model) in self.seen else model


def _names(model: ModelOnTheWay) -> frozenset[str]:
    return frozenset(name_of(effect) for effect in model.present)
