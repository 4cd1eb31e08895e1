"""Fit what may vary to what was measured: optimistix, in a box, from several starts in one compiled call."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import jax
import jax.numpy as jnp
import numpy as np
from scipy.stats import qmc

from fitting.full_names import listed
from fitting.least_squares.absent import as_good_as_absent
from fitting.least_squares.search import Ended, Solved, rows_and_slopes, solve
from fitting.least_squares.subset import Subset, subset_of
from fitting.least_squares.uncertainty import at_bound, clusters, covariances, ties
from fitting.precision import require_x64
from fitting.problem.no_number import refuse_no_number, state_at
from fitting.problem.residuals import Problem, Samples, problem
from fitting.problem.unknowns import Unknowns, unknowns

BLIND = 1e-7  # of the strongest column: a parameter whose whole range moves the rows by less cannot be seen
FAR = 5.0  # times the noise: motions so far off call for a better search, or for a better model
COARSE = 4  # times longer steps of integration while a search looks around
LOOKS = 4  # places at which to see whether the data can see a parameter


@dataclass(frozen=True)
class Fit:
    """A fitted model with all that is known of how well it is known. Arrays over `free` are in that order."""

    layout: Unknowns
    problem: Problem
    samples: Samples
    free: tuple[str, ...]
    held: tuple[str, ...]  # asked to vary, but these data cannot see them
    vector: np.ndarray
    switches: np.ndarray
    residual: np.ndarray  # model minus measurement in the recording's unit, as `samples`
    slopes: np.ndarray  # rows over free, in standard deviations per unit of the parameter
    covariance: np.ndarray
    robust: np.ndarray
    at_bound: tuple[str, ...]
    tied: dict[str, tuple[str, ...]]
    converged: bool
    starts: str
    failures: tuple[str, ...]

    @property
    def rmse(self) -> float:
        """Root mean square error of the samples that measure force, N (of positions, m, where there are only those)."""
        return float(np.sqrt(np.mean(self.residual[self.problem.of_force(self.samples)] ** 2)))

    @property
    def cost(self) -> float:
        """What the fit has minimised: the sum of squares, in standard deviations, of measurements and priors."""
        priors = np.asarray(self.problem.prior_rows(jnp.asarray(self.vector)))
        return float(np.sum((self.residual / self.samples.sigma) ** 2) + np.sum(priors**2))

    @property
    def values(self) -> dict[str, float]:
        """Every unknown by its full name, SI."""
        return dict(zip(self.layout.names, map(float, self.vector), strict=True))

    def model(self, dataset: int = 0):
        """The fitted model of one data set."""
        return self.layout.model(jnp.asarray(self.vector), dataset)

    def error(self, name: str, robust: bool = True) -> float:
        """Standard error of a free parameter, SI; NaN for one that did not vary."""
        if name not in self.free:
            return float("nan")
        i = self.free.index(name)
        return float(np.sqrt((self.robust if robust else self.covariance)[i, i]))


def free_names(layout: Unknowns, fix: Sequence[str] = (), free: Sequence[str] = ()) -> tuple[str, ...]:
    """What varies unless told otherwise: the effects' parameters, and whatever has a prior."""
    chosen = [
        entry.name
        for entry in layout.entries
        if not entry.name.startswith("muscle.") or entry.prior is not None or listed(entry.name, free)
    ]
    return tuple(name for name in chosen if not listed(name, fix))


def seen(given: Problem, subset: Subset, names: Sequence[str]) -> tuple[str, ...]:
    """Those of the free names that move the measured rows at all."""
    count = sum(int(block.keep.size) for block in given.blocks)
    _, slopes = rows_and_slopes(given, subset, jnp.clip(subset.place(subset.full), 0.01, 0.99))
    moves = np.linalg.norm(np.nan_to_num(np.asarray(slopes)[:count], posinf=0.0, neginf=0.0), axis=0)
    return tuple(name for name, move in zip(names, moves, strict=True) if move > BLIND * max(moves.max(), 1e-300))


def starting_places(layout: Unknowns, subset: Subset, names: Sequence[str], count: int, seed: int) -> np.ndarray:
    """Where to begin: at the declared starts, then spread over the effects' ranges; the muscle as it was measured."""
    at = layout.at(names)
    first = np.asarray(subset.full).copy()
    for i in at:
        first[i] = layout.entries[i].starts[0]
    declared = [first]
    for i in at:
        for other in layout.entries[i].starts[1:]:
            declared.append(first.copy())
            declared[-1][i] = other
    places = [np.asarray(subset.place(jnp.asarray(vector))) for vector in [np.asarray(subset.full), *declared]]
    spread = qmc.Sobol(max(len(at), 1), rng=seed).random_base2(6) if len(at) else np.zeros((0, 0))
    own = np.array([layout.entries[i].name.startswith("muscle.") for i in at], bool)
    more = [np.where(own, places[0], 0.02 + 0.6 * row) for row in spread]
    return np.array([*places, *more][: max(count, 1)])


