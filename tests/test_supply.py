"""What lies between the pressure that was set and the muscle, against ISO 6358's formulas and scipy's solve_ivp."""

import benches
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from stick_slip import G, Truth

from mckibben_jax.effects import (
    SUPPLIES,
    CoulombFriction,
    IdealCylinder,
    LiquidLine,
    SupplyDelay,
    SupplyLag,
    SupplyOrifice,
    Tip,
    ViscousDamping,
)
from mckibben_jax.laws import valve
from mckibben_jax.memory import remember
from mckibben_jax.model import model
from mckibben_jax.motion import motion
from mckibben_jax.muscle import Muscle
from mckibben_jax.parameter import parameters
from mckibben_jax.state import State

ATM = 101325.0
TRUTH = Truth(damping=100.0)
MUSCLE = Muscle(TRUTH.length, TRUTH.radius, TRUTH.angle)
TIMES = np.linspace(0, 0.6, 301)
FILLED = jax.jit(valve.filled)


def states(times, contraction, pressure) -> State:
    time = jnp.asarray(times, dtype=float)
    wide = (jnp.broadcast_to(jnp.asarray(a, dtype=float), time.shape) for a in (contraction, pressure))
    zero = jnp.zeros_like(time)
    return State(*wide, zero, zero, zero, zero, time)


def factor(ratio, critical):
    """ISO 6358-1:2013, eqs for choked and subsonic flow."""
    return 1.0 if ratio <= critical else np.sqrt(1 - ((ratio - critical) / (1 - critical)) ** 2)


# Flow ----------------------------------------------------------------------------------------------------------------


def test_flow_is_that_of_the_standard():
    ratios = np.array([0.0, 0.1, 0.3, 0.31, 0.5, 0.9, 0.99])
    expected = [factor(r, 0.3) for r in ratios]
    np.testing.assert_allclose(valve.flow_factor(ratios, 0.3), expected, rtol=1e-12)
    choked = valve.mass_flow(7e5, 1e5, 1e-8, 0.3)  # 1 dm3/(s bar) at 7 bar: 7 dm3/s of reference air
    np.testing.assert_allclose(choked, 7e-3 * 1.185, rtol=1e-12)
    assert valve.flow_factor(1.0, 0.3) == 0


@pytest.mark.parametrize("critical", [0.15, 0.3, 0.5])
@pytest.mark.parametrize(("first", "port"), [(1e5, 7e5), (5e5, 7e5), (7e5, 1e5), (3e5, 2e5)])
def test_a_volume_fills_and_empties_as_scipy_says(critical, first, port):
    """In strides of 0.02, longer than a solver of motion takes; emptying below the speed of sound is second order."""

    def rate(_, p):
        high, low = max(port, p[0]), min(port, p[0])
        return [np.sign(port - p[0]) * high * factor(low / high, critical)]

    stop = lambda _, p: abs(p[0] / port - 1) - 2e-3  # noqa: E731
    stop.terminal = True
    whole = solve_ivp(rate, (0, 4), [first], rtol=1e-10, atol=1e-3, events=stop, dense_output=True, max_step=0.01)
    pressure, allowed = jnp.asarray(first), 2e-5 if port > first else 1e-4
    for stride in np.arange(0.02, whole.t[-1], 0.02):
        pressure = FILLED(pressure, port, 0.02, critical)
        assert abs(float(pressure) - whole.sol(stride)[0]) < allowed * abs(port - first)


def test_filling_is_exact_in_one_stride_however_long():
    port, critical = 7e5, 0.3
    choked = valve.filled(1e5, port, 0.1, critical)
    np.testing.assert_allclose(choked, 1.7e5, rtol=1e-12)
    subsonic = valve.filled(0.3 * port, port, 0.4, critical)
    np.testing.assert_allclose(subsonic, port * (0.3 + 0.7 * np.sin(0.4 / 0.7)), rtol=1e-12)
    assert abs(valve.filled(1e5, port, 50.0, critical) / port - 1) < 1e-12


def test_slopes_are_finite_where_nothing_flows_and_where_everything_does():
    slopes = jax.grad(valve.filled, argnums=(0, 1, 2, 3))
    for first, port, stride in [(2e5, 2e5, 0.1), (1.0, 7e5, 0.0), (7e5, 1.0, 9.0), (2e5, 2e5 + 1e-6, 0.0)]:
        assert np.isfinite(slopes(*(jnp.asarray(a) for a in (first, port, stride, 0.3)))).all()


