"""From a search to its verdict: which sets are named, what speaks for each effect, what is not decided."""

from collections.abc import Mapping, Sequence

import numpy as np

from fitting.comparison.compare import NEGLIGIBLE
from fitting.diagnosis.adequacy import AdequacyTest
from fitting.diagnosis.blamed import blamed
from fitting.diagnosis.candidate_fit import CandidateFit
from fitting.diagnosis.equivalent import best_predicting, leading_of, plausible, simplest, unrivalled
from fitting.diagnosis.estimates import estimate, estimates
from fitting.diagnosis.findings import Blamed
from fitting.diagnosis.flip_groups import too_few_to_flip
from fitting.diagnosis.instrument_answers import instrument_answers
from fitting.diagnosis.likelihood import likeliest
from fitting.diagnosis.odd_runs import odd_runs
from fitting.diagnosis.outcomes import NOTHING_MISSING, Reason, Verdict, Why
from fitting.diagnosis.record import Diagnosis, Evidence, Explanation
from fitting.diagnosis.search_result import SearchResult
from fitting.diagnosis.substitutes import substitutes
from fitting.diagnosis.trusting import fit_trusting
from fitting.instruments.errors import InstrumentErrors
from fitting.least_squares.held_out import difference


def diagnosis_of(search: SearchResult) -> Diagnosis:
    """The verdict of a search, with its evidence."""
    world, examiner, settings = search.world, search.examiner, search.examiner.settings.verdict
    kept, classes, passed = _chosen(search)
    evidence = {name: _evidence(search, name, passed) for name in world.candidates}
    evidence |= {name: Evidence(name, why=why) for name, why in world.untestable.items()}
    verdict, why = _decided(search, kept)
    if verdict is Verdict.INCONCLUSIVE:
        kept, classes = [], ()
    near = _nearest(search) if verdict is Verdict.NOT_IN_LIBRARY else []
    fit_trusting(examiner, search.fits, [*kept[: settings.nearest], *near])
    found = {added: _explanation(search, added, passed) for added in search.fits}
    rmse, full_scale = world.rmse(search.base.rows), float(np.max(np.abs(world.samples.measured[world.in_newtons])))
    left = world.rmse(examiner.as_fitted(kept[0], search.fits[kept[0]]).rows) if kept else search.noise
    return Diagnosis(
        verdict=verdict,
        negligible=verdict not in NOTHING_MISSING and np.sqrt(max(rmse**2 - left**2, 0)) < NEGLIGIBLE * full_scale,
        explanations=tuple(tuple(sorted(added)) for added in kept),
        classes=classes,
        nearest=tuple(found[added] for added in near),
        leading=None if verdict in NOTHING_MISSING else leading_of(world, search.base, search.fits, examiner, settings),
        p_value=search.missing_effect_test.test.p,
        level=search.missing_effect_test.test.level,
        rests_on=examiner.rests_on,
        rmse=rmse,
        held_out_rmse=world.rmse(examiner.left_out(search.base)),
        noise_floor=search.noise,
        full_scale=full_scale,
        effects=evidence,
        tried=tuple(sorted(found.values(), key=lambda e: e.held_out_rmse)),
        instruments=instrument_answers(examiner, search.base, search.missing_effect_test.rejected),
        blamed=_blamed(search, kept),
        faint=_faint(search, search.missing_effect_test),
        baseline=search.baseline,
        residual=search.base.rows * world.samples.sigma,
        why=why,
        screened=search.screened,
        notes=search.notes,
        odd_runs=odd_runs(search, kept),
        unexplained=unexplained(search, search.base),
        substitutes=_substitutes(search),
        changes={added: _change(search, added) for added in search.fits if len(added) == 1 or added in kept},
    )


def _nearest(search: SearchResult) -> list[frozenset[str]]:
    """The sets that leave least unexplained, what stands by itself first."""
    left = {added: unexplained(search, fit) for added, fit in search.fits.items()}
    settings, before = search.examiner.settings.verdict, unexplained(search, search.base)
    helping = [added for added in left if left[added] < settings.explains * before]
    stands = {added: plausible(search.world, added, search.fits[added]) for added in helping}
    return sorted(helping, key=lambda added: (not stands[added], left[added]))[: settings.nearest]


