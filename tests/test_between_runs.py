"""Runs too few to be flipped: what may differ between them, and how far."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from test_flips import samples, two_runs

from fitting.diagnosis import between_runs
from fitting.diagnosis.settings import FITS, NUISANCE
from fitting.diagnosis.universe import CandidateFit, Universe
from fitting.problem.unknowns import Unknown, Unknowns

FRICTION = Unknown("coulomb_friction.f_s", "1", 0.0, 0.2, 0.02, (0.02,), None)
RADIUS = Unknown("muscle.radius", "m", 0.006, 0.008, 0.007, (0.007,), None)
SIZE = 100.0  # of friction at one bar, in standard deviations of a reading
LAYOUT = Unknowns((FRICTION, RADIUS), (), ())


def fit(s, rows):
    """Friction and radius, both linear; the range of friction is ten times its value."""
    slopes = np.stack([10 * SIZE * s.branch * s.pressure / 1e5, SIZE * s.pressure / 1e5], axis=1)
    names = ("coulomb_friction.f_s", "muscle.radius")
    return CandidateFit(frozenset(), np.array([0.02, 0.007]), names, rows, slopes, np.zeros(0), np.zeros((0, 2)), ())


def differing(s, share):
    """Friction larger in the second run by a share of itself, smaller in the first by as much."""
    return s.branch * s.pressure / 1e5 * share * np.where(s.run == 1, 1.0, -1.0)


def test_few_are_those_whose_flips_cannot_reach_the_level():
    s = samples()
    assert between_runs.too_few(two_runs(), 0.01)
    assert between_runs.too_few(s, 0.01)  # five
    assert not between_runs.too_few(s, 0.2)
    assert not between_runs.too_few(two_runs().where(two_runs().run == 0), 0.01)  # one run cannot differ from itself


@pytest.mark.parametrize(("share", "taken"), [(0.03, True), (0.5, False)])
def test_a_few_percent_of_friction_may_differ_but_not_half_of_it(share, taken):
    s = two_runs()
    found = fit(s, SIZE * differing(s, share))
    left = between_runs.nuisance_between_runs(found, LAYOUT, s).left(found.rows)
    # what two such differences cost: one standard deviation each, or many
    priced = 2 * (share / NUISANCE.repeatable) ** 2
    assert left <= 1.01 * priced < between_runs.common_nuisance(found).left(found.rows)
    assert (left < 4) == taken


@pytest.mark.parametrize(("share", "least", "most"), [(0.03, 0.0, 0.01), (0.06, 0.0, 0.01), (1.5, 0.9, 1.0)])
def test_runs_do_not_differ_by_more_than_is_likely_at_all(share, least, most):
    """Each may be two standard deviations off, 6 %, not fifty: then what all runs have in common leaves as much."""
    s = two_runs()
    rows = SIZE * differing(s, share)
    found = fit(s, rows)
    apart_left, common_left = (
        by.left_at_most(rows)
        for by in (between_runs.nuisance_between_runs(found, LAYOUT, s), between_runs.common_nuisance(found))
    )
    assert least <= np.linalg.norm(apart_left) / np.linalg.norm(common_left) <= most
    assert np.sum(common_left**2) == pytest.approx(between_runs.common_nuisance(found).left(rows))


def test_an_error_beyond_all_measure_is_left():
    """Newtons called kilonewtons: no hold is tight enough, and nothing but the error has to be said."""
    s = two_runs()
    rows = 1e9 * SIZE * differing(s, 1.0)
    left = between_runs.nuisance_between_runs(fit(s, rows), LAYOUT, s).left_at_most(rows)
    assert np.linalg.norm(left) > 0.5 * np.linalg.norm(rows)


def test_a_range_in_decades_changes_nothing_in_what_may_differ():
    """A parameter that is searched for in its logarithm may differ by the same share of itself."""
    s = two_runs()
    decades = Unknown("coulomb_friction.f_s", "1", 0.001, 1.0, 0.02, (0.02,), None)
    assert decades.logarithmic
    rows = SIZE * differing(s, 0.03)
    plain = fit(s, rows)
    steeper = np.stack([plain.slopes[:, 0] / 10 * np.log(1000), plain.slopes[:, 1]], axis=1)
    layout = Unknowns((decades, RADIUS), (), ())
    both = (between_runs.nuisance_between_runs(plain, LAYOUT, s).left(rows),
            between_runs.nuisance_between_runs(replace(plain, slopes=steeper), layout, s).left(rows))  # fmt: skip
    assert both[1] == pytest.approx(both[0], rel=1e-6)


def test_the_muscle_is_the_same_in_every_run():
    s = two_runs()
    rows = s.pressure / 1e4 * np.where(s.run == 1, 1.0, -1.0) * (s.contraction - np.mean(s.contraction))
    found = fit(s, rows)
    both = (
        between_runs.nuisance_between_runs(found, LAYOUT, s).left(rows),
        between_runs.common_nuisance(found).left(rows),
    )
    assert both[0] == pytest.approx(both[1], rel=1e-6)


@pytest.mark.parametrize(("step", "taken"), [(1.0, True), (30.0, False)])
def test_a_zero_may_step_by_the_noise_of_a_reading_but_not_by_many_times_it(step, taken):
    """Where every run has its own pressure a step would else look like what depends on pressure."""
    s = two_runs()
    rows = step * np.where(s.run == 1, 1.0, -1.0)
    found = fit(s, rows)
    left = between_runs.nuisance_between_runs(found, LAYOUT, s).left(rows)
    priced = 2 * (step / NUISANCE.zero) ** 2
    assert left <= 1.01 * priced < between_runs.common_nuisance(found).left(rows)
    assert (left < 4) == taken


def agreeing(spread, random, runs=10):
    """Ten runs of two loops of noise at five states, and what friction that differs by `spread` adds."""
    run = np.repeat(np.arange(runs), 200)
    columns = 100 * np.stack([np.where(run == r, np.tile([1.0, -1.0], 100 * runs), 0.0) for r in range(runs)], axis=1)
    states = np.stack([columns[:, r] + columns[:, r + 1] for r in range(0, runs, 2)], axis=1)
    rows = random.normal(size=len(run)) + columns @ (spread / NUISANCE.repeatable * random.normal(size=runs))
    return columns, rows, states / np.linalg.norm(states, axis=0)


@pytest.mark.parametrize(("spread", "least", "most"), [(0.0, 0.0, 0.03), (0.01, 0.25, 0.42), (0.05, 0.9, 1.0)])
def test_runs_may_differ_as_far_as_runs_of_one_state_do(spread, least, most):
    """Half of the estimates are too small and half too large; never is more allowed than is usual."""
    random = np.random.default_rng(7)
    shares = []
    for _ in range(60):
        columns, rows, states = agreeing(spread, random)
        allowed = between_runs.as_far_as_seen(columns, np.zeros(10, int), rows, states)
        shares.append(np.linalg.norm(allowed) / np.linalg.norm(columns))
    assert least <= np.median(shares) <= most
    assert max(shares) <= 1


def test_where_no_state_is_repeated_all_that_is_usual_is_allowed():
    columns, rows, _ = agreeing(0.0, np.random.default_rng(8))
    every = columns / np.linalg.norm(columns, axis=0)
    np.testing.assert_array_equal(between_runs.as_far_as_seen(columns, np.zeros(10, int), rows, every), columns)


def test_a_difference_of_which_next_to_nothing_is_left_tells_nothing():
    """A hundredth of it stands beside what all runs share: that is no measure of how far runs differ."""
    columns, rows, _ = agreeing(0.0, np.random.default_rng(8))
    random = np.random.default_rng(9)
    nearly = columns / np.linalg.norm(columns, axis=0) + 0.01 * random.normal(size=columns.shape) / np.sqrt(len(rows))
    beside = np.linalg.qr(nearly)[0]
    left = columns - beside @ (beside.T @ columns)
    assert 0.005 < np.linalg.norm(left) / np.linalg.norm(columns) < 0.02
    shares = between_runs.shares_seen(columns, np.zeros(10, int), rows[:, None], beside)
    np.testing.assert_array_equal(shares[0], [1.0])


def test_what_priors_hold_does_not_give_way():
    """A column that geometry could make up for is left whole where that is known, and vanishes where it is not."""
    s = two_runs()
    column = (s.pressure / 1e5)[:, None]
    free = fit(s, np.zeros(len(s)))
    held = replace(free, prior_rows=np.zeros(1), prior_slopes=np.array([[0.0, 1e9]]))
    assert np.linalg.norm(between_runs.common_nuisance(free).project_out(column)) < 1e-6 * np.linalg.norm(column)
    np.testing.assert_allclose(between_runs.common_nuisance(held).project_out(column), column, rtol=1e-6)


def test_every_parameter_has_its_own_share():
    """Friction differs between ten runs, another parameter does not; no row of a third has a group."""
    random = np.random.default_rng(2)
    run = np.repeat(np.arange(10), 40)
    up, ramp = np.tile([1.0, -1.0], 200), np.tile(np.linspace(-1, 1, 40), 10)
    own = [np.where(run == r, column, 0.0) for column in (up, ramp) for r in range(10)]
    columns, group = 20 * np.stack(own, axis=1), np.repeat([4, 7], 10)
    beside = np.stack([up, ramp], axis=1) / np.sqrt([np.sum(up**2), np.sum(ramp**2)])
    rows = columns[:, :10] @ random.normal(size=10) + random.normal(size=400)
    shares = between_runs.shares_seen(np.hstack([columns, columns[:, :1]]), np.append(group, -1), rows[:, None], beside)
    assert set(shares) == {4, 7}
    assert 0.5 < shares[4][0] < 2
    assert shares[7][0] < 0.1


def test_what_was_measured_may_be_denied_from_either_side():
    """Stated with a standard error: more than four of these away, above or below, and the trial denies it."""
    stated = (replace(RADIUS, prior=(0.007, 1e-4)), replace(RADIUS, name="muscle.length", prior=(0.3, 1e-3)), FRICTION)
    world = SimpleNamespace(layout=Unknowns(stated, (), ()), settings=FITS)
    for rows, denied in (([0.5, -4.5], ("muscle.length",)), ([3.9, -3.9], ()), ([4.5, 0.0], ("muscle.radius",))):
        assert Universe.contradicted(world, SimpleNamespace(prior_rows=np.array(rows))) == denied
