"""Fit what may vary to what was measured: optimistix, in a box, from several starts by one compiled program."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fitting.instruments.errors import InstrumentErrors
from fitting.least_squares.instruments import accuracies_of, errors_in
from fitting.least_squares.record import Fit, record_fit
from fitting.least_squares.search import MultistartResult, SearchEnd
from fitting.least_squares.searches import Alone, Searches, cost_of
from fitting.least_squares.seen_through import seen_through_instruments
from fitting.least_squares.starts import constrained_somewhere, from_best_of_forces, from_known, starting_places
from fitting.least_squares.subset import Subset, subset_of
from fitting.least_squares.summary import FailedStart, Failure, MissedMotions, SearchSummary
from fitting.least_squares.unbent import is_better, leaves_noise, unbent
from fitting.precision import require_x64
from fitting.problem.no_number import refuse_no_number
from fitting.problem.residuals import Problem, Samples, problem
from fitting.problem.unknowns import Unknowns, unknowns
from fitting.problem.varying import Varying
from fitting.recordings.accuracy import Accuracy
from fitting.recordings.inverse_dynamics import as_force, is_read_as_force


@dataclass(frozen=True)
class FitSettings:
    """Settings of a fit. All were chosen: nobody has derived them."""

    far: float = 5.0  # standard deviations, rms: a fit of motions that misses by more is warned of
    coarse: float = 4.0  # times longer steps of integration while a search looks around


SETTINGS = FitSettings()


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
    Of motions, the starts are searched with the motions read as force; a search of the motions follows from the best.
    `shooting` cuts every recorded motion into so many stretches to find where the search had better begin.
    The fit is the curve of least error; `through` of it has the values that are likelier where instruments err.
    InputError where the model gives no finite number wherever the search begins.
    """
    require_x64()
    layout = unknowns(experiments, effects, own)
    given, samples = problem(experiments, layout)
    vector = layout.vector_of(start or {})
    names, known = Varying(fix, free, own).names(layout), tuple(start or ())
    searches, of_forces = Alone.of(given), None
    if starts > 1 and shooting <= 1 and not all(block.of_force for block in given.blocks):
        of_forces = _fit_of_forces(experiments, effects, own, start or {}, names, starts, seed)
    found = fit_problem(
        layout, given, samples, vector, names, known, accuracies_of(experiments), starts=starts, seed=seed,
        shooting=shooting, searches=searches, of_forces=of_forces,
    )  # fmt: skip
    refuse_no_number(found.residual, samples, experiments)
    return replace(found, through=seen_through_instruments(found, searches))


def _fit_of_forces(
    experiments: Sequence, effects: Sequence, own: Sequence[str], start: dict[str, float], names: Sequence[str],
    starts: int, seed: int,
) -> Fit | None:  # fmt: skip
    """The fit to the motions read as force, beside the forces that were measured; None where none can be read so.

    A step of a search costs a second through the equation of motion and some milliseconds through forces: eight motions
    took three minutes from eight places. Forces show no break-away and no standstill: motions have the last word.
    """
    read = [experiment for each in experiments if (experiment := as_force(each)[0]).recordings]
    if not any(is_read_as_force(recording) for experiment in read for recording in experiment.recordings):
        return None
    layout = unknowns(read, effects, own, among=experiments)
    given, samples = problem(read, layout)
    asked = [name for name in names if name in layout.names]
    found = fit_problem(layout, given, samples, layout.vector_of(start), asked, tuple(start), starts=starts, seed=seed)
    return found if found.search.reached else None


def fit_problem(
    layout: Unknowns,
    given: Problem,
    samples: Samples,
    vector: np.ndarray,
    names: Sequence[str],
    known: Sequence[str] = (),
    accuracies: Sequence[Accuracy] = (),
    *,
    starts: int = 8,
    seed: int = 0,
    shooting: int = 0,
    searches: Searches | None = None,
    of_forces: Fit | None = None,
) -> Fit:
    """Fit the named unknowns of a problem that is laid out; `known` are those whose values were fitted before.

    `accuracies` of the instruments of each recording widen the standard errors, and let the fit leave a valley that
    instruments made; without them every reading is trusted. `searches` are those of a program of its own, unless given.
    The search begins where a fit to the same motions read as force, `of_forces`, has ended, if there is one.
    """
    asked, searches = tuple(names), Alone.of(given) if searches is None else searches
    whole = subset_of(layout, vector, asked)
    names = constrained_somewhere(layout, searches, whole, asked, seed) if asked else ()
    held = tuple(name for name in asked if name not in names)
    if not names:
        return _not_fitted(layout, given, samples, searches, vector, held)
    subset = subset_of(layout, vector, names)
    begin, search_from = starting_places(layout, subset, names, starts, seed), SearchSummary()
    coarse = searches.coarser(SETTINGS.coarse)
    begin = from_known(coarse, layout, subset, names, known, begin)
    first = begin[0]
    if shooting > 1:
        from fitting.least_squares.shooting import begin_by_shooting  # diffrax is only needed where something moves

        begin = begin_by_shooting(coarse.standard.problem, subset, begin, shooting)
        search_from = SearchSummary(stretches=shooting, shooting_starts=starts)
    elif of_forces is not None:
        begin = from_best_of_forces(coarse, subset, subset.place(layout.vector_of(of_forces.values)), begin)
        search_from = SearchSummary(of_forces=of_forces.search)
    result = coarse.search(subset, np.asarray(begin))
    ends, moves = result.ends, any(block.steps for block in given.blocks)
    if moves and np.isfinite(result.cost):
        result = searches.search(subset, np.asarray(result.place)[None])
        result = _no_higher(searches, subset, first, result) if known else result
    summary, failures = _summary(ends, search_from), _failures(searches, subset, samples, ends, begin)
    if not np.isfinite(result.cost):
        lost = _not_fitted(layout, given, samples, searches, subset.vector(np.asarray(begin[0])), held)
        return replace(lost, converged=False, search=summary, failures=failures)
    errors = errors_in(searches, layout, whole, subset.vector(result.place), samples, accuracies)
    other = None if moves else _in_another_valley(searches, subset, result, np.asarray(begin), errors)
    if other is not None:
        result, summary = other, replace(summary, unbent=True)
        errors = errors_in(searches, layout, whole, subset.vector(result.place), samples, accuracies)
    best, converged = result.best.at(searches.standard.rows), _converged(result)
    fit = record_fit(
        layout, given, samples, subset, names, best, errors=errors, held=held, converged=converged, search=summary
    )
    warnings = _warnings(fit, ends, of_forces) if moves and shooting <= 1 else ()
    return replace(fit, failures=(*failures, *warnings))