def _change(search: SearchResult, added: frozenset[str]) -> np.ndarray:
    """What a set of effects changes the prediction by, N, as fits that trust every reading have it."""
    after = search.examiner.as_fitted(added, search.fits[added])
    return (after.rows - search.base.rows) * search.world.samples.sigma


def _blamed(search: SearchResult, kept: Sequence[frozenset[str]]) -> tuple[Blamed, ...]:
    """What each explanation asks of instruments, the likeliest first."""
    if not kept:
        return ()
    sources = search.examiner.errors(search.base, every=True).sources
    return tuple(each for added in kept for each in blamed(search.world, added, search.fits[added], sources))


def _substitutes(search: SearchResult) -> tuple[tuple[str, str], ...]:
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
    search: SearchResult,
) -> tuple[list[frozenset[str]], tuple[tuple[tuple[str, ...], ...], ...], dict[frozenset[str], Why]]:
    """The adequate sets that are named, the classes of exact equals, and why the others are not named."""
    fits, examiner = search.fits, search.examiner
    predicting = best_predicting(search.adequate, fits, examiner, examiner.settings.verdict)
    standing = unrivalled(predicting, fits, examiner, examiner.settings.verdict)
    likely = likeliest(standing, fits, examiner, examiner.settings.verdict)
    kept, classes, wider = simplest(
        search.world, likely, fits, search.missing_effect_test.noise_rms, examiner.settings.verdict
    )
    passed = dict.fromkeys(search.adequate, Why(Reason.PREDICTS_WORSE))
    passed |= dict.fromkeys(predicting, Why(Reason.RIVAL_SEEN))
    passed |= dict.fromkeys(standing, Why(Reason.LESS_LIKELY))
    for added, host in wider.items():
        passed[added] = Why(Reason.SPECIAL_CASE, tuple(sorted(host)))
    kept = [added for added in likely if added in kept]  # the likeliest first
    return kept, classes, {added: why for added, why in passed.items() if added not in kept}


def _decided(search: SearchResult, kept: Sequence[frozenset[str]]) -> tuple[Verdict, Why | None]:
    """The verdict, and why nothing is decided where it is inconclusive."""
    why = _undecided(search)
    if why is None and search.base_is_adequate:
        exact = _with_exact_instruments(search)
        if exact.rejected or _mostly_instruments(search):
            return Verdict.WITHIN_INSTRUMENTS, None
        why = _unseen(search, exact)
        return (Verdict.INCONCLUSIVE if why else Verdict.NOTHING), why
    if why is not None:
        return Verdict.INCONCLUSIVE, why
    if not kept and too_few_to_flip(search.examiner.rests_on, search.examiner.settings.flip_test):
        return Verdict.INCONCLUSIVE, Why(Reason.FEW_LOOPS)
    return (Verdict.NOT_IN_LIBRARY, Verdict.MISSING, Verdict.ONE_OF)[min(len(kept), 2)], None


def _undecided(search: SearchResult) -> Why | None:
    """Why the test of the base decides nothing; None where it does."""
    readings, fitted = len(search.world.samples), len(search.base.free)
    if readings < fitted + search.examiner.settings.verdict.spare_readings:
        return Why(Reason.FEW_READINGS, readings=readings, fitted=fitted)
    if not search.base_is_adequate and not search.missing_effect_test.rejected:
        return Why(Reason.TEST_BLIND)
    return None


def _with_exact_instruments(search: SearchResult) -> AdequacyTest:
    """The test of the base, with limits, were no instrument allowed to err."""
    exact = InstrumentErrors.none(search.world.samples.run)
    return search.examiner.adequacy(frozenset(), search.base, search.fits, limits=True, errors=exact)


def _mostly_instruments(search: SearchResult) -> bool:
    """Whether instruments make a misfit of many times what is left beyond them.

    Flips are blind to a length that is off by a millimetre in each of a few runs: their signs are as often one as the
    other. No reader would take such a misfit for noise.
    """
    test = search.missing_effect_test.test
    return test.rms > search.examiner.settings.flip_test.many * test.rms_beyond


