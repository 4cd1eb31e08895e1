"""The search behind a diagnosis, level by level: what was fitted, what was tested, what stands."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cached_property
from itertools import combinations
from typing import TypeVar

import numpy as np

from fitting.diagnosis.adequacy import AdequacyTest
from fitting.diagnosis.candidate_fit import CandidateFit
from fitting.diagnosis.examine import Examiner
from fitting.diagnosis.larger_sets import is_hopeless
from fitting.diagnosis.likelihood import outdone
from fitting.diagnosis.linear_look import LinearLook
from fitting.diagnosis.next_sets import pairs_with_needs, simpler
from fitting.diagnosis.outcomes import Reason, Why
from fitting.diagnosis.search_result import SearchResult
from fitting.diagnosis.trusting import begun_again, fit_trusting
from fitting.diagnosis.universe import Universe
from fitting.least_squares.record import Fit
from fitting.progress import Progress, unwatched
from fitting.threads import at_once

LEVELS = {2: "pairs", 3: "triples"}
Result = TypeVar("Result")


class Search:
    """A search over sets of effects, level by level; what it has fitted and tested so far is its own."""

    def __init__(
        self,
        world: Universe,
        base: CandidateFit,
        examiner: Examiner,
        baseline: Fit,
        progress: Progress,
        notes: tuple[str, ...] = (),
        moving_only: bool = False,
        run_names: tuple[tuple[str, str], ...] = (),
    ):
        self.world, self.base, self.examiner, self.baseline, self.progress = world, base, examiner, baseline, progress
        self.notes, self.moving_only, self.run_names = notes, moving_only, run_names
        self.settings = examiner.settings.search
        self.fits: dict[frozenset[str], CandidateFit] = {}  # by what was added
        self.adequacy_tests: dict[frozenset[str], AdequacyTest] = {}
        self.numberless: set[frozenset[str]] = set()  # sets that give no number, from any starting value
        self.seeds: set[frozenset[str]] = set()  # sets with which every other effect was looked at
        self.adequate: list[frozenset[str]] = []
        self.hopeless = False  # no three effects were looked for, for all together would not do

    @classmethod
    def resumed(cls, result: SearchResult) -> "Search":
        """A search that goes on from what another came to."""
        search = cls(result.world, result.base, result.examiner, result.baseline, unwatched)
        search.fits.update(result.fits)
        return search

    def glance(self) -> SearchResult:
        """What single effects do, and whether anything is missing: without limits, and nothing else is tested."""
        self.progress("one effect at a time", 0.1)
        self.fit_singles()
        test = self.examiner.adequacy(frozenset(), self.base, self.fits)
        return self.result(test, not test.rejected and not self.bettered(frozenset()))

    def run(self) -> SearchResult:
        """Stop at the first level with an adequate member, having looked one level further."""
        self.progress("one effect at a time", 0.1)
        self.fit_singles()
        test = self.examiner.adequacy(frozenset(), self.base, self.fits, limits=True)
        base_is_adequate = not test.rejected and not self.bettered(frozenset())
        if not base_is_adequate:
            self.levels()
        return self.result(test, base_is_adequate)

    def fit_singles(self) -> None:
        """Every effect by itself, as far as it was not fitted yet."""
        singles = [frozenset([name]) for name in self.world.candidates]
        new = [added for added in self.not_fitted(singles) if added not in self.numberless]
        self.fit_level(new, True)
        new = [added for added in new if added in self.fits]
        fit_trusting(self.examiner, self.fits, new)
        better = begun_again(self.examiner, self.fits, new)
        self.fits.update({added: self.seen.decided(fit) for added, fit in better.items()})

    def result(self, test: AdequacyTest, base_is_adequate: bool) -> SearchResult:
        """All that was fitted and tested, with the test of the base."""
        return SearchResult(
            self.world, self.base, self.baseline, self.examiner, test, base_is_adequate, dict(self.fits),
            dict(self.adequacy_tests), tuple(self.adequate), frozenset(self.numberless), self.notes, self.moving_only,
            self.run_names, self.hopeless,
        )  # fmt: skip

    def levels(self) -> None:
        """Single effects, pairs and triples, until some stand and none with an effect more is far likelier."""
        stood: list[list[frozenset[str]]] = []
        for size, pool in ((1, self.settings.best_singles), (2, self.settings.best_tripled), (3, 0)):
            self.level(size, pool)
            stood.append(self.standing(size))
            if self.hopeless or (stood[-1] and not self.is_outdone(size)):
                break
        self.adequate = self.not_outdone(stood)

    def standing(self, size: int) -> list[frozenset[str]]:
        """The sets of one size that stand."""
        return [added for added in self.adequate if len(added) == size]

    def level(self, size: int, pool: int) -> None:
        """Fit and test the sets of one size; some larger ones are fitted too, if all together might do."""
        if size > 1:
            for _ in range(self.settings.rounds):
                self.fit_level(self.grown([*self.parts(self.best(size)), *self.best(size - 1)]))
        if size == 2:
            self.fit_level(self.not_fitted(pairs_with_needs(self.world)))
        self.hopeless = size == 2 and self.is_hopeless()
        if size < 3 and not self.hopeless:
            self.progress(LEVELS[size + 1], 0.25 * size + 0.1)
            self.fit_level(self.promising(size + 1, pool))
        self.progress(f"testing sets of {size}", 0.25 * size + 0.2)
        self.test_level(size, self.settings.tested_at_a_look if self.hopeless else self.settings.tested)
        if size > 1 and (standing := self.standing(size)):  # others that do as well as these
            self.fit_level([*self.grown(self.parts(standing)), *self.not_fitted(simpler(self.world, standing))])
            self.test_level(size, self.settings.tested)
        self.drop_surpassed(size)

    def drop_surpassed(self, size: int) -> None:
        """Let none of a size stand where one that was refused makes the readings far likelier than all that do.

        The test may be blind to what a set lacks, the likelihood is not; what is far likelier is not the truth either,
        so the truth is larger.
        """
        standing = self.standing(size)
        tested = [added for added in self.best(size) if added in self.adequacy_tests][: self.settings.grown]
        plenty = all(self.examiner.has_plenty(self.fits[added]) for added in tested)
        if plenty and outdone(standing, tested, self.fits, self.examiner):
            self.adequate = [added for added in self.adequate if added not in standing]
            self.are_less_likely(standing)

    def are_less_likely(self, sets: Sequence[frozenset[str]]) -> None:
        """Note of sets that passed their test that another makes the readings far likelier."""
        for added in sets:
            self.adequacy_tests[added] = replace(self.adequacy_tests[added], why=Why(Reason.LESS_LIKELY))

    def is_outdone(self, size: int) -> bool:
        """Whether a set with an effect more stands, too, and makes the readings far likelier than those of this size.

        No larger ones are looked for if none of the best few stands: on measured hoses that took three times as long.
        """
        if size == max(LEVELS):
            return False
        standing = self.standing(size)
        self.fit_level(self.grown(standing))
        if not outdone(standing, self.best(size + 1)[: self.settings.grown], self.fits, self.examiner):
            return False
        self.test_level(size + 1, self.settings.tested_at_a_look)
        return outdone(standing, self.standing(size + 1), self.fits, self.examiner)

    def not_outdone(self, stood: Sequence[Sequence[frozenset[str]]]) -> list[frozenset[str]]:
        """The smallest of all sets that stand, unless larger ones that stand are far likelier."""
        chosen: list[frozenset[str]] = []
        for larger in stood:
            if chosen and outdone(chosen, larger, self.fits, self.examiner):
                self.are_less_likely(chosen)
                chosen = []
            chosen = chosen or list(larger)
        return chosen

    def is_hopeless(self) -> bool:
        """Whether no three effects will do, for all together, beside the best two, would not."""
        best = self.best(2)[:1]
        return bool(best) and is_hopeless(self.examiner, self.fits[best[0]], self.fits, self.settings)

    @property
    def seen(self) -> Universe:
        """The universe in which sets are fitted."""
        return self.examiner.seen

    @property
    def alone(self) -> CandidateFit:
        """The base fitted as the sets are, and to the end: each set begins there, and would else go on from there."""
        return self.examiner.alone

    @cached_property
    def look(self) -> LinearLook:
        """What the fits so far promise of larger sets."""
        return LinearLook(self.examiner, self.fits, self.alone)

    def fit_level(self, sets: Sequence[frozenset[str]], decide: bool = False) -> None:
        """Refit the base with each of these sets added; one that gives no number anywhere explains nothing.

        Whether data hold what ends at its bound is asked of what is tested, and of single effects (`decide`).
        """
        jobs, keys = [], []
        for added in sets:
            effects = self.world.with_added(sorted(added))
            if added <= effects and self.world.possible(effects, sorted(added)):
                jobs.append((effects, *self.beginning(added)))
                keys.append(added)
        fits = zip(keys, self.seen.fit_all(jobs, decide), strict=True)
        for added, fit in fits:
            if np.isfinite(fit.cost):
                self.fits[added] = fit
            else:
                self.numberless.add(added)

    def not_fitted(self, sets: Sequence[frozenset[str]]) -> list[frozenset[str]]:
        """Those of these sets that were not fitted yet."""
        return [added for added in sets if added not in self.fits]

    def beginning(self, added: frozenset[str]) -> tuple[np.ndarray, Sequence[str]]:
        """Where a set's fit starts: at the best smaller one inside it, with the rest as fitted alone."""
        inside = [self.fits[part] for part in self.fits if part < added]
        if not inside:
            return self.alone.vector, sorted(added)
        best = min(inside, key=lambda fit: fit.cost)
        vector = best.vector.copy()
        for name in added - best.effects:
            own = self.world.layout.at(self.world.layout.of_effect(name))
            alone = self.fits.get(frozenset([name]))
            if alone is not None:
                vector[own] = alone.vector[own]
        return vector, ()

    def promising(self, size: int, pool: int) -> list[frozenset[str]]:
        """Larger sets that a linear look at the rows promises the most of."""
        names = [min(added) for added in self.best(1) if self.moves(added)][:pool]
        promise = []
        for group in combinations(sorted(names), size):
            if self.world.possible(self.world.with_added(group), group):
                promise.append((self.look.together(group), frozenset(group)))
        return [added for _, added in sorted(promise, key=lambda p: p[0])[: self.settings.refitted]]

    def moves(self, added: frozenset[str]) -> bool:
        """Whether each effect of a fitted set changes what is predicted: a lag does nothing where nothing moves."""
        smaller = [self.fits.get(added - {name}) for name in added] if len(added) > 1 else [self.alone]
        rows = self.fits[added].rows
        least, norm = self.settings.unmoved, np.linalg.norm
        return all(norm(rows - fit.rows) > least * norm(fit.rows) for fit in smaller if fit is not None)

    def grown(self, seeds: Sequence[frozenset[str]]) -> list[frozenset[str]]:
        """Larger sets, not fitted yet, that a linear look beside the first of these promises the most of.

        What an effect would change beside others is not what it changes alone, where a larger one may hide it.
        """
        fresh = [each for each in dict.fromkeys(seeds) if each not in self.seeds][: self.settings.grown]
        self.seeds.update(fresh)
        promise: dict[frozenset[str], float] = {}
        for promised in self._each(self.look.one_more, fresh):
            promise |= {added: min(cost, promise.get(added, np.inf)) for added, cost in promised.items()}
        return self.not_fitted(sorted(promise, key=promise.__getitem__))[: self.settings.added]

    def parts(self, sets: Sequence[frozenset[str]]) -> list[frozenset[str]]:
        """Sets without one of their members, as far as they can be fitted."""
        smaller = list(dict.fromkeys(added - {name} for added in sets[: self.settings.grown] for name in sorted(added)))
        self.fit_level(self.not_fitted(smaller))
        return [added for added in smaller if added in self.fits]

    def best(self, size: int) -> list[frozenset[str]]:
        """Fitted sets of one size, the best first.

        What counts is what they leave when instruments within their accuracy have given way: a gain of the load cell
        lowers the sum of squares by far more than a small effect, and explains nothing.
        """
        return sorted((added for added in self.fits if len(added) == size), key=self.left)

    def left(self, added: frozenset[str]) -> float:
        """Sum of squares that a fitted set leaves beyond what instruments can make of the rows."""
        return self.examiner.left(self.fits[added])

    def bettered(self, added: frozenset[str]) -> bool:
        """Whether one more effect brings the error far down."""
        mine = self.base if not added else self.fits[added]
        more = [t for key, t in self.fits.items() if len(key) == len(added) + 1 and added < key]
        bound = self.settings.bettered**2 * self.examiner.left(mine)
        return any(self.examiner.left(fit) < bound for fit in more)

    def test_level(self, size: int, most: int) -> None:
        """Test the best sets of one size, so many at most, some at a time."""
        level = [added for added in self.best(size) if self.moves(added)]
        best = self.left(level[0]) if level else 0.0
        near = [added for added in level[:most] if self.left(added) <= best / self.settings.bettered**2]
        new = [added for added in near if added not in self.adequacy_tests]
        if size > 1:  # single effects have begun again already
            self.fits.update(begun_again(self.examiner, self.fits, new))
        self.fits.update(zip(new, self._each(lambda added: self.seen.decided(self.fits[added]), new), strict=True))
        for added, adequacy in zip(new, self._each(self._adequacy, new), strict=True):
            self.adequacy_tests[added] = adequacy
            if adequacy.why is None:
                self.adequate.append(added)

    def _adequacy(self, added: frozenset[str]) -> AdequacyTest:
        """The test of one fitted set."""
        return self.examiner.adequacy(added, self.fits[added], self.fits, bettered=self.bettered(added))

    def _each(self, work: Callable[[frozenset[str]], Result], sets: Sequence[frozenset[str]]) -> list[Result]:
        """What becomes of each set, some at a time."""
        return at_once(self.world.settings.workers, work, sets)