def _in_another_valley(
    searches: Searches, subset: Subset, result: MultistartResult, begin: np.ndarray, errors: InstrumentErrors
) -> MultistartResult | None:
    """The curve of least error in the valley that leaves noise alone beyond the instruments, if that is another one.

    Where the way to the lowest error leads down from there, there is no such curve: then what is fitted through the
    instruments is the fit, if they explain all that it leaves.
    """
    measured = searches.standard.rows[: len(errors.run)]
    plain = result.best.at(measured)
    found = unbent(searches, subset, plain, begin, errors)
    if found is None:
        return None
    place = np.asarray(found.place)
    other = searches.search(subset, place[None])
    if is_better(other.best.at(measured), plain, errors):
        return other
    if not leaves_noise(found, errors):
        return None
    there = searches.at(subset, place)
    return replace(result, place=place, cost=np.asarray(cost_of(there)), rows=there.rows, slopes=there.slopes)


def _no_higher(searches: Searches, subset: Subset, first: np.ndarray, result: MultistartResult) -> MultistartResult:
    """The end of a search that looked around with long steps or by shooting, or a lower one near where it began."""
    if not searches.look(subset, first[None])[0] < float(result.cost):
        return result
    return searches.search(subset, first[None])


def _not_fitted(
    layout: Unknowns, given: Problem, samples: Samples, searches: Searches, vector: np.ndarray, held: tuple[str, ...]
) -> Fit:
    """The record of a model in which nothing varies."""
    subset = subset_of(layout, vector, ())
    at = searches.at(subset, subset.place(subset.full)).at(searches.standard.rows)
    return record_fit(layout, given, samples, subset, (), at, held=held)


def _converged(result: MultistartResult) -> bool:
    """Whether a search that ended as low as the best has converged, or no direction leads down from where it ended."""
    best = result.ends.converged & _best(result.ends)
    return bool(np.any(best)) or _flat(*map(np.asarray, (result.rows, result.slopes, result.place)))


def _flat(rows: np.ndarray, slopes: np.ndarray, place: np.ndarray) -> bool:
    """Whether no direction into the box leads down: the angle between rows and slopes is right."""
    gradient = slopes.T @ rows
    inward = np.where((place < 1e-9) & (gradient > 0) | (place > 1 - 1e-9) & (gradient < 0), 0.0, gradient)
    scale = np.linalg.norm(slopes, axis=0) * np.linalg.norm(rows) + 1e-300
    return bool(np.all(np.abs(inward) < 1e-5 * scale))


def _summary(ends: SearchEnd, begun: SearchSummary) -> SearchSummary:
    """How the searches ended; `begun` says what they began from."""
    reached = int(np.sum(_best(ends))) if np.isfinite(np.min(ends.cost)) else 0
    return replace(begun, starts=len(ends.cost), reached=reached)


def _best(ends: SearchEnd) -> np.ndarray:
    """Which searches ended as low as the best."""
    return np.asarray(ends.cost <= np.min(ends.cost) * (1 + 1e-4) + 1e-6)


def _warnings(fit: Fit, ends: SearchEnd, of_forces: Fit | None) -> tuple[Failure, ...]:
    """A warning where motions are missed by far: the model lacks something, or the search was caught on its way."""
    moving = np.array([block.steps > 0 for block in fit.problem.blocks])[fit.samples.recording]
    off = float(np.sqrt(np.mean((fit.residual / fit.samples.sigma)[moving] ** 2)))
    if not off > SETTINGS.far:
        return ()
    other_forces = any(block.of_force for block in fit.problem.blocks)  # these say nothing of the motions
    as_force = None if of_forces is None or other_forces else of_forces.over_noise
    return (MissedMotions(off, int(np.sum(_best(ends))), len(ends.cost), as_force),)


def _failures(
    searches: Searches, subset: Subset, samples: Samples, ends: SearchEnd, begin: np.ndarray
) -> tuple[Failure, ...]:
    """The starts from which the search met no finite numbers."""
    failed, measured = [], searches.standard.rows[: len(samples)]
    for i in np.flatnonzero(~np.isfinite(ends.cost)):
        rows = np.asarray(searches.at(subset, np.asarray(begin[i])).rows)[measured]
        bad = np.flatnonzero(~np.isfinite(rows))
        failed.append(FailedStart(int(i) + 1, int(bad[0]) if len(bad) else None))
    return tuple(failed)
