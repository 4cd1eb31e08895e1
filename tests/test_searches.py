"""Fits by a program of their own and by the one that holds every effect: the same rows, slopes, ends and records."""

from dataclasses import replace

import numpy as np
import pytest
from small_muscle import loops, write

from fitting.diagnosis.among_all import AmongAll
from fitting.diagnosis.diagnose import prepared
from fitting.diagnosis.lay_out import universe
from fitting.least_squares import search
from fitting.least_squares.evaluate import evaluate, rmse_at_pressures
from fitting.least_squares.fit import fit, fit_problem
from fitting.least_squares.instruments import accuracies_of
from fitting.least_squares.refits import without_each
from fitting.least_squares.searches import Alone
from fitting.least_squares.subset import subset_of
from fitting.problem.residuals import LIGHT, problem
from fitting.problem.sizes import Standard
from fitting.problem.unknowns import unknowns
from fitting.problem.varying import AS_DECLARED
from fitting.recordings.experiment import read_experiment
from mckibben_jax.effects import BladderNeoHookean, CoulombFriction, EndStop, IdealCylinder, Tip

BASE = (IdealCylinder(), CoulombFriction())
CANDIDATES = (Tip(), EndStop(), BladderNeoHookean())


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    return read_experiment(write(tmp_path_factory.mktemp("recorded"), loops(points=30, repeats=2)))


@pytest.fixture(scope="module")
def laid_out(recorded):
    layout = unknowns([recorded], BASE)
    return layout, *problem([recorded], layout)


@pytest.fixture(scope="module")
def both(recorded, laid_out):
    """The same searches by a program of the model alone, and among all candidates; with what varies."""
    layout, given, _ = laid_out
    among_all = AmongAll(universe([recorded], BASE, CANDIDATES), layout)
    names = AS_DECLARED.names(layout)
    return Alone.of(given), among_all, subset_of(layout, layout.start, names)


def measured(searches, found):
    """What was evaluated, without the rows that fill a standard size."""
    return found.at(searches.standard.rows)


