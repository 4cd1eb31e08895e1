"""Effects that remember, against closed forms and scipy."""

import itertools
from io import StringIO

import benches
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from rich.console import Console
from scipy.integrate import solve_ivp

from fitting.report.text.catalogue import effect_report
from mckibben_jax.effect import name_of
from mckibben_jax.effects import LIBRARY, Creep, MaxwellSlip, Mullins, Presliding, SupplyLag
from mckibben_jax.memory import Memory, follow, remember
from mckibben_jax.state import State

LENGTH = float(benches.MUSCLE.length)


def states(time, contraction, pressure=0.0) -> State:
    """A run whose rates do not matter."""
    time = np.asarray(time, dtype=float)
    contraction, pressure = (np.broadcast_to(a, time.shape) for a in (contraction, pressure))
    return benches.run(time, contraction, pressure, rate=0 * time)


def remembered(effect, run) -> np.ndarray:
    """The memory of an effect at every sample."""
    return np.asarray(remember(effect, benches.MUSCLE, run))


def solved(law, span, start: float, *args) -> float:
    """The solution of a scalar differential equation at the end of a span, by scipy."""
    return solve_ivp(law, span, [start], args=args, rtol=1e-11, atol=1e-11).y[0, -1]


@pytest.mark.parametrize("kind", LIBRARY, ids=name_of)
def test_where_a_memory_begins_is_said(kind):
    shown = StringIO()
    Console(file=shown, width=200).print(*effect_report(kind))
    said = "fresh with the first sample" in shown.getvalue()
    assert said == issubclass(kind, Memory)


REMEMBERING = [kind for kind in LIBRARY if issubclass(kind, Memory)]


@pytest.mark.parametrize("kind", REMEMBERING, ids=name_of)
def test_a_new_run_begins_a_new_memory(kind):
    """Two runs one behind another, where the time goes back, are remembered as each by itself."""
    time = np.linspace(0.0, 3.0, 31)
    first, second = 0.2 - 0.05 * np.cos(2 * time), 0.05 + 0.04 * np.sin(3 * time)
    pressures = 1e5 + 5e4 * time, 4e5 - 6e4 * time
    both = states(np.tile(time, 2), np.concatenate([first, second]), np.concatenate(pressures))
    each = [remembered(kind(), states(time, *run)) for run in zip((first, second), pressures, strict=True)]
    np.testing.assert_allclose(remembered(kind(), both), np.concatenate(each), rtol=1e-12, atol=1e-12)
    went_on = remembered(kind(), both.replace(time=jnp.arange(62) * 0.1))
    assert np.max(np.abs(went_on[31:] - each[1])) > 1e-6 * np.max(np.abs(each[1]))


# First order -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("steps", [1e-8, 1e-5, 0.99e-4, 1.01e-4, 1e-2, 1.0, 30.0, 1e5])
def test_follow_is_the_ramp_response(steps):
    """From rest along x = s, over `steps` time constants: y = s - (1 - exp(-s)), by its series where that cancels."""
    series = steps**2 / 2 - steps**3 / 6 + steps**4 / 24
    expected = series if steps < 1e-2 else steps + np.expm1(-steps)
    found = follow(jnp.asarray(0.0), jnp.asarray(0.0), jnp.asarray(steps), jnp.asarray(steps))
    np.testing.assert_allclose(found, expected, rtol=3e-9)


def test_follow_stands_without_time_and_arrives_after_long():
    memory, before, after = jnp.asarray(3.0), jnp.asarray(1.0), jnp.asarray(2.0)
    assert follow(memory, before, before, jnp.asarray(0.0)) == 3.0
    np.testing.assert_allclose(follow(memory, before, after, jnp.asarray(1e9)), 2.0, rtol=1e-8)


@pytest.mark.parametrize("steps", [0.0, 1e-9, 1e-4, 1.0, 1e6])
def test_follow_has_finite_slopes_at_any_step(steps):
    slopes = jax.grad(follow, argnums=(0, 1, 2, 3))(*(jnp.asarray(a) for a in (3.0, 1.0, 2.0, steps)))
    assert np.isfinite(slopes).all()


