"""Reynolds' three-element muscle against an integrator, against closed forms, and identified from a bellringer."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.constants import g
from scipy.integrate import solve_ivp
from scipy.optimize import least_squares

from mckibben_jax.laws.biology import voigt_acceleration
from mckibben_jax.laws.reynolds import affine, free_motion, rest_position

MASS, STIFFNESS, FORCE, START = 12.0, 9000.0, 900.0, 0.01
CRITICAL = 2 * np.sqrt(STIFFNESS * MASS)
TIME = np.linspace(0, 1.5, 301)
REST = float(rest_position(MASS * g, FORCE, STIFFNESS))


@pytest.mark.parametrize("share", [0.0, 0.05, 0.5, 0.99, 1.01, 2.0, 20.0])
def test_the_motion_is_that_of_equation_41(share):
    damping = share * CRITICAL

    def change(_, state):
        return [state[1], voigt_acceleration(state[0], state[1], FORCE, MASS, damping, STIFFNESS, g)]

    given = solve_ivp(change, (0, TIME[-1]), [START, 0.0], "Radau", TIME, rtol=1e-10, atol=1e-13)
    np.testing.assert_allclose(free_motion(TIME, START, REST, MASS, damping, STIFFNESS), given.y[0], atol=2e-8)


def test_at_critical_damping_the_motion_is_its_limit():
    slowing = np.sqrt(STIFFNESS / MASS)
    limit = REST + (START - REST) * (1 + slowing * TIME) * np.exp(-slowing * TIME)
    np.testing.assert_allclose(free_motion(TIME, START, REST, MASS, CRITICAL, STIFFNESS), limit, atol=1e-9)


@pytest.mark.parametrize("share", [0.1, 1.0, 3.0])
def test_it_begins_at_rest_and_ends_where_the_load_hangs(share):
    def place(time):
        return free_motion(time, START, REST, MASS, share * CRITICAL, STIFFNESS)

    assert float(place(0.0)) == pytest.approx(START)
    assert float(jax.grad(place)(0.0)) == pytest.approx(0, abs=1e-7)
    assert float(place(60.0)) == pytest.approx(REST, abs=1e-9)
    assert float(voigt_acceleration(REST, 0.0, FORCE, MASS, 1.0, STIFFNESS, g)) == pytest.approx(0, abs=1e-7)


@pytest.mark.parametrize("share", [0.2, 1.0, 5.0])
def test_slopes_are_finite_and_right(share):
    def place(damping):
        return free_motion(0.1, START, REST, MASS, damping, STIFFNESS)

    near = share * CRITICAL
    slope = float(jax.grad(place)(near))
    assert np.isfinite(slope)
    if share != 1:  # both sides of the critical damping meet there, each with its own slope to rounding
        assert slope == pytest.approx(float(place(near + 1e-3) - place(near - 1e-3)) / 2e-3, rel=1e-5)


def test_only_below_critical_damping_it_overshoots():
    for share in (0.3, 0.9, 1.1, 4.0):
        beyond = float(jnp.max(free_motion(TIME, START, REST, MASS, share * CRITICAL, STIFFNESS))) - REST
        assert (beyond > 1e-6 * (REST - START)) == (share < 1)


def test_a_bellringer_tells_how_each_element_grows_with_pressure():
    """Loads suddenly reduced at three pressures: B, K and F_ce affine in pressure are found from noisy positions."""
    pressures, truth = np.array([2e5, 3e5, 5e5]), np.array([80.0, 4e-4, 1500.0, 1.6e-2, 60.0, 2.0e-3])

    def swings(p):
        damping, stiffness, force = (affine(pressures, *p[k : k + 2]) for k in (0, 2, 4))
        before, after = (rest_position(mass * g, force, stiffness) for mass in (20.0, MASS))
        return jax.vmap(lambda *each: free_motion(TIME, each[0], each[1], MASS, each[2], each[3]))(
            before, after, damping, stiffness
        )

    noise = 5e-5
    seen = np.asarray(swings(truth)) + noise * np.random.default_rng(0).standard_normal((3, len(TIME)))
    found = least_squares(
        lambda share: np.ravel((np.asarray(swings(share * truth)) - seen) / noise), 1.3 * np.ones(6), x_scale="jac"
    )
    errors = np.sqrt(np.diag(np.linalg.inv(found.jac.T @ found.jac)))
    assert np.all(np.abs(found.x - 1) < 4 * errors)
    assert np.all(errors < 0.1)
