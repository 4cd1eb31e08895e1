"""Which effect is missing: the gate, the set of adequate explanations, the verdict.

The baseline is tested for anything missing. Every single effect, then pairs, then triples are refitted jointly and
tested the same way; those that stand are a confidence set for the explanation. The verdict is that set in words.
"""

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial

import numpy as np
from threadpoolctl import threadpool_limits

from fitting.comparison.compare import NEGLIGIBLE
from fitting.diagnosis.equivalent import best_predicting, leading_of, plausible, simplest, unrivalled
from fitting.diagnosis.estimates import estimate, estimates
from fitting.diagnosis.examine import Examiner
from fitting.diagnosis.record import Diagnosis, Evidence, Explanation
from fitting.diagnosis.search import Progress, Search
from fitting.diagnosis.settings import DIAGNOSIS, DiagnosisSettings
from fitting.diagnosis.substitutes import substitutes
from fitting.diagnosis.universe import CandidateFit, Universe, universe
from fitting.errors import InputError
from fitting.least_squares.fit import Fit
from fitting.least_squares.fit import fit as fit_model
from fitting.least_squares.held_out import difference
from fitting.precision import require_x64
from fitting.problem.residuals import thinned
from fitting.recordings.inverse_dynamics import as_force
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
    return concluded(searched(experiments, effects, candidates, fix, free, own, seed, progress, start, settings))


def library_candidates() -> list[Effect]:
    """What may be missing unless it is named: all of the library but printed rivals."""
    return [kind() for kind in LIBRARY if not kind.rival]


def searched(
    experiments: Sequence[Experiment],
    effects: Sequence[Effect],
    candidates: Sequence[Effect] | None = None,
    fix: Sequence[str] = (),
    free: Sequence[str] = (),
    own: Sequence[str] = (),
    seed: int = 0,
    progress: Progress | None = None,
    start: Mapping[str, float] | None = None,
    settings: DiagnosisSettings = DIAGNOSIS,
) -> Search:
    """Everything that was fitted and tested on the way to a diagnosis; arguments as there."""
    search = prepared(experiments, effects, candidates, fix, free, own, seed, progress, start, settings)
    with one_thread():
        search.run()
    return search