def test_follow_agrees_with_scipy_along_a_crooked_path_with_uneven_steps():
    random = np.random.default_rng(3)
    time = np.concatenate([[0.0], np.cumsum(random.exponential(0.3, 20))])
    port, tau = random.uniform(0, 5e5, 21), 0.4
    found = remembered(SupplyLag(tau=tau), states(time, 0.1, port))
    y = port[0]
    for i in range(20):
        ends = time[i : i + 2]
        ramp = (ends, port[i : i + 2])
        y = solved(lambda t, y, *ramp: (np.interp(t, *ramp) - y) / tau, ends, y, *ramp)
        np.testing.assert_allclose(found[i + 1], y, rtol=1e-7)


def test_creep_is_the_standard_linear_solid():
    """Branch force after a ramp of duration T and during the hold: K v tau (1 - e^(-T/tau)) e^(-(t - T)/tau)."""
    stiffness, tau, speed, ramp = 700.0, 2.0, 0.05, 0.5
    creep = Creep(K1=stiffness, tau=tau)
    time = np.array([0.0, 0.2, 0.5, 1.0, 3.0, 20.0])
    contraction = np.minimum(time, ramp) * speed / LENGTH
    branch = stiffness * (LENGTH * contraction - remembered(creep, states(time, contraction)))
    full = stiffness * speed * tau * (1 - np.exp(-np.minimum(time, ramp) / tau))
    np.testing.assert_allclose(branch, full * np.exp(-np.maximum(time - ramp, 0) / tau), rtol=1e-10, atol=1e-12)


# Friction that turns --------------------------------------------------------------------------------------------------


def test_presliding_is_dahls_law():
    """dz/dx = (1 - sgn(dx) z)/x_s by scipy, out, back and out again; and its closed form on the first branch."""
    reach, turns = 2e-3, np.array([0.0, 5e-3, 3e-3, 4e-3, -2e-3])
    path = np.concatenate([np.linspace(a, b, 7)[:-1] for a, b in itertools.pairwise(turns)] + [turns[-1:]])
    found = remembered(Presliding(x_s=reach), states(np.arange(len(path)), path / LENGTH))
    np.testing.assert_allclose(found[:7], 1 - np.exp(-path[:7] / reach), atol=1e-12)
    z = 0.0
    for i in range(1, len(path)):
        moved = path[i] - path[i - 1]
        z = solved(lambda _, z, sign: (sign - z) / reach, (0, abs(moved)), z, np.sign(moved))
        np.testing.assert_allclose(found[i], z, atol=1e-8)


SLIP = MaxwellSlip(x_s=2e-3, spread=3.0)
REACHES = 2e-3 * 3.0 ** ((2 * np.arange(4) - 3) / 3)


def virgin(distance: np.ndarray) -> np.ndarray:
    """Direction after a first distance from rest: every element rises and then slips."""
    return np.mean(np.minimum(distance[:, None] / REACHES, 1.0), axis=1)


def slip(path) -> np.ndarray:
    """Direction along a path by Maxwell slip."""
    path = np.asarray(path)
    return remembered(SLIP, states(np.arange(len(path)), path / LENGTH)).mean(axis=-1)


def test_maxwell_slip_rises_along_its_virgin_curve():
    distance = np.linspace(0, 8e-3, 30)
    np.testing.assert_allclose(slip(distance), virgin(distance), atol=1e-12)


def test_maxwell_slip_turns_along_twice_the_virgin_curve():
    """Masing's rule: after a reversal from full slip, z = 1 - 2 virgin(d/2)."""
    back = np.linspace(0, 15e-3, 40)
    np.testing.assert_allclose(slip([0.0, *(0.02 - back)])[1:], 1 - 2 * virgin(back / 2), atol=1e-12)


def test_maxwell_slip_returns_to_where_a_nested_loop_left_and_dahl_does_not():
    nested = [0.0, 0.02, 0.017, 0.018, 0.017, 0.015]
    plain = [0.0, 0.02, 0.017, 0.015]
    np.testing.assert_allclose(slip(nested)[4:], slip(plain)[2:], atol=1e-12)
    dahl = Presliding(x_s=2e-3)
    ends = [remembered(dahl, states(np.arange(len(p)), np.array(p) / LENGTH))[-1] for p in (nested, plain)]
    assert abs(ends[0] - ends[1]) > 1e-3


# The largest so far --------------------------------------------------------------------------------------------------


def test_mullins_remembers_the_largest_contraction():
    contraction = np.random.default_rng(0).uniform(0, 0.25, 50)
    top = remembered(Mullins(), states(np.arange(50), contraction))
    np.testing.assert_array_equal(top, np.maximum.accumulate(contraction))
