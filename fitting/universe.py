"""Every effect at once, switched: any subset of them is fitted by the same compiled function."""

from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from itertools import islice, product

import jax
import jax.numpy as jnp
import numpy as np

from fitting.held_out import REFIT_BELOW, left_out_rows
from fitting.least_squares import Subset, solve
from fitting.records import FORCE_TESTS, Experiment
from fitting.residuals import LIGHT, Problem, Samples, problem
from fitting.uncertainty import at_bound
from fitting.unknowns import Unknowns, unknowns
from mckibben_jax.effect import Effect, name_of
from mckibben_jax.model import Model
from mckibben_jax.muscle import quantities

FREE = (12, 20, 32, 48)  # free parameters are padded to these counts, to compile once for each
STEPS = 60  # of one search: what converges more slowly is of no use among many
DENIED = 4.0  # standard errors of a stated measurement
STARTS = 4  # of a new effect's hidden shape
WORKERS = 2  # compiled code leaves the interpreter's lock alone


@dataclass(frozen=True)
class Trial:
    """One set of effects, fitted: rows and slopes in standard deviations, of the measurements and of the priors."""

    effects: frozenset[str]
    vector: np.ndarray
    free: tuple[str, ...]
    rows: np.ndarray
    slopes: np.ndarray
    prior_rows: np.ndarray
    prior_slopes: np.ndarray
    at_bound: tuple[str, ...]

    @property
    def cost(self) -> float:
        """Sum of squares over all rows."""
        return float(np.sum(self.rows**2) + np.sum(self.prior_rows**2))


