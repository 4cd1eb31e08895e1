"""Which effect is missing: the gate, the set of adequate explanations, the verdict.

The baseline is tested for anything missing. Every single effect, then pairs, then triples are refitted jointly and
tested the same way; those that stand are a confidence set for the explanation. The verdict is that set in words.
"""

from collections.abc import Callable, Mapping, Sequence
from functools import partial

import numpy as np
from threadpoolctl import threadpool_limits

from fitting.diagnosis.among_all import AmongAll
from fitting.diagnosis.candidate_fit import CandidateFit
from fitting.diagnosis.examine import Examiner
from fitting.diagnosis.lay_out import universe
from fitting.diagnosis.record import Diagnosis
from fitting.diagnosis.search import Search
from fitting.diagnosis.search_result import SearchResult
from fitting.diagnosis.settings import DIAGNOSIS, DiagnosisSettings
from fitting.diagnosis.universe import Universe
from fitting.diagnosis.verdict import diagnosis_of
from fitting.errors import InputError
from fitting.least_squares.fit import fit_problem
from fitting.least_squares.instruments import accuracies_of
from fitting.least_squares.record import Fit
from fitting.precision import require_x64
from fitting.problem.no_number import refuse_no_number
from fitting.problem.residuals import problem
from fitting.problem.thinning import thinned
from fitting.problem.unknowns import unknowns
from fitting.problem.varying import AS_DECLARED, Varying
from fitting.progress import Progress, unwatched
from fitting.recordings.envelopes import without_envelopes
from fitting.recordings.inverse_dynamics import as_force
from fitting.recordings.noted import notes_of
from fitting.recordings.records import Experiment, force_was_measured
from mckibben_jax.effect import Effect
from mckibben_jax.effects import LIBRARY

SAME_VALLEY = 1e-4  # of the sum of squares: two searches whose ends differ by less found the same


def diagnose(
    experiments: Sequence[Experiment],
    effects: Sequence[Effect],
    *,
    candidates: Sequence[Effect] | None = None,
    fix: Sequence[str] = (),
    free: Sequence[str] = (),
    own: Sequence[str] = (),
    seed: int = 0,
    start: Mapping[str, float] | None = None,
    progress: Progress | None = None,
    settings: DiagnosisSettings = DIAGNOSIS,
) -> Diagnosis:
    """Say which effect is missing from a model of `effects` on these data sets, or that the data cannot say.

    `candidates` are the effects that may be missing; all of the library (but printed rivals) unless given.
    `start` gives values (SI, by full name) that were fitted before: the model's own fit ends no higher than there.
    `progress` is called with words and the share that is done.
    """
    varying = Varying(fix, free, own)
    return concluded(searched(experiments, effects, candidates, varying, seed, progress, start, settings))


def library_candidates() -> list[Effect]:
    """What may be missing unless it is named: all of the library but printed rivals."""
    return [kind() for kind in LIBRARY if not kind.rival]


def searched(
    experiments: Sequence[Experiment],
    effects: Sequence[Effect],
    candidates: Sequence[Effect] | None = None,
    varying: Varying = AS_DECLARED,
    seed: int = 0,
    progress: Progress | None = None,
    start: Mapping[str, float] | None = None,
    settings: DiagnosisSettings = DIAGNOSIS,
) -> SearchResult:
    """Everything that was fitted and tested on the way to a diagnosis; arguments as there."""
    search = prepared(experiments, effects, candidates, varying, seed, progress, start, settings)
    with one_thread():
        return search.run()


