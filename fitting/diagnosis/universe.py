"""Every effect at once, switched: any subset of them is fitted by the same compiled function."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import islice, product

import numpy as np

from fitting.diagnosis.candidate_fit import CandidateFit
from fitting.diagnosis.outcomes import Why
from fitting.diagnosis.settings import FITS, FitSettings
from fitting.instruments.through import Through
from fitting.least_squares.decomposed import lstsq
from fitting.least_squares.held_out import HELD_OUT, left_out_rows
from fitting.least_squares.search import SearchResult, solve
from fitting.least_squares.subset import Subset
from fitting.least_squares.uncertainty import at_bound
from fitting.problem.residuals import LIGHT, Problem, Samples
from fitting.problem.sizes import Standard, widened
from fitting.problem.unknowns import Unknowns
from fitting.recordings.accuracy import Accuracy
from fitting.threads import at_once
from mckibben_jax.effect import Effect
from mckibben_jax.model import Model


@dataclass(frozen=True)
class Universe:
    """Data sets, and every effect that is in the model or may be missing from it."""

    layout: Unknowns
    problem: Problem  # of standard size
    real: np.ndarray  # which of its rows are measurements that carry weight, in the order of `samples`
    samples: Samples
    base: tuple[str, ...]
    candidates: tuple[str, ...]
    untestable: dict[str, Why]
    always_free: tuple[str, ...]  # of the muscle
    fixed: tuple[str, ...]
    start: np.ndarray
    measured: frozenset[str]  # quantities that are known of every muscle
    lengths: np.ndarray  # m, at rest, of each data set's muscle
    accuracies: tuple[Accuracy, ...]  # of the instruments of each recording
    room: int  # for how many errors of instruments there is room in memory
    through: Through  # what instruments can make of the rows; nothing, where fits trust every reading
    settings: FitSettings = FITS
    is_confined: bool = False  # to within a few standard errors of the stated sizes

    @property
    def template(self) -> Model:
        """The model with every effect."""
        return self.layout.templates[0]

    @cached_property
    def effects(self) -> dict[str, Effect]:
        """Every effect by its name, in the order in which they act."""
        return dict(zip(self.template.names, self.template.effects, strict=True))

    @property
    def standard(self) -> Standard:
        """The problem as it is searched, and where the measurements and the stated sizes stand in it."""
        return Standard(self.problem, np.concatenate([self.real, self._count + np.arange(len(self._stated))]))

    @property
    def _count(self) -> int:
        """Rows of the measurements, with and without weight; those of the priors stand behind them."""
        return sum(block.keep.size for block in self.problem.blocks)

    @property
    def _stated(self) -> tuple[str, ...]:
        """The sizes of muscles that are stated with errors."""
        return tuple(entry.name for entry in self.layout.entries if entry.prior is not None)

    @property
    def in_newtons(self) -> np.ndarray:
        """Which rows measure force; all, where only positions were measured."""
        parts = [np.full(block.keep.size, block.of_force) for block in self.problem.blocks]
        of_force = np.concatenate(parts)[self.real]
        return of_force if of_force.any() else ~of_force

    def rmse(self, rows: np.ndarray) -> float:
        """Root mean square in N (in m, where only positions were measured)."""
        return float(np.sqrt(np.mean((rows * self.samples.sigma)[self.in_newtons] ** 2)))

    def with_added(self, added: Iterable[str], base: Iterable[str] | None = None) -> frozenset[str]:
        """The base with effects added, each in place of its rivals."""
        chosen = set(self.base if base is None else base)
        for new in added:
            family = self.effects[new].family
            chosen = {old for old in chosen if family is None or self.effects[old].family != family} | {new}
        return frozenset(chosen)

    def possible(self, effects: Iterable[str], added: Sequence[str]) -> bool:
        """Whether a set holds together: needs are met, and no two of the added are rivals."""
        families = [self.effects[name].family for name in added if self.effects[name].family]
        return len(set(families)) == len(families) and not self.lacking(effects)

    def lacking(self, effects: Iterable[str]) -> tuple[str, ...]:
        """What the effects of a set need and neither muscle nor set has."""
        members = [self.effects[name] for name in effects]
        given = {thing for effect in members for thing in effect.gives} | self.measured
        return tuple(need for effect in members for need in effect.needs if need not in given)

    def switches(self, effects: Iterable[str]) -> np.ndarray:
        """1 for the effects of a set, 0 for all others."""
        chosen = set(effects)
        return np.array([name in chosen for name in self.effects], float)

    def free(self, effects: Iterable[str]) -> tuple[str, ...]:
        """What varies when a set is fitted."""
        own = [name for effect in sorted(effects) for name in self.layout.of_effect(effect)]
        return (*self.always_free, *(name for name in own if name not in self.fixed))

    def fit(
        self,
        effects: frozenset[str],
        start: np.ndarray,
        new: Sequence[str] = (),
        decide: bool = True,
        enough: float = 0.0,
    ) -> CandidateFit:
        """Fit a set of effects from a vector of all unknowns; the new ones' shapes from several starts.

        Unless it is to `decide`, whatever is at its bound is taken to be held there: to ask the data takes a refit.
        `enough` is a share of the sum of squares, as of `solve`. Of several starts, the best is searched to the end.
        """
        names = self.free(effects)
        subset = self.subset(effects, self.layout.at(names), start)
        begin = self._starts(subset, names, start, new)
        rough = max(enough, self.settings.screened) if len(begin) > 1 else enough
        best = None
        for place in begin:  # one at a time: any number of starts is the same compiled function
            found = self.searched(subset, place, enough=rough)
            if best is None or float(found.cost) < float(best.cost):
                best = found
        assert best is not None
        if rough > enough:
            best = self.searched(subset, np.asarray(best.place), enough=enough)
        return self._candidate(effects, names, subset, best, decide)

    def at(self, effects: frozenset[str], vector: np.ndarray) -> CandidateFit:
        """A set of effects with these values of all unknowns, not searched any further."""
        names = self.free(effects)
        subset = self.subset(effects, self.layout.at(names), vector)
        return self._candidate(effects, names, subset, self.looked_at(subset), decide=False)

    def settled(self, effects: frozenset[str], start: np.ndarray) -> CandidateFit:
        """A set fitted by one search after another, until one more lowers the sum of squares by next to nothing."""
        fit, searches = self.fit(effects, start, decide=False), 1
        while searches < self.settings.searches:
            before, fit = fit, self.fit(effects, fit.vector, decide=False)
            searches += 1
            if fit.cost > (1 - self.settings.screened) * before.cost:
                break
        return self.decided(fit)

    def decided(self, fit: CandidateFit) -> CandidateFit:
        """The same set fitted to the end, the data having been asked whether they hold what ends at its bound."""
        return fit if fit.is_decided else self.fit(fit.effects, fit.vector)

    def searched(
        self, subset: Subset, place: np.ndarray, problem: Problem | None = None, look: bool = False, enough: float = 0.0
    ) -> SearchResult:
        """One search, of the compiled function that all of them share; on another problem of this shape, if given.

        What is found is as it is seen through the instruments.
        """
        given, through = self.problem if problem is None else problem, self.through.exact if look else self.through
        return solve(given, subset, place, self.settings.steps, np.array(look), np.array(enough), through)

    def looked_at(self, subset: Subset, problem: Problem | None = None) -> SearchResult:
        """Rows and slopes at the values in `subset.full`."""
        return self.searched(subset, subset.place(subset.full), problem, look=True)

    def _candidate(
        self, effects: frozenset[str], names: tuple[str, ...], subset: Subset, found: SearchResult, decide: bool
    ) -> CandidateFit:
        count, k = self._count, len(names)
        all_rows = self.through.undone(np.asarray(found.rows))
        all_slopes = self.through.undone(np.asarray(found.slopes)[:, :k])
        vector = subset.vector(np.asarray(found.place))[: len(self.layout.names)]
        ends = at_bound(names, np.asarray(found.place)[:k])
        if decide:
            ends = tuple(name for name in ends if self._held(subset, names.index(name), found))
        all_slopes = all_slopes * [name not in ends for name in names]  # what stands at its bound cannot give way
        rows, slopes = all_rows[self.real], all_slopes[self.real]
        last = count + len(self._stated)  # what stands behind them is there to fill a standard size
        priors = all_rows[count:last], all_slopes[count:last]
        how = self.is_confined, decide, self.allows_for_instruments
        return CandidateFit(effects, vector, names, rows, slopes, *priors, ends, *how)

    def _held(self, subset: Subset, at: int, found: SearchResult) -> bool:
        """Whether the data hold one free parameter at the end of its range, or would as soon have it inside."""
        place = np.asarray(found.place).copy()
        shift = np.clip(place[at], self.settings.inside, 1 - self.settings.inside) - place[at]
        scatter = float(np.mean(np.asarray(found.rows)[: self._count][self.real] ** 2))
        may_rise = self.settings.undecided * scatter
        if self._is_stated(int(subset.free[at])) or _rise(found, at, shift) > self.settings.surely * may_rise:
            return True  # a stated size that is denied; or what no refit could make up for
        place[at] += shift
        slot = len(self.layout.names)  # nothing reads it
        free = np.where(np.arange(len(place)) == at, slot, subset.free)
        rest = replace(subset, full=subset.vector(place), free=free)
        again = self.searched(rest, rest.place(rest.full), enough=self.settings.decided)
        return float(again.cost) > float(found.cost) + may_rise

    def _is_stated(self, position: int) -> bool:
        """Whether an unknown is a stated size of a muscle."""
        return self.layout.entries[position].prior is not None

    def confined(self) -> "Universe":
        """The same where no stated size can leave what was stated by more than a few of its standard errors."""
        return replace(self, layout=self.layout.confined(self.settings.believed), is_confined=True)

    @property
    def allows_for_instruments(self) -> bool:
        """Whether fits know that instruments err."""
        return bool(np.any(self.through.errors))

    def seen_through(self, errors: np.ndarray) -> "Universe":
        """The same where fits know what instruments can make of the rows: columns (rows, errors).

        A fit that trusts every reading bends what is fitted to what a load cell's gain has made: a small effect ends
        where it helps the gain. Where there are more errors than a search has room for, fits trust every reading.
        """
        if errors.shape[1] > self.room:
            return self
        wide = np.zeros((self.problem.count, errors.shape[1]))
        wide[self.real] = errors
        return replace(self, through=Through.of(wide, self.through.size))

    def as_seen(self, columns: np.ndarray) -> np.ndarray:
        """Rows (rows,) or columns (rows, q) of the measurements as such a fit sees them."""
        through = self.through
        return replace(through, errors=through.errors[self.real])(columns)

    def fit_all(
        self, sets: Sequence[tuple[frozenset[str], np.ndarray, Sequence[str]]], decide: bool = True
    ) -> list[CandidateFit]:
        """Fit many sets, some at a time; arguments as of `fit`.

        Their searches end where little is left to gain, and sooner unless they are to `decide`: of other candidates few
        will matter.
        """
        enough = self.settings.decided if decide else self.settings.screened
        return at_once(self.settings.workers, lambda job: self.fit(*job, decide=decide, enough=enough), sets)

    def mimicking(self, fit: CandidateFit) -> "Universe":
        """The same data sets, had they measured exactly what this fit predicts."""
        blocks = []
        wide = widened(fit.rows * self.samples.sigma, self.real, self._count)
        for block, change in zip(self.problem.blocks, self.problem.split(wide), strict=True):
            blocks.append(replace(block, measured=block.measured + change.reshape(block.measured.shape)))
        return replace(self, problem=replace(self.problem, blocks=tuple(blocks)))

    def contradicted(self, fit: CandidateFit) -> tuple[str, ...]:
        """Stated measurements of the muscle that a fit denies: more than four standard errors away."""
        return tuple(name for name, z in self.from_stated(fit).items() if abs(z) > self.settings.denied)

    def from_stated(self, fit: CandidateFit) -> dict[str, float]:
        """How far each stated size of the muscle is from what was stated, in standard errors of the statement."""
        return dict(zip(self._stated, map(float, fit.prior_rows), strict=True))

    def left_out(
        self,
        fit: CandidateFit,
        group: np.ndarray,
        glance: bool = False,
        whitened: Callable[[np.ndarray], np.ndarray] = lambda rows: rows,
    ) -> np.ndarray:
        """The rows of a fit on groups of rows left out: refitted where there are few, else in one step from the fit.

        Those of each group are taken from all rows at the parameters fitted without it, once these are `whitened`: what
        an instrument did to all of them is the same error for all, and fits without this or that differ in it.
        """
        if glance or len(self.samples) > HELD_OUT.refit_below:
            plain = fit.plain
            return left_out_rows(plain.rows, plain.slopes, plain.prior_rows, plain.prior_slopes, group)
        world, rows = self.confined() if fit.confined else self, fit.rows.copy()

        def refitted(left_out: np.ndarray) -> np.ndarray:
            rest = world.without(left_out).fit(fit.effects, fit.vector, decide=False)
            return whitened(rest.rows * np.where(left_out, LIGHT, 1.0))[left_out]

        masks = [group == g for g in np.unique(group)]
        for mask, left in zip(masks, at_once(self.settings.workers, refitted, masks), strict=True):
            rows[mask] = left
        return rows

    def without(self, left_out: np.ndarray) -> "Universe":
        """The same where these rows (a mask) count next to nothing, nor what instruments can make of them."""
        rest = replace(self, problem=self.standard.without(left_out).problem)
        if not self.allows_for_instruments:
            return rest
        light = np.where(widened(left_out, self.real, self.problem.count), 1 / LIGHT, 1.0)
        return replace(rest, through=Through.of(light[:, None] * self.through.errors, self.through.size))

    def rows_at(self, fit: CandidateFit, problem: Problem, without: Iterable[str] = ()) -> np.ndarray:
        """The rows (rows,) of a fitted set on another problem of the same shape, some of its effects switched off."""
        subset = self.subset(fit.effects - set(without), (), fit.vector)
        found = self.looked_at(subset, problem)
        return np.asarray(found.rows)[self.real]

    def shapes(self, effect: str) -> list[dict[str, float]]:
        """A few values of an effect's parameters at which to look for it."""
        names = self.layout.of_effect(effect)
        declared = [self.layout.entries[i].starts for i in self.layout.at(names)]
        own = [self.layout.entries[i].start for i in self.layout.at(names)]
        grid = [dict(zip(names, values, strict=True)) for values in islice(product(*declared), self.settings.starts)]
        default = dict(zip(names, own, strict=True))
        return [default, *(shape for shape in grid if shape != default)]

    def subset(
        self, effects: frozenset[str], at: Sequence[int] | np.ndarray, start: np.ndarray, beside: Sequence[str] = ()
    ) -> Subset:
        """The effects of a set; free is what is `at`, each with the effect `beside` it evaluated but switched off.

        The vector holds the unknowns, a slot that nothing reads, and the switches.
        """
        size = next((count for count in self.settings.padded if count >= len(at)), len(at))
        free = np.concatenate([at, np.full(size - len(at), len(start))]).astype(int)
        switches = self.switches(effects)
        evaluated = np.zeros((size, len(switches)), bool)
        for along, name in zip(evaluated, beside, strict=False):
            along[:] = self.switches([name]) > 0
        behind = lambda values, slot, rest: np.concatenate([values, [slot], np.full(len(switches), rest)])  # noqa: E731
        return Subset(
            np.concatenate([start, [0.5], switches]),
            free,
            switches,
            switches > 0,
            behind(self.layout.lower, 0.0, 0.0),
            behind(self.layout.upper, 1.0, 1.0),
            behind(self.layout.logarithmic, False, False),
            turned=len(switches),
            varying=np.array(max(len(at), 1)),
            beside=evaluated,
        )

    def _starts(self, subset: Subset, names: tuple[str, ...], start: np.ndarray, new: Sequence[str]) -> np.ndarray:
        shapes = [self.shapes(effect)[1:] or self.shapes(effect)[:1] for effect in new]
        vectors = []
        for combination in islice(product(*shapes), self.settings.starts):
            vector = start.copy()
            for shape in combination:
                for name, value in shape.items():
                    vector[self.layout.names.index(name)] = value
            vectors.append(vector)
        rest = subset.full[len(start) :]
        return np.array([subset.place(np.append(vector, rest)) for vector in vectors or [start]])


def _rise(found: SearchResult, at: int, shift: float) -> float:
    """By how much the cost grows if one free parameter's place is shifted and those inside their ranges give way.

    To first order, with what is at the end of its range held there.
    """
    rows, slopes, place = np.asarray(found.rows), np.asarray(found.slopes), np.asarray(found.place)
    inside = (place > 0.0) & (place < 1.0) & (np.arange(len(place)) != at)
    others, moved = slopes[:, inside], rows + shift * slopes[:, at]
    left = moved - others @ lstsq(others.T @ others, others.T @ moved, 1e-12)
    return 0.5 * float(left @ left - rows @ rows)