@dataclass(frozen=True)
class Universe:
    """Data sets, and every effect that is in the model or may be missing from it."""

    layout: Unknowns
    problem: Problem
    samples: Samples
    base: tuple[str, ...]
    candidates: tuple[str, ...]
    untestable: dict[str, str]  # effect to reason
    always_free: tuple[str, ...]  # of the muscle
    fixed: tuple[str, ...]
    start: np.ndarray

    @property
    def template(self) -> Model:
        """The model with every effect."""
        return self.layout.templates[0]

    @property
    def in_newtons(self) -> np.ndarray:
        """Which rows measure force; all, where only positions were measured."""
        of_force = np.array([block.of_force for block in self.problem.blocks])[self.samples.recording]
        return of_force if of_force.any() else ~of_force

    def rmse(self, rows: np.ndarray) -> float:
        """Root mean square in N (in m, where only positions were measured)."""
        return float(np.sqrt(np.mean((rows * self.samples.sigma)[self.in_newtons] ** 2)))

    def with_added(self, added: Iterable[str], base: Iterable[str] | None = None) -> frozenset[str]:
        """The base with effects added, each in place of its rivals."""
        chosen = set(self.base if base is None else base)
        for new in added:
            family = self.template[new].family
            chosen = {old for old in chosen if family is None or self.template[old].family != family} | {new}
        return frozenset(chosen)

    def possible(self, effects: Iterable[str], added: Sequence[str]) -> bool:
        """Whether a set holds together: needs are met, and no two of the added are rivals."""
        families = [self.template[name].family for name in added if self.template[name].family]
        return len(set(families)) == len(families) and not self.lacking(effects)

    def lacking(self, effects: Iterable[str]) -> tuple[str, ...]:
        """What the effects of a set need and neither muscle nor set has."""
        members = [self.template[name] for name in effects]
        given = {thing for effect in members for thing in effect.gives}
        muscle = self.template.muscle
        return tuple(
            need
            for effect in members
            for need in effect.needs
            if need not in given and getattr(muscle, need, None) is None
        )

    def switches(self, effects: Iterable[str]) -> np.ndarray:
        """1 for the effects of a set, 0 for all others."""
        return np.array([name in set(effects) for name in self.template.names], float)

    def free(self, effects: Iterable[str]) -> tuple[str, ...]:
        """What varies when a set is fitted."""
        own = [name for effect in sorted(effects) for name in self.layout.of_effect(effect)]
        return (*self.always_free, *(name for name in own if name not in self.fixed))

    def fit(self, effects: frozenset[str], start: np.ndarray, new: Sequence[str] = ()) -> Trial:
        """Fit a set of effects from a vector of all unknowns; the new ones' shapes from several starts."""
        names = self.free(effects)
        subset = self._subset(effects, names, start)
        begin = self._starts(subset, names, start, new)
        best = None
        for place in begin:  # one at a time: any number of starts is the same compiled function
            found = solve(self.problem, subset, jnp.asarray(place)[None], STEPS)
            if best is None or float(found.cost) < float(best.cost):
                best = found
        assert best is not None
        count, k = len(self.samples), len(names)
        rows, slopes = np.asarray(best.rows), np.asarray(best.slopes)[:, :k]
        vector = np.asarray(subset.vector(best.place))[:-1]
        ends = at_bound(names, np.asarray(best.place)[:k])
        slopes = slopes * [name not in ends for name in names]  # what stands at its bound cannot give way
        return Trial(effects, vector, names, rows[:count], slopes[:count], rows[count:], slopes[count:], ends)

    def fit_all(self, sets: Sequence[tuple[frozenset[str], np.ndarray, Sequence[str]]]) -> list[Trial]:
        """Fit many sets, two at a time."""
        with ThreadPoolExecutor(WORKERS) as workers:
            return list(workers.map(lambda job: self.fit(*job), sets))

    def mimicking(self, trial: Trial) -> "Universe":
        """The same data sets, had they measured exactly what this trial predicts."""
        blocks = []
        for block, rows in zip(self.problem.blocks, self.problem.split(trial.rows), strict=True):
            flat, sigma = block.measured.reshape(-1), block.sigma.reshape(-1)[block.keep]
            blocks.append(replace(block, measured=flat.at[block.keep].add(rows * sigma).reshape(block.measured.shape)))
        return replace(self, problem=replace(self.problem, blocks=tuple(blocks)))

    def contradicted(self, trial: Trial) -> tuple[str, ...]:
        """Stated measurements of the muscle that a trial denies: more than four standard errors away."""
        stated = [entry.name for entry in self.layout.entries if entry.prior is not None]
        return tuple(name for name, row in zip(stated, trial.prior_rows, strict=True) if abs(row) > DENIED)

    def left_out(self, trial: Trial, group: np.ndarray, glance: bool = False) -> np.ndarray:
        """A trial's rows on groups of rows left out: refitted where there are few, else in one step from the fit."""
        if glance or len(self.samples) > REFIT_BELOW:
            return left_out_rows(trial.rows, trial.slopes, trial.prior_rows, trial.prior_slopes, group)
        rows = trial.rows.copy()
        for g in np.unique(group):
            rest = replace(self, problem=self.problem.without(group == g))
            rows[group == g] = rest.fit(trial.effects, trial.vector).rows[group == g] * LIGHT
        return rows

    def signature(self, trial: Trial, added: str, shape: dict[str, float] | None = None) -> np.ndarray:
        """How the rows would change if a missing effect were switched on: d(rows)/d(switch) at 0.

        A rival in the model is switched off as much as the new one is switched on.
        """
        after = self.with_added([added], trial.effects)
        direction = self.switches(after) - self.switches(trial.effects)
        vector = trial.vector.copy()
        for name, value in (shape or {}).items():
            vector[self.layout.names.index(name)] = value
        live = self.switches(trial.effects | after) > 0
        return np.asarray(
            _signature(self.problem, _padded(vector), self.switches(trial.effects), live, jnp.asarray(direction))
        )

    def warm_up(self) -> None:
        """Compile what `signature` needs."""
        switches = self.switches(self.base)
        _signature(self.problem, _padded(self.start), switches, switches > 0, jnp.asarray(switches)).block_until_ready()

    def shapes(self, effect: str) -> list[dict[str, float]]:
        """A few values of an effect's parameters at which to look for it."""
        names = self.layout.of_effect(effect)
        declared = [self.layout.entries[i].starts for i in self.layout.at(names)]
        own = [self.layout.entries[i].start for i in self.layout.at(names)]
        grid = [dict(zip(names, values, strict=True)) for values in islice(product(*declared), STARTS)]
        default = dict(zip(names, own, strict=True))
        return [default, *(shape for shape in grid if shape != default)]

    def _subset(self, effects: frozenset[str], names: tuple[str, ...], start: np.ndarray) -> Subset:
        size = next((count for count in FREE if count >= len(names)), len(names))
        dummy = len(self.layout.entries)  # the slot behind the last unknown, which nothing reads
        free = np.concatenate([self.layout.at(names), np.full(size - len(names), dummy)]).astype(int)
        switches = self.switches(effects)
        one = lambda values, last: jnp.asarray(np.append(values, last))  # noqa: E731
        return Subset(
            _padded(start),
            jnp.asarray(free),
            jnp.asarray(switches),
            jnp.asarray(switches > 0),
            one(self.layout.lower, 0.0),
            one(self.layout.upper, 1.0),
            one(self.layout.logarithmic, False),
        )

    def _starts(self, subset: Subset, names: tuple[str, ...], start: np.ndarray, new: Sequence[str]) -> np.ndarray:
        shapes = [self.shapes(effect)[1:] or self.shapes(effect)[:1] for effect in new]
        vectors = []
        for combination in islice(product(*shapes), STARTS):
            vector = start.copy()
            for shape in combination:
                for name, value in shape.items():
                    vector[self.layout.names.index(name)] = value
            vectors.append(vector)
        return np.array([np.asarray(subset.place(_padded(vector))) for vector in vectors or [start]])


