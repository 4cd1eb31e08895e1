"""Runs too few to be flipped: what may differ between them, and how far."""

import numpy as np
import pytest
from test_flips import samples, two_runs

from fitting import apart
from fitting.universe import Trial
from fitting.unknowns import Unknown, Unknowns

FRICTION = Unknown("coulomb_friction.f_s", "1", 0.0, 0.2, 0.02, (0.02,), None)
RADIUS = Unknown("muscle.radius", "m", 0.006, 0.008, 0.007, (0.007,), None)
SIZE = 100.0  # of friction at one bar, in standard deviations of a reading
LAYOUT = Unknowns((FRICTION, RADIUS), (), ())


def trial(s, rows):
    """Friction and radius, both linear; the range of friction is ten times its value."""
    slopes = np.stack([10 * SIZE * s.branch * s.pressure / 1e5, SIZE * s.pressure / 1e5], axis=1)
    names = ("coulomb_friction.f_s", "muscle.radius")
    return Trial(frozenset(), np.array([0.02, 0.007]), names, rows, slopes, np.zeros(0), np.zeros((0, 2)), ())


def differing(s, share):
    """Friction larger in the second run by a share of itself, smaller in the first by as much."""
    return s.branch * s.pressure / 1e5 * share * np.where(s.run == 1, 1.0, -1.0)


def test_few_are_those_whose_flips_cannot_reach_the_level():
    s = samples()
    assert apart.too_few(two_runs(), 0.01)
    assert apart.too_few(s, 0.01)  # five
    assert not apart.too_few(s, 0.2)
    assert not apart.too_few(two_runs().where(two_runs().run == 0), 0.01)  # one run cannot differ from itself


@pytest.mark.parametrize(("share", "taken"), [(0.03, True), (0.5, False)])
def test_a_few_percent_of_friction_may_differ_but_not_half_of_it(share, taken):
    s = two_runs()
    found = trial(s, SIZE * differing(s, share))
    left = apart.from_run_to_run(found, LAYOUT, s).left(found.rows)
    priced = 2 * (share / apart.REPEATABLE) ** 2  # what two such differences cost: one standard deviation each, or many
    assert left <= 1.01 * priced < apart.together(found).left(found.rows)
    assert (left < 4) == taken


def test_the_muscle_is_the_same_in_every_run():
    s = two_runs()
    rows = s.pressure / 1e4 * np.where(s.run == 1, 1.0, -1.0) * (s.contraction - 0.1)
    found = trial(s, rows)
    both = apart.from_run_to_run(found, LAYOUT, s).left(rows), apart.together(found).left(rows)
    assert both[0] == pytest.approx(both[1], rel=1e-6)