def test_rows_and_slopes_at_a_place_are_those_of_the_model_alone(both):
    alone, among_all, subset = both
    place = np.full(len(subset.free), 0.4)
    one, other = measured(alone, alone.at(subset, place)), measured(among_all, among_all.at(subset, place))
    np.testing.assert_allclose(other.rows, one.rows, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(other.slopes, one.slopes, rtol=1e-7, atol=1e-7)
    assert np.ptp(np.asarray(one.slopes), axis=0).min() > 0.1


def test_an_effect_that_is_switched_off_is_left_out(both):
    alone, among_all, subset = both
    place = np.full(len(subset.free), 0.4)
    off = [name != "coulomb_friction" for name in alone.template.names]
    some = replace(subset, switches=np.asarray(off, float))
    one, other = measured(alone, alone.at(some, place)).rows, measured(among_all, among_all.at(some, place)).rows
    np.testing.assert_allclose(other, one, rtol=1e-9, atol=1e-9)
    assert np.max(np.abs(other - measured(among_all, among_all.at(subset, place)).rows)) > 1.0


def test_searches_end_at_the_same_place_however_many_are_asked_for_at_once(both):
    starts = np.random.default_rng(0).uniform(0.2, 0.8, (3, len(both[2].free)))
    for searches in both[:2]:
        found = searches.search(both[2], starts)
        assert len(found.ends.cost) == len(found.ends.place) == 3
        assert float(found.cost) == pytest.approx(float(np.min(found.ends.cost)))
        assert searches.look(both[2], np.asarray(found.place)[None])[0] == pytest.approx(float(found.cost), rel=1e-9)
    ends = [searches.search(both[2], starts).place for searches in both[:2]]
    np.testing.assert_allclose(ends[1], ends[0], atol=1e-4)


def test_a_search_that_meets_no_finite_number_ends_where_it_began(both, laid_out):
    alone, _, subset = both
    _, given, _ = laid_out
    nowhere = replace(given, blocks=tuple(replace(block, measured=block.measured * np.nan) for block in given.blocks))
    starts = np.random.default_rng(0).uniform(0.2, 0.8, (3, len(subset.free)))
    found = Alone.of(nowhere).search(subset, starts)
    assert np.all(np.isinf(found.ends.cost))
    assert np.isinf(found.cost)
    np.testing.assert_array_equal(found.ends.place, starts)
    np.testing.assert_array_equal(found.place, starts[0])
    assert np.isinf(Alone.of(nowhere).look(subset, starts)).all()
    assert np.isfinite(alone.look(subset, starts)).all()


def test_what_is_left_out_of_several_recordings_of_several_muscles_is_what_was_asked_for(recorded):
    """In the standard size of a problem readings stand in another order, and others fill the lanes."""
    twice = replace(recorded.recordings[0], runs=recorded.recordings[0].runs[:2], file="again.csv")
    more = replace(recorded, name="another", recordings=(*recorded.recordings, twice))
    layout = unknowns([recorded, more], BASE)
    given, samples = problem([recorded, more], layout)
    standard, mask = Standard.of(given), np.random.default_rng(1).random(len(samples)) < 0.3
    point = layout.start, np.ones(len(BASE))
    whole, left = (np.asarray(each.problem.rows(*point))[standard.rows] for each in (standard, standard.without(mask)))
    assert len(whole) == len(samples) + given.prior_at.size
    shares = np.append(np.where(mask, LIGHT, 1.0), np.ones(given.prior_at.size))
    np.testing.assert_allclose(left * shares, whole, rtol=1e-12)
    assert np.abs(whole[: len(samples)]).min() > 0


def test_a_search_keeps_to_the_ranges_of_the_subset(both):
    """Which may be narrower than those of the whole library: stated sizes that are confined, or values held still."""
    subset, start = both[2], np.full((1, len(both[2].free)), 0.4)
    held, value = subset.free[0], subset.full[subset.free[0]] * 1.03
    lower, upper = subset.lower.copy(), subset.upper.copy()
    lower[held] = upper[held] = value
    still = replace(subset, lower=lower, upper=upper)
    costs = [float(searches.search(still, start).cost) for searches in both[:2]]
    assert costs[1] == pytest.approx(costs[0], rel=1e-6)
    assert costs[1] > 1.01 * float(both[1].search(subset, start).cost)


def test_a_search_that_has_not_converged_goes_on_from_where_it_ended(both):
    _, among_all, subset = both
    world, start = among_all.world, np.full((1, len(subset.free)), 0.9)

    def searched(further):
        few = replace(world, settings=replace(world.settings, steps=3, further=further))
        return AmongAll(few, among_all.layout).search(subset, start)

    assert not searched(0).ends.converged[0]
    assert float(searched(1).cost) < 0.9 * float(searched(0).cost)
    assert searched(30).ends.converged[0]
    assert float(searched(30).cost) == pytest.approx(float(among_all.search(subset, start).cost), rel=1e-6)


def test_costs_are_looked_at_without_a_search(both):
    places = np.array([np.full(len(both[2].free), at) for at in (0.2, 0.5, 0.7)])
    costs = [searches.look(both[2], places) for searches in both[:2]]
    np.testing.assert_allclose(costs[1], costs[0], rtol=1e-9)
    assert len(set(costs[0])) == 3


def test_what_was_searched_through_instruments_is_given_back_as_it_is(both):
    """An error that shifts all rows: the search does not mind, and the rows at its end are those of the model there."""
    start = np.full((1, len(both[2].free)), 0.4)
    for searches in both[:2]:
        count = len(searches.standard.rows) - 2  # without radius and braid angle, which are stated with errors
        found = searches.search(both[2], start, np.full((count, 1), 3.0))
        there = searches.at(both[2], np.asarray(found.place))
        np.testing.assert_allclose(found.rows, there.rows, atol=1e-6)
        np.testing.assert_allclose(found.slopes, there.slopes, atol=1e-5)


def test_a_fit_among_all_is_the_fit_alone(recorded, laid_out, both):
    layout, given, samples = laid_out
    names, accuracies = AS_DECLARED.names(layout), accuracies_of([recorded])
    other = fit_problem(layout, given, samples, layout.start, names, (), accuracies, starts=2, searches=both[1])
    one = fit([recorded], BASE, starts=2)
    assert other.free == one.free
    assert other.converged
    assert other.cost == pytest.approx(one.cost, rel=1e-6)
    for name in one.free:
        assert other.values[name] == pytest.approx(one.values[name], abs=0.02 * one.error(name))
        assert other.error(name) == pytest.approx(one.error(name), rel=0.02)


def test_fits_of_any_number_of_starts_and_their_refits_share_one_program(recorded):
    """What is left out of a refit counts next to nothing; other values are looked at by the same program, too."""
    search.solve.programs.clear()
    search.rows_and_slopes.programs.clear()
    for starts in (1, 2, 8):
        found = fit([recorded], BASE, starts=starts)
    parts = [found.samples.run == run for run in np.unique(found.samples.run)]
    for mask, (vector, rows) in zip(parts, without_each(found, parts), strict=True):
        other = evaluate([recorded], BASE, dict(zip(found.layout.names, vector, strict=True)), found.free)
        np.testing.assert_allclose(rows, (other.residual / other.samples.sigma), rtol=1e-6, atol=1e-6)
        assert np.sum(rows[~mask] ** 2) < np.sum((found.residual / found.samples.sigma)[~mask] ** 2)
        assert np.sum(rows[mask] ** 2) > np.sum((found.residual / found.samples.sigma)[mask] ** 2)
    rmse_at_pressures(found, 1e3)
    assert len(search.solve.programs) == 1
    assert len(search.rows_and_slopes.programs) == 0


def test_a_diagnosis_compiles_no_program_of_the_model_alone(recorded):
    search.solve.programs.clear()
    search.rows_and_slopes.programs.clear()
    prepared([recorded], BASE, CANDIDATES)
    prepared([recorded], (*BASE, Tip()), CANDIDATES, start={"muscle.radius": 0.008})
    assert len(search.solve.programs) == 1
    assert len(search.rows_and_slopes.programs) == 0