# The effects ---------------------------------------------------------------------------------------------------------


def test_a_held_muscle_fills_choked_in_the_time_that_the_formula_says():
    """V (p2 - p1)/(n C p0 p_port): constant volume, choked all the way."""
    orifice = SupplyOrifice(C=1e-9, b=0.5, n=1.3, V_d=2e-5)
    volume = TRUTH.volume(0.1) + 2e-5
    second = 3.0e5  # of 7 bar absolute: choked
    duration = volume * (second - 1.5e5) / (1.3 * 1e-9 * 1e5 * 7e5)
    times = np.array([0.0, 1e-9, duration])
    run = states(times, 0.1, np.array([1.5e5 - ATM, 7e5 - ATM, 7e5 - ATM]))
    filled = remember(orifice, MUSCLE, run)
    np.testing.assert_allclose(filled[-1] + ATM, second, rtol=1e-6)


def test_a_closed_valve_leaves_a_polytropic_spring():
    orifice = SupplyOrifice(C=1e-10, b=0.3, n=1.4, V_d=0.0)
    run = states(np.linspace(0, 1e-6, 200), np.linspace(0, 0.1, 200), 3e5)
    squeezed = np.asarray(remember(orifice, MUSCLE, run))[-1] + ATM
    expected = (3e5 + ATM) * (TRUTH.volume(0.0) / TRUTH.volume(0.1)) ** 1.4
    np.testing.assert_allclose(squeezed, expected, rtol=1e-6)


def reference(rates, first, port, times=TIMES, load=10 * G):
    """A damped muscle on a supply whose state is its pressure (absolute); `port` a function of time."""

    def slopes(t, y):
        eps, rate, p = y
        drag = TRUTH.damping * rate * TRUTH.length
        acceleration = (TRUTH.pull(eps, p - ATM) - drag - load) / (load / G * TRUTH.length)
        growth = (TRUTH.volume(eps + 1e-6) - TRUTH.volume(eps - 1e-6)) / 2e-6 * rate
        return [rate, acceleration, rates(p, port(t), TRUTH.volume(eps), growth)]

    run = solve_ivp(slopes, (0, times[-1]), first, method="Radau", rtol=1e-9, atol=1e-11, t_eval=times, max_step=2e-3)
    return run.y[0]


def test_a_step_through_a_valve_moves_the_muscle_as_radau_says():
    c, b, n, dead = 3e-9, 0.3, 1.3, 3e-5

    def rates(p, port, volume, growth):
        high, low = max(port, p), min(port, p)
        flow = np.sign(port - p) * c * 1e5 * high * factor(low / high, b)
        return n * (flow - p * growth) / (volume + dead)

    rise = lambda t: np.interp(t, [0.0, TIMES[1]], [2e5, 5e5])  # noqa: E731
    expected = reference(rates, [0.05, 0.0, 2e5 + ATM], lambda t: rise(t) + ATM)
    given = model(MUSCLE, IdealCylinder(), ViscousDamping(TRUTH.damping), SupplyOrifice(c, b, n, dead))
    found = motion.step_response(given, load=10 * G, pressure=rise(TIMES), times=TIMES, start=0.05, step=1.5e-4)
    assert np.ptp(expected) > 0.1
    assert TRUTH.length * np.abs(np.asarray(found) - expected).max() < 2e-5


def test_a_liquid_line_damps_as_its_resistance_says():
    resistance = 2e9

    def slopes(t, y):
        eps, rate = y
        growth = (TRUTH.volume(eps + 1e-6) - TRUTH.volume(eps - 1e-6)) / 2e-6 * rate
        drag = TRUTH.damping * rate * TRUTH.length
        pull = TRUTH.pull(eps, 3e5 - resistance * growth)
        return [rate, (pull - drag - 10 * G) / (10 * TRUTH.length)]

    run = solve_ivp(slopes, (0, TIMES[-1]), [0.0, 0.0], method="Radau", rtol=1e-9, atol=1e-11, t_eval=TIMES)
    given = model(MUSCLE, IdealCylinder(), ViscousDamping(TRUTH.damping), LiquidLine(resistance))
    found = motion.release(given, load=10 * G, pressure=3e5, times=TIMES)
    assert TRUTH.length * np.abs(np.asarray(found) - run.y[0]).max() < 1e-5


