"""What each explanation of the data predicts of recordings that nobody has made."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import jax.numpy as jnp
import numpy as np
from scipy.optimize import least_squares

from fitting import full_names
from fitting.instruments.errors import InstrumentErrors
from fitting.instruments.felt import errors_felt
from fitting.least_squares.latest import latest_kept
from fitting.least_squares.search import rows_and_slopes
from fitting.least_squares.subset import Subset, subset_of
from fitting.planning.candidates import RigAbilities, recording
from fitting.planning.protocols import Protocol
from fitting.planning.settings import PREDICTION
from fitting.problem.residuals import Problem, Samples, problem
from fitting.problem.sizes import Standard
from fitting.problem.unknowns import Unknowns, unknowns
from fitting.problem.varying import AS_DECLARED, Varying
from fitting.recordings.accuracy import Accuracy
from fitting.recordings.presumed import allowed
from fitting.recordings.records import Experiment, Recording
from mckibben_jax.effect import Effect, name_of
from mckibben_jax.model import with_effects


@dataclass(frozen=True)
class Candidates:
    """Data sets with the planned recordings in them, and which rows belong to which candidate."""

    experiments: tuple[Experiment, ...]
    protocols: tuple[Protocol, ...]
    rows: tuple[np.ndarray, ...]  # of each candidate, among all rows of the measurements
    old: np.ndarray  # rows that were measured
    samples: Samples

    @property
    def accuracies(self) -> tuple[Accuracy, ...]:
        """Of the instruments of each recording."""
        return tuple(allowed(recording) for each in self.experiments for recording in each.recordings)

    def again(self, number: int) -> np.ndarray:
        """Which of a candidate's rows belong to its second cycle, which stands for all that follow."""
        return np.arange(len(self.rows[number])) >= len(self.rows[number]) // 2


def candidates(
    experiments: Sequence[Experiment], planned: Sequence[tuple[Experiment, Sequence[Protocol], RigAbilities]]
) -> Candidates:
    """Lay out the data with what is planned on each of these data sets, which may be new ones."""
    sets = {e.name: e for e in [*experiments, *(e for e, _, _ in planned)]}
    sets |= {e.name: e for e in experiments}
    wanted = {e.name: (tuple(protocols), can) for e, protocols, can in planned}
    is_new: list[bool] = []
    for name, experiment in sets.items():
        made = (_by_the_same(experiment, recording(*wanted[name])),) if name in wanted else ()
        is_new += [False] * len(experiment.recordings) + [True] * len(made)
        sets[name] = replace(experiment, recordings=(*experiment.recordings, *made))
    everything = tuple(sets.values())
    samples = problem(everything, unknowns(everything, ()))[1]
    new = np.array(is_new)[samples.recording]
    protocols = [p for name in sets for p in wanted.get(name, ((), None))[0]]
    runs = [np.flatnonzero(new & (samples.run == run)) for run in np.unique(samples.run[new])]
    return Candidates(everything, tuple(protocols), tuple(runs), np.flatnonzero(~new), samples)


def _by_the_same(experiment: Experiment, planned: Recording) -> Recording:
    """A planned recording, read by the instruments of the first that was made."""
    made = experiment.recordings[:1]
    return replace(planned, accuracy=allowed(made[0])) if made else planned