def _unseen(search: SearchResult, exact: AdequacyTest) -> Why | None:
    """Why an adequate base does not show that nothing is missing; None where it does.

    What could hide behind the errors of instruments alone does not speak against the recording.
    """
    ratio_p, settings = search.missing_effect_test.test.ratio_p, search.examiner.settings.verdict
    if not search.examiner.flip_groups.trusted and ratio_p < settings.ratio_p:
        return Why(Reason.FEW_LOOPS)
    blind = _faint(search, exact)
    if blind:
        return Why(Reason.FAINT, blind)
    return Why(Reason.ONLY_MOTIONS) if search.moving_only else None


def _faint(search: SearchResult, test: AdequacyTest) -> tuple[str, ...]:
    """Effects that could hide at a size that matters: above a reading's noise and half a per cent of full scale."""
    samples, of_force = search.world.samples, search.world.in_newtons
    noise = float(np.median(samples.sigma[of_force]))
    matters = max(noise, NEGLIGIBLE * float(np.max(np.abs(samples.measured[of_force]))))
    limits = {name: [t.of(name).limit for t in (test, search.missing_effect_test)] for name in search.world.candidates}
    return tuple(name for name, both in limits.items() if all(limit is not None and limit > matters for limit in both))


def unexplained(search: SearchResult, fit: CandidateFit) -> float:
    """Rms of what neither noise nor instruments within their accuracy can make of a fit's misfit, N."""
    samples, of_force = search.world.samples, search.world.in_newtons
    over = search.examiner.left(fit) / len(samples) - search.missing_effect_test.noise_rms**2
    return float(np.sqrt(max(over, 0.0) * np.mean(samples.sigma[of_force] ** 2)))


def _evidence(search: SearchResult, name: str, passed: Mapping[frozenset[str], Why]) -> Evidence:
    world, examiner, added = search.world, search.examiner, frozenset([name])
    fit, seen = search.fits.get(added), search.missing_effect_test.of(name)
    if fit is None:
        needs = world.lacking(world.with_added([name]))
        other = Reason.NO_NUMBER if added in search.numberless else Reason.NOT_FITTED
        return Evidence(name, why=Why(Reason.NEEDS, needs) if needs else Why(other))
    adequacy, shown = search.adequacy_tests.get(added), examiner.as_fitted(added, fit)
    # what stands has the values that are likelier where instruments err, what does not those that leave its error
    sized = (examiner.seen, fit) if added in search.adequate else (world, shown)
    return Evidence(
        name,
        p_value=seen.p_value,
        rmse=world.rmse(shown.rows),
        held_out_rmse=world.rmse(examiner.left_out(shown)),
        unexplained=unexplained(search, fit),
        detection_limit=seen.limit,
        absorbed_share=seen.absorbed,
        similar=seen.similar,
        estimate=estimate(*sized, name),
        adequate=added in search.adequate,
        why=passed.get(added, adequacy.why if adequacy else None if seen.limit else Why(Reason.NOT_SEEN)),
    )


def _explanation(search: SearchResult, added: frozenset[str], passed: Mapping[frozenset[str], Why]) -> Explanation:
    world, fit, adequacy = search.world, search.fits[added], search.adequacy_tests.get(added)
    groups = search.examiner.groups
    glance = len(added) > 1 and adequacy is None
    before, after = (search.examiner.beyond_instruments(t, glance) for t in (search.base, fit))
    fall, error = difference(before, after, groups)
    shown = search.examiner.as_fitted(added, fit)
    return Explanation(
        tuple(sorted(added)),
        world.rmse(shown.rows),
        world.rmse(search.examiner.left_out(shown, glance)),
        fall / max(error, 1e-300),
        adequacy.test.p if adequacy and adequacy.test else float("nan"),
        added in search.adequate,
        passed.get(added, adequacy.why if adequacy else Why(Reason.FAR_WORSE)),
        plausible(world, added, fit),
        estimates(search.examiner.seen, fit, sorted(added)) if added in search.adequate else {},
        unexplained(search, fit),
        tuple(sorted(search.base.effects - fit.effects)),
    )