def fit(
    experiments: Sequence,
    effects: Sequence,
    *,
    fix: Sequence[str] = (),
    free: Sequence[str] = (),
    own: Sequence[str] = (),
    start: dict[str, float] | None = None,
    starts: int = 8,
    seed: int = 0,
    shooting: int = 0,
) -> Fit:
    """Fit a set of effects to data sets.

    `experiments` from `read_experiment`, `effects` as instances whose values are where the search starts. `fix` and
    `free` name parameters; `own` those that each data set has for itself; `start` gives other starting values (SI), as
    those of a smaller model: the search also begins there with what is new as good as absent, and ends no higher.
    `shooting` cuts every recorded motion into so many stretches to find where the search had better begin.
    InputError where the model gives no finite number wherever the search begins.
    """
    require_x64()
    layout = unknowns(experiments, effects, own)
    given, samples = problem(experiments, layout)
    vector = layout.start.copy()
    for name, value in (start or {}).items():
        if name in layout.names:
            vector[layout.names.index(name)] = value
    names, known = free_names(layout, fix, free), tuple(start or ())
    found = fit_problem(layout, given, samples, vector, names, known, starts=starts, seed=seed, shooting=shooting)
    refuse_no_number(found.residual, samples, experiments)
    return found


def fit_problem(
    layout: Unknowns,
    given: Problem,
    samples: Samples,
    vector: np.ndarray,
    names: Sequence[str],
    known: Sequence[str] = (),
    *,
    starts: int = 8,
    seed: int = 0,
    shooting: int = 0,
) -> Fit:
    """Fit the named unknowns of a problem that is laid out; `known` are those whose values were fitted before."""
    asked = tuple(names)
    if not asked:
        return _evaluated(layout, given, samples, vector)
    names = _seen_somewhere(layout, given, vector, asked, seed)
    held = tuple(name for name in asked if name not in names)
    if not names:
        return replace(_evaluated(layout, given, samples, vector), held=held)
    subset = subset_of(layout, vector, names)
    begin, told = starting_places(layout, subset, names, starts, seed), ""
    search = given.coarser(COARSE)
    begin = _from_known(search, layout, subset, names, known, begin)
    first = begin[0]
    if shooting > 1:
        from fitting.least_squares.shooting import begun_by_shooting  # diffrax is only needed where something moves

        begin = begun_by_shooting(search, subset, begin, shooting)
        told = f"multiple shooting, {shooting} stretches a run, from {starts} starts; from its best ends "
    none = np.zeros(len(begin), bool)
    found = jax.tree.map(np.asarray, solve(search, subset, jnp.asarray(begin), look=none))
    ends, moves = found.ends, any(block.steps for block in given.blocks)
    if moves and np.isfinite(found.cost):
        # the best end goes on with short steps; the others only look, so that nothing is compiled again
        again = jnp.asarray(np.broadcast_to(found.place, begin.shape))
        looked = np.arange(len(begin)) > 0
        found = jax.tree.map(np.asarray, solve(given, subset, again, look=looked))
        found = replace(found, ends=replace(found.ends, converged=found.ends.converged & ~looked))
        found = _no_higher(given, subset, first, found) if known else found
    if not np.isfinite(found.cost):
        lost = _evaluated(layout, given, samples, np.asarray(subset.vector(jnp.asarray(begin[0]))))
        told, failures = told + _told(ends), _failures(given, subset, samples, ends, begin)
        return replace(lost, held=held, converged=False, starts=told, failures=failures)
    fit = _conclude(layout, given, samples, subset, names, held, found)
    doubts = _doubts(fit, ends) if moves and not told else ()
    return replace(fit, starts=told + _told(ends), failures=(*_failures(given, subset, samples, ends, begin), *doubts))


def _from_known(
    search: Problem, layout: Unknowns, subset: Subset, names: tuple[str, ...], known: Sequence[str], begin: np.ndarray
) -> np.ndarray:
    """The places to begin from, the first of them at the values that are known, with what is new as good as absent."""
    new = np.array([name not in known for name in names], bool)
    if not new.any() or new.all():
        return begin
    entries = [layout.entries[i] for i in layout.at(names)]
    place = as_good_as_absent(search, subset, entries, new, len(begin))
    return np.concatenate([place[None], begin])[: len(begin)]


def _no_higher(given: Problem, subset: Subset, first: np.ndarray, found: Solved) -> Solved:
    """The end of a search that looked around with long steps or by shooting, or a lower one near where it began."""
    again = jnp.asarray(np.broadcast_to(first, (len(found.ends.cost), len(first))))
    there = solve(given, subset, again, look=np.ones(len(again), bool))
    if not float(there.cost) < float(found.cost):
        return found
    return jax.tree.map(np.asarray, solve(given, subset, again, look=np.arange(len(again)) > 0))