def prepared(
    experiments: Sequence[Experiment],
    effects: Sequence[Effect],
    candidates: Sequence[Effect] | None = None,
    fix: Sequence[str] = (),
    free: Sequence[str] = (),
    own: Sequence[str] = (),
    seed: int = 0,
    progress: Progress | None = None,
    start: Mapping[str, float] | None = None,
    settings: DiagnosisSettings = DIAGNOSIS,
) -> Search:
    """The model itself fitted, and all laid out for the search of what is missing from it; arguments as there."""
    require_x64()
    progress = progress or (lambda *_: None)
    tested, set_aside = of_force(experiments)
    light = [thinned(experiment, settings.samples // len(tested)) for experiment in tested]
    known = library_candidates() if candidates is None else list(candidates)
    progress("baseline", 0.0)
    world = universe(light, effects, known, fix=fix, free=free, own=own, settings=settings.fits)
    refit = partial(fit_model, light, effects, fix=fix, free=free, own=own, starts=6, seed=seed)
    baseline, base = _fitted_twice(world, refit, dict(start or {}))
    with one_thread():
        search = Search(world, base, Examiner(world, base, seed, settings), baseline, progress)
    search.moving_only = not force_was_measured(experiments)
    search.notes = (*set_aside, *(note for e in light for r in e.recordings for note in r.notes))
    return search


def _fitted_twice(world: Universe, refit: Callable[..., Fit], known: dict[str, float]) -> tuple[Fit, CandidateFit]:
    """The model alone from several starts, and among all candidates switched off: both in the lowest valley found."""
    base = frozenset(world.base)
    begin = np.array([known.get(name, value) for name, value in zip(world.layout.names, world.start, strict=True)])
    with ThreadPoolExecutor(2) as workers:  # two programs to compile, which needs no interpreter
        fitting, first = workers.submit(refit, start=known), workers.submit(world.fit, base, begin)
        alone, base_fit = fitting.result(), first.result()
    start = begin.copy()
    start[world.layout.at(alone.layout.names)] = alone.vector
    base_fit = min(base_fit, world.fit(base, start), key=lambda each: each.cost)
    if base_fit.cost < alone.cost * (1 - SAME_VALLEY):
        best = base_fit.vector[world.layout.at(alone.layout.names)]
        alone = refit(start=dict(zip(alone.layout.names, map(float, best), strict=True)))
    return alone, base_fit


def concluded(search: Search) -> Diagnosis:
    """The verdict of a search."""
    with one_thread():
        return _verdict(search)


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


def _verdict(search: Search) -> Diagnosis:
    world, examiner, settings = search.world, search.examiner, search.examiner.settings.verdict
    kept, classes, passed = _chosen(search)
    evidence = {name: _evidence(search, name, passed) for name in world.candidates}
    evidence |= {name: Evidence(name, reason=why) for name, why in world.untestable.items()}
    verdict, notes = _said(search, kept, evidence)
    if verdict == "inconclusive":
        kept, classes = [], ()
    tried = sorted((_explanation(search, added, passed) for added in search.fits), key=lambda e: e.held_out_rmse)
    near = sorted(tried, key=lambda e: not e.plausible)  # stable: plausible ones first
    near = [e for e in near if e.held_out_rmse < settings.helps * world.rmse(examiner.left_out(search.base))]
    nearest = tuple(near[: settings.nearest]) if verdict == "not in the library" else ()
    rmse, full_scale = world.rmse(search.base.rows), float(np.max(np.abs(world.samples.measured[world.in_newtons])))
    left = world.rmse(search.fits[kept[0]].rows) if kept else search.noise
    return Diagnosis(
        verdict=verdict,
        negligible=verdict != "nothing detectable" and np.sqrt(max(rmse**2 - left**2, 0)) < NEGLIGIBLE * full_scale,
        explanations=tuple(tuple(sorted(added)) for added in kept),
        classes=classes,
        nearest=nearest,
        leading=None
        if verdict == "nothing detectable"
        else leading_of(world, search.base, search.fits, examiner, settings),
        p_value=search.missing_effect_test.test.p,
        level=search.missing_effect_test.test.level,
        rests_on=examiner.rests_on,
        rmse=rmse,
        held_out_rmse=world.rmse(examiner.left_out(search.base)),
        noise_floor=search.noise,
        full_scale=full_scale,
        effects=evidence,
        tried=tuple(tried),
        faint=_faint(search, evidence),
        baseline=search.baseline,
        residual=search.base.rows * world.samples.sigma,
        notes=(*notes, *search.sifted, *search.notes),
        substitutes=_substitutes(search),
    )


def _substitutes(search: Search) -> tuple[tuple[str, str], ...]:
    """What would do as well in place of an effect of the model, where nothing is found missing from it."""
    if not search.base_is_adequate:
        return ()
    world, missing_effect_test = search.world, search.missing_effect_test
    unseen = [
        name
        for name in world.candidates
        if frozenset([name]) in search.fits and missing_effect_test.of(name).limit is None
    ]
    return substitutes(world, search.base, search.fits, unseen, missing_effect_test.noise_rms)


def _chosen(
    search: Search,
) -> tuple[list[frozenset[str]], tuple[tuple[str, ...], ...], dict[frozenset[str], str]]:
    """The adequate sets that are named, the classes of exact likes, and why the others are not named."""
    fits, examiner = search.fits, search.examiner
    predicting = best_predicting(search.adequate, fits, examiner, examiner.settings.verdict)
    adequacy = unrivalled(predicting, fits, examiner, examiner.settings.verdict)
    kept, classes, wider = simplest(
        search.world, adequacy, fits, search.missing_effect_test.noise_rms, examiner.settings.verdict
    )
    passed = dict.fromkeys(search.adequate, "explains the data, but foretells runs left out worse than others")
    passed |= dict.fromkeys(predicting, "explains the data, but others are seen in what it leaves")
    for added, host in wider.items():
        passed[added] = f"explains the data, and so does its special case {' + '.join(sorted(host))}"
    return kept, classes, {added: why for added, why in passed.items() if added not in kept}


def _said(search: Search, kept: Sequence[frozenset[str]], evidence: dict[str, Evidence]) -> tuple[str, tuple[str, ...]]:
    settings = search.examiner.settings.verdict
    readings, numbers = len(search.world.samples), len(search.base.free)
    if readings < numbers + settings.spare_readings:
        return "inconclusive", (f"{readings} readings cannot judge a model with {numbers} fitted numbers: record more",)
    if search.missing_effect_test.test.runs_differ:
        message = "loops say that something is missing, but what differs from run to run would look the same"
        return "inconclusive", (f"{message}: record each state in more runs",)
    if not search.base_is_adequate:
        if not search.missing_effect_test.rejected:
            return "inconclusive", ("an added effect lowers the error, but the test does not see that one is missing",)
        return ("not in the library", "missing", "one of")[min(len(kept), 2)], ()
    if not search.examiner.flip_groups.trusted and search.missing_effect_test.test.ratio_p < settings.ratio_p:
        return "inconclusive", ("too few loops to flip, and the noise model alone says that something is missing",)
    blind = _faint(search, evidence)
    if blind:
        return "inconclusive", (f"too little of it would show: {', '.join(blind)}",)
    if search.moving_only:
        return "inconclusive", ("these motions do not show a break-away or a standstill: record a loop as well",)
    return "nothing detectable", ()


def _faint(search: Search, evidence: dict[str, Evidence]) -> tuple[str, ...]:
    """Effects that could hide in these data at more than the noise of a reading."""
    noise = float(np.median(search.world.samples.sigma[search.world.in_newtons]))
    return tuple(e.name for e in evidence.values() if e.detection_limit is not None and e.detection_limit > noise)


def _evidence(search: Search, name: str, passed: Mapping[frozenset[str], str]) -> Evidence:
    world, examiner, added = search.world, search.examiner, frozenset([name])
    fit, seen = search.fits.get(added), search.missing_effect_test.of(name)
    if fit is None:
        needs = " and ".join(world.lacking(world.with_added([name])))
        why = f": needs {needs}" if needs else ": gives no number on these data" if added in search.numberless else ""
        return Evidence(name, reason=f"cannot be tested{why}")
    adequacy = search.adequacy_tests.get(added)
    return Evidence(
        name,
        p_value=seen.p_value,
        rmse=world.rmse(fit.rows),
        held_out_rmse=world.rmse(examiner.left_out(fit)),
        detection_limit=seen.limit,
        absorbed_share=seen.absorbed,
        similar=seen.similar,
        estimate=estimate(world, fit, name),
        adequate=added in search.adequate,
        reason=passed.get(added, adequacy.reason if adequacy else "" if seen.limit else "these data cannot see it"),
    )


def _explanation(search: Search, added: frozenset[str], passed: Mapping[frozenset[str], str]) -> Explanation:
    world, fit, adequacy = search.world, search.fits[added], search.adequacy_tests.get(added)
    groups = search.examiner.groups
    glance = len(added) > 1 and adequacy is None
    before, after = (search.examiner.left_out(t, glance) for t in (search.base, fit))
    fall, error = difference(before, after, groups)
    return Explanation(
        tuple(sorted(added)),
        world.rmse(fit.rows),
        world.rmse(after),
        fall / max(error, 1e-300),
        adequacy.test.p if adequacy and adequacy.test else float("nan"),
        added in search.adequate,
        passed.get(added, adequacy.reason if adequacy else "not tested: others leave far less"),
        plausible(world, added, fit),
        estimates(world, fit, sorted(added)) if added in search.adequate else {},
    )
