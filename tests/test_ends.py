"""The ends of a bare net: against the shape of least potential of a net cut into pieces, and against closed forms."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.optimize import root

from mckibben_jax.laws.braid import ideal_force
from mckibben_jax.laws.ends import held_ends_factor, held_ends_length, held_ends_reach

RADIUS, LENGTH = 0.007, 0.3


def net(angle, contraction, pieces=600):
    """Radius along a net of least potential at pressure 1, pulled as the ideal muscle does, and its length."""
    step, k, b2 = LENGTH / pieces, np.tan(angle) / RADIUS, 1 / np.cos(angle) ** 2
    pull = float(ideal_force(contraction, 1.0, RADIUS, angle))

    def run(inner):
        r = jnp.concatenate([jnp.array([RADIUS]), inner, jnp.array([RADIUS])])
        middle, slope = (r[1:] + r[:-1]) / 2, jnp.diff(r) / step
        return r, middle, jnp.sqrt(b2 - k**2 * middle**2 - slope**2) * step

    def potential(scaled):
        _, middle, rise = run(scaled * RADIUS)
        return -jnp.sum((jnp.pi * middle**2 + pull) * rise) / (jnp.pi * RADIUS**2 * LENGTH)

    widest = float(np.sqrt(b2 - (1 - contraction) ** 2) / k)
    place = np.minimum(np.arange(1, pieces), np.arange(pieces - 1, 0, -1)) * step
    reach = float(held_ends_reach(contraction, RADIUS, angle))
    begin = widest - (widest - RADIUS) * np.exp(-place / (2 * reach))  # twice too far
    slope, bend = (jax.jit(each(potential)) for each in (jax.grad, jax.hessian))
    found = root(slope, begin / RADIUS, jac=bend, tol=1e-13)
    assert np.linalg.eigvalsh(bend(found.x)).min() > 0  # no saddle
    r, _, rise = run(found.x * RADIUS)
    return np.asarray(r), float(jnp.sum(rise)), widest


@pytest.mark.parametrize(("angle", "contraction"), [(20, 0.1), (26, 0.2), (35, 0.15)])
def test_the_length_is_that_of_the_net_of_least_potential(angle, contraction):
    angle = np.radians(angle)
    radius, length, widest = net(angle, contraction)
    assert radius[len(radius) // 2] == pytest.approx(widest, rel=5e-4)  # the middle is five reaches away at least
    longer = length - LENGTH * (1 - contraction)
    assert longer == pytest.approx(float(held_ends_length(contraction, RADIUS, angle)), rel=5e-3)


def test_the_radius_comes_to_that_of_the_middle_within_the_reach():
    angle, contraction = np.radians(26), 0.02
    radius, _, widest = net(angle, contraction)
    rise = np.diff(np.log(widest - radius[80:120])) / (LENGTH / 600 * (1 - contraction))
    assert -1 / rise.mean() == pytest.approx(float(held_ends_reach(contraction, RADIUS, angle)), rel=0.02)


@pytest.mark.parametrize("angle", [15, 25, 35])
def test_near_rest_the_ends_are_longer_by_two_over_the_root_of_three_times_the_growth(angle):
    angle = np.radians(angle)
    grown = RADIUS * (np.sqrt(1 - np.cos(angle) ** 2 * (1 - 1e-5) ** 2) / np.sin(angle) - 1)
    assert float(held_ends_length(1e-5, RADIUS, angle)) == pytest.approx(2 / np.sqrt(3) * grown, rel=1e-3)
    factor = 1 / (1 - 2 * RADIUS / (np.sqrt(3) * LENGTH * np.tan(angle) ** 2))
    assert float(held_ends_factor(1e-5, LENGTH, RADIUS, angle)) == pytest.approx(factor, rel=1e-3)


def test_it_scales_with_the_radius_and_has_slopes_at_rest():
    angle, eps = 0.4, jnp.array([0.0, 0.1, 0.3, 0.45])
    small, large = held_ends_length(eps, RADIUS, angle), held_ends_length(eps, 2 * RADIUS, angle)
    np.testing.assert_allclose(large, 2 * small, rtol=1e-12)
    slope = jax.vmap(jax.grad(lambda e: held_ends_length(e, RADIUS, angle)))(eps)
    assert np.isfinite(slope).all()
    assert float(slope[0]) == pytest.approx(2 / np.sqrt(3) * RADIUS / np.tan(angle) ** 2)