def _seen_somewhere(
    layout: Unknowns, given: Problem, vector: np.ndarray, asked: tuple[str, ...], seed: int
) -> tuple[str, ...]:
    """Those that the data can see, at the start or at other places to begin from.

    A muscle may be stuck at the start, and a stop of the stroke lie beyond all that was measured.
    """
    subset = subset_of(layout, vector, asked)
    found = set(seen(given, subset, asked))
    if len(found) < len(asked):
        for place in starting_places(layout, subset, asked, LOOKS, seed)[1:]:
            found |= set(seen(given, replace(subset, full=subset.vector(jnp.asarray(place))), asked))
    return tuple(name for name in asked if name in found)


def _evaluated(layout: Unknowns, given: Problem, samples: Samples, vector: np.ndarray) -> Fit:
    rows = np.asarray(given.rows(jnp.asarray(vector), layout.templates[0].switches))[: len(samples)]
    none = np.zeros((0, 0))
    slopes = np.zeros((len(samples), 0))
    residual, switches = rows * samples.sigma, np.asarray(layout.templates[0].switches)
    return Fit(
        layout, given, samples, (), (), vector, switches, residual, slopes, none, none, (), {}, True, "not fitted", ()
    )


def _conclude(
    layout: Unknowns,
    given: Problem,
    samples: Samples,
    subset: Subset,
    names: tuple[str, ...],
    held: tuple[str, ...],
    found: Solved,
) -> Fit:
    place = jnp.asarray(found.place)
    rows, slopes = np.asarray(found.rows), np.asarray(found.slopes)
    per_unit = slopes / np.asarray(subset.slope(place))
    data, priors = per_unit[: len(samples)], per_unit[len(samples) :]
    covariance, robust = covariances(data, rows[: len(samples)], priors, clusters(samples, per_unit))
    return Fit(
        layout=layout,
        problem=given,
        samples=samples,
        free=tuple(names),
        held=held,
        vector=np.asarray(subset.vector(place)),
        switches=np.asarray(subset.switches),
        residual=rows[: len(samples)] * samples.sigma,
        slopes=per_unit,
        covariance=covariance,
        robust=robust,
        at_bound=at_bound(names, np.asarray(place)),
        tied=ties(names, slopes),
        converged=bool(np.any(found.ends.converged & _best(found.ends)) or _flat(rows, slopes, np.asarray(place))),
        starts=_told(found.ends),
        failures=(),
    )


def _flat(rows: np.ndarray, slopes: np.ndarray, place: np.ndarray) -> bool:
    """Whether no direction into the box leads down: the angle between rows and slopes is right."""
    gradient = slopes.T @ rows
    inward = np.where((place < 1e-9) & (gradient > 0) | (place > 1 - 1e-9) & (gradient < 0), 0.0, gradient)
    scale = np.linalg.norm(slopes, axis=0) * np.linalg.norm(rows) + 1e-300
    return bool(np.all(np.abs(inward) < 1e-5 * scale))


def _told(found: Ended) -> str:
    best = np.min(found.cost)
    if not np.isfinite(best):
        return f"none of {len(found.cost)} starts gave finite numbers"
    return f"{len(found.cost)} starts: {int(np.sum(_best(found)))} reached the same best point"


def _best(found: Ended) -> np.ndarray:
    """Which searches ended as low as the best."""
    return np.asarray(found.cost <= np.min(found.cost) * (1 + 1e-4) + 1e-6)


def _doubts(fit: Fit, found: Ended) -> tuple[str, ...]:
    """Motions that are missed by far: by a model that lacks something, or by a search that was caught on its way."""
    moving = np.array([block.steps > 0 for block in fit.problem.blocks])[fit.samples.recording]
    off = float(np.sqrt(np.mean((fit.residual / fit.samples.sigma)[moving] ** 2)))
    if not off > FAR:
        return ()
    reached = f"{int(np.sum(_best(found)))} of {len(found.cost)} starts ended there"
    return (
        f"the motions are missed by {off:.0f} times their noise, and {reached}: the model lacks something, or the "
        "search was caught in a poor neighbourhood; a fit with --shooting 8 tells which",
    )


def _failures(given: Problem, subset: Subset, samples: Samples, found: Ended, begin: np.ndarray) -> tuple[str, ...]:
    told = []
    for i in np.flatnonzero(~np.isfinite(found.cost)):
        rows, _ = rows_and_slopes(given, subset, jnp.asarray(begin[i]))
        bad = np.flatnonzero(~np.isfinite(np.asarray(rows)[: len(samples)]))
        if len(bad):
            row, state = samples.row[bad[0]], state_at(samples, bad[0])
            told.append(f"start {i + 1}: the model gives no finite number at row {row} ({state})")
        else:
            told.append(f"start {i + 1}: the search met a state without finite numbers and stopped")
    return tuple(told)