@jax.jit
def _signature(
    given: Problem, vector: jax.Array, switches: jax.Array, live: jax.Array, direction: jax.Array
) -> jax.Array:
    rows = lambda s: given.data_rows(vector, s, live)  # noqa: E731
    return jax.jvp(rows, (jnp.asarray(switches, float),), (direction,))[1]


def _padded(vector: np.ndarray) -> jax.Array:
    return jnp.asarray(np.append(vector, 0.5))


def universe(
    experiments: Sequence[Experiment],
    effects: Sequence[Effect],
    candidates: Sequence[Effect],
    *,
    fix: Sequence[str] = (),
    free: Sequence[str] = (),
    own: Sequence[str] = (),
) -> Universe:
    """Lay out data sets with the effects of a model and all that may be missing from it."""
    present = [name_of(effect) for effect in effects]
    others = [effect for effect in candidates if name_of(effect) not in present]
    untestable = {name_of(effect): _why_not(effect, experiments) for effect in others}
    untestable = {name: why for name, why in untestable.items() if why}
    testable = [effect for effect in others if name_of(effect) not in untestable]
    layout = unknowns(experiments, [*effects, *testable], own)
    given, samples = problem(experiments, layout)
    listed = lambda name, names: name in names or name.split("@")[0] in names  # noqa: E731
    muscle = [
        entry.name
        for entry in layout.entries
        if entry.name.startswith("muscle.") and (entry.prior is not None or listed(entry.name, free))
    ]
    return Universe(
        layout,
        given,
        samples,
        tuple(present),
        tuple(name for name in layout.templates[0].names if name not in present),
        untestable,
        tuple(name for name in muscle if not listed(name, fix)),
        tuple(name for name in layout.names if listed(name, fix)),
        layout.start.copy(),
    )


def _why_not(effect: Effect, experiments: Sequence[Experiment]) -> str:
    """Which measurement of the muscle an effect needs that a data set does not give."""
    missing = [need for need in effect.needs if need in quantities() and any(e.muscle.lacks(need) for e in experiments)]
    if missing:
        return f"cannot be tested: needs {' and '.join(missing)}"
    if effect.stage == "read" and not any(r.test in FORCE_TESTS for e in experiments for r in e.recordings):
        return "cannot be tested: no force was measured"
    return ""