def test_a_dead_time_shifts_the_step():
    rise, tau = np.array([0.0, 0.1, 0.12, 0.6]), 0.04
    given = model(MUSCLE, IdealCylinder(), CoulombFriction(0.01), SupplyDelay(tau))
    plain = model(MUSCLE, IdealCylinder(), CoulombFriction(0.01))
    pressure = lambda shift: np.interp(TIMES - shift, rise, [1.5e5, 1.5e5, 4e5, 4e5])  # noqa: E731
    late, early = (
        np.asarray(motion.step_response(m, load=100.0, pressure=pressure(s), times=TIMES, start=0.22))
        for m, s in ((given, 0.0), (plain, tau))
    )
    np.testing.assert_allclose(late, early, atol=1e-6)


def test_a_dead_time_delays_the_force_of_a_held_muscle():
    ramp = states(np.linspace(0, 1, 101), 0.1, np.linspace(1e5, 3e5, 101))
    late = model(MUSCLE, IdealCylinder(), SupplyDelay(0.2)).force(ramp)
    np.testing.assert_allclose(late[20:], model(MUSCLE, IdealCylinder()).force(ramp)[:-20], rtol=1e-12)


@pytest.mark.parametrize("kind", SUPPLIES)
def test_what_is_declared(kind):
    assert kind.source
    assert kind.suspect
    assert kind.on_request
    for p in parameters(kind):
        assert p.meaning
        assert all(p.lower <= value <= p.upper for value in (p.default, *p.starts))


@pytest.mark.parametrize("kind", SUPPLIES)
def test_absent_with_its_switch_at_zero_and_its_slopes_are_those_of_differences(kind):
    port = np.interp(TIMES, [0.0, 0.05, 0.07, 0.6], [1.5e5, 1.5e5, 4e5, 4e5])
    value = parameters(kind)[0].default * 1.3137  # no whole number of steps: a delayed corner has two slopes there

    @jax.jit
    def both(vector):
        def run(vector):
            effect = kind(**{parameters(kind)[0].name: vector[0]})
            given = model(MUSCLE, IdealCylinder(), ViscousDamping(TRUTH.damping), effect)
            switches = jnp.array([vector[1] if type(e) is kind else 1.0 for e in given.effects])
            given = type(given)(given.muscle, given.effects, switches)
            return motion.step_response(given, load=100.0, pressure=port, times=TIMES, start=0.2, step=1e-3)

        return run(vector), jax.jacfwd(run)(vector)[:, 0]

    at = lambda x, switch=1.0: both(jnp.array([x, switch]))  # noqa: E731
    without, unseen = at(value, 0.0)
    np.testing.assert_allclose(without, at(value * 1.7, 0.0)[0], atol=1e-14)
    assert not np.any(unseen)
    difference = (at(value * (1 + 1e-5))[0] - at(value * (1 - 1e-5))[0]) / (2e-5 * value)
    assert np.abs(at(value)[0] - without).max() > 1e-3
    np.testing.assert_allclose(at(value)[1], difference, atol=2e-3 * np.abs(difference).max())


def test_what_a_valve_lets_through_changes_at_the_rate_that_it_says():
    """Against differences along a smooth run at a constant speed, as closely as its steps follow the flow."""
    time = np.linspace(0.0, 1.0, 16001)
    run = benches.run(time, 0.05 + 0.05 * time, 3e5 + 1e5 * np.cos(2 * np.pi * time))
    felt = model(MUSCLE, SupplyOrifice(), IdealCylinder()).felt(run)
    expected = np.gradient(felt.pressure, time)[400:-1]
    assert np.abs(expected).max() > 1e5
    np.testing.assert_allclose(felt.pressure_rate[400:-1], expected, rtol=0, atol=1e-2 * np.abs(expected).max())


def test_a_valve_acts_behind_the_gauge_and_before_the_braid():
    whole = model(MUSCLE, Tip(), SupplyOrifice(), IdealCylinder(), SupplyDelay())
    assert whole.names == ("supply_orifice", "tip", "ideal_cylinder", "supply_delay")
    assert whole.add(SupplyLag()).names == ("supply_lag", "tip", "ideal_cylinder", "supply_delay")