def prepared(
    experiments: Sequence[Experiment],
    effects: Sequence[Effect],
    candidates: Sequence[Effect] | None = None,
    varying: Varying = AS_DECLARED,
    seed: int = 0,
    progress: Progress | None = None,
    start: Mapping[str, float] | None = None,
    settings: DiagnosisSettings = DIAGNOSIS,
    confine: bool = False,
) -> Search:
    """The model itself fitted, and all laid out for the search of what is missing from it; arguments as there.

    `confine`: no stated size leaves what was stated by more than a few of its standard errors (`stated_sizes`).
    """
    require_x64()
    progress = progress or unwatched
    tested, set_aside = of_force(experiments)
    whole = [without_envelopes(experiment) for experiment in tested]
    light = [thinned(experiment, settings.samples // len(whole)) for experiment in whole]
    known = library_candidates() if candidates is None else list(candidates)
    progress("baseline", 0.0)
    world = universe(light, effects, known, varying, settings=settings.fits)
    world = world.confined() if confine else world
    alone = partial(_alone, world, light, effects, varying, seed, settings.fits.believed if confine else None)
    baseline, base = _fitted_twice(world, alone, dict(start or {}))
    with one_thread():
        examiner = Examiner(world, base, seed, settings)
    notes = (*set_aside, *notes_of(tested))
    names = tuple((r.file, run.name) for e in light for r in e.recordings for run in r.runs)
    return Search(world, base, examiner, baseline, progress, notes, not force_was_measured(experiments), names)


def _alone(
    world: Universe, light: Sequence[Experiment], effects: Sequence[Effect], varying: Varying, seed: int,
    errors: float | None, start: dict[str, float],
) -> Fit:  # fmt: skip
    """The model alone fitted from several starts, with stated sizes confined to so many standard errors, if to any."""
    layout = unknowns(light, effects, varying.own)
    layout = layout if errors is None else layout.confined(errors)
    begin = np.array([start.get(name, value) for name, value in zip(layout.names, layout.start, strict=True)])
    given, samples = problem(light, layout)
    names = varying.names(layout)
    # a model of which values are known is fitted as `fit` does: not in a valley that instruments made
    accuracies = accuracies_of(light) if start else ()
    found = fit_problem(
        layout, given, samples, begin, names, tuple(start), accuracies, starts=6, seed=seed,
        searches=AmongAll(world, layout),
    )  # fmt: skip
    refuse_no_number(found.residual, samples, light)
    return found


def _fitted_twice(world: Universe, alone: Callable[..., Fit], known: dict[str, float]) -> tuple[Fit, CandidateFit]:
    """The model alone from several starts, and among all candidates switched off: both in the lowest valley found.

    Where instruments made that valley, both are where the fit left it for.
    """
    base, fit = frozenset(world.base), alone(known)
    start = np.array([known.get(name, value) for name, value in zip(world.layout.names, world.start, strict=True)])
    start[world.layout.at(fit.layout.names)] = fit.vector
    if fit.search.unbent:
        return fit, world.at(base, start)
    base_fit = world.fit(base, start)
    if base_fit.cost < fit.cost * (1 - SAME_VALLEY):
        best = base_fit.vector[world.layout.at(fit.layout.names)]
        fit = alone(dict(zip(fit.layout.names, map(float, best), strict=True)))
    return fit, base_fit


def concluded(search: SearchResult) -> Diagnosis:
    """The verdict of a search."""
    with one_thread():
        return diagnosis_of(search)


def one_thread() -> threadpool_limits:
    """For many small matrices: a second thread was measured to make them 100 times slower."""
    return threadpool_limits(1, "blas")


def of_force(experiments: Sequence[Experiment]) -> tuple[list[Experiment], tuple[str, ...]]:
    """What the test can use, in newtons, and notes on motions read as force and on what is set aside.

    Through the equation of motion a whole library of effects would take minutes to compile: releases and steps are read
    as the force along the recorded motion.
    """
    read, notes = zip(*(as_force(experiment) for experiment in experiments), strict=True)
    kept = [experiment for experiment in read if experiment.recordings]
    said = tuple(note for each in notes for note in each)
    if not kept:
        cure = "record a loop, an isometric or a static test; compare and fit work with what is here"
        raise InputError(
            "the test for missing effects needs a recording of force", experiments[0].folder, None, None,
            "; ".join(said), cure,
        )  # fmt: skip
    return kept, said