@dataclass(frozen=True)
class Explained:
    """One explanation fitted to what was measured, with what it predicts of every candidate.

    Rows are model minus measurement in standard deviations (of candidates: the prediction), slopes those per place of
    each free parameter in its range. A place that nothing is known of has the spread of its range.
    """

    effects: tuple[str, ...]  # that it adds
    layout: Unknowns
    problem: Problem
    subset: Subset
    free: tuple[str, ...]
    place: np.ndarray
    rows: np.ndarray
    slopes: np.ndarray
    prior_rows: np.ndarray
    prior_slopes: np.ndarray

    @property
    def values(self) -> dict[str, float]:
        """Every unknown by its full name, SI."""
        vector = self.subset.vector(self.place)
        return dict(zip(self.layout.names, map(float, vector), strict=True))

    def at(self, place: np.ndarray) -> "Explained":
        """The same at another place."""
        rows, slopes = map(np.asarray, rows_and_slopes(self.problem, self.subset, jnp.asarray(place)))
        count, stuck = len(self.rows), (place < PREDICTION.near) | (place > 1 - PREDICTION.near)
        slopes = np.where(stuck, 0.0, slopes)  # what stands at its bound cannot give way
        return replace(
            self,
            place=place,
            rows=rows[:count],
            slopes=slopes[:count],
            prior_rows=rows[count:],
            prior_slopes=np.vstack([slopes[count:], PREDICTION.flat_prior * np.eye(len(place))]),
        )

    def errors(self, planned: Candidates, used: np.ndarray) -> InstrumentErrors:
        """What instruments within their accuracy can do to some of the rows (a mask), measured one after another."""

        def rows_at(given: Problem, without: Sequence[str]) -> np.ndarray:
            effects = self.layout.templates[0].names
            on = jnp.asarray([name not in without for name in effects], float)
            standard = Standard.of(given)
            rows = rows_and_slopes(standard.problem, replace(self.subset, switches=on), place)[0]
            return np.asarray(rows)[standard.rows[: int(used.sum())]]

        place, given, samples = jnp.asarray(self.place), self.problem.of_rows(used), planned.samples.where(used)
        model = self.layout.templates[0]
        lost = [name for name, effect in zip(model.names, model.effects, strict=True) if effect.stage == "lost"]
        lengths = np.array([float(experiment.muscle.length) for experiment in planned.experiments])
        return errors_felt(given, samples, rows_at, lost, lengths, planned.accuracies)

    def fitted(self, target: np.ndarray, weight: np.ndarray) -> "Explained":
        """Refitted so that these weighted rows come close to their target; rows of weight 0 do not count."""
        used = weight > 0
        given = Standard.of(self.problem.of_rows(used))  # of some hundred candidates one or none
        aim, scale, count = target[used], weight[used], int(used.sum())

        @latest_kept
        def both(place: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            found = rows_and_slopes(given.problem, self.subset, jnp.asarray(place))
            rows, slopes = (np.asarray(part)[given.rows] for part in found)
            left = np.concatenate([scale * (rows[:count] - aim), rows[count:]])
            steep = np.vstack([scale[:, None] * slopes[:count], slopes[count:]])
            return np.nan_to_num(left, nan=1e6, posinf=1e6, neginf=-1e6), np.nan_to_num(steep)

        if not len(self.place):
            return self.at(self.place)
        begin = np.clip(self.place, 1e-6, 1 - 1e-6)
        slopes: Any = lambda p: both(p)[1]  # noqa: E731
        found = least_squares(
            lambda p: both(p)[0], begin, slopes, bounds=(0.0, 1.0), max_nfev=PREDICTION.steps, ftol=1e-7, xtol=1e-7
        )
        return self.at(found.x)


def explain(
    planned: Candidates,
    base: Sequence[Effect],
    added: Sequence[Effect],
    start: dict[str, float],
    varying: Varying = AS_DECLARED,
) -> Explained:
    """One explanation, fitted to what was measured from these starting values."""
    effects = list(with_effects(base, added))
    layout = unknowns(planned.experiments, effects, varying.own)
    given, samples = problem(planned.experiments, layout)
    vector = _at(layout, start)
    free = varying.names(layout)
    subset = subset_of(layout, vector, free)
    place = subset.place(subset.full)
    nothing = np.zeros(len(samples))
    empty = np.zeros((0, len(place)))
    names = tuple(name_of(effect) for effect in added)
    begin = Explained(names, layout, given, subset, free, place, nothing, empty, nothing, empty)
    weight = nothing.copy()
    weight[planned.old] = 1.0
    return begin.fitted(nothing, weight)


def _at(layout: Unknowns, values: dict[str, float]) -> np.ndarray:
    """Every unknown at its value by full or common name, else as declared; within its range."""
    known = zip(layout.names, layout.start, strict=True)
    vector = np.array([values.get(name, values.get(full_names.common(name), declared)) for name, declared in known])
    return np.clip(vector, layout.lower, layout.upper)


def changed_rows(
    base: Explained, planned: Candidates, added: Sequence[Effect], varying: Varying = AS_DECLARED
) -> dict[str, np.ndarray]:
    """What each of these effects at its declared values changes of all rows, if added alone to a fitted explanation.

    One program holds all of them, switched off in turn: a program for each took twenty seconds to compile, eight times.
    """
    own = base.layout.templates[0].effects
    layout = unknowns(planned.experiments, [*own, *added], varying.own)
    given, samples = problem(planned.experiments, layout)
    vector, order = _at(layout, base.values), layout.templates[0].names

    def rows(effects: Sequence[Effect]) -> np.ndarray:
        on = np.array([name in {name_of(effect) for effect in effects} for name in order], float)
        found = rows_and_slopes(given, subset_of(layout, vector, (), on, on > 0), jnp.zeros(0))[0]
        return np.asarray(found)[: len(samples)]

    before = rows(own)
    return {name_of(effect): rows(with_effects(own, [effect])) - before for effect in added}
