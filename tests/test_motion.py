"""Muscles that move, against integrations that stop at every event (`stick_slip.py`), and what must hold besides."""

import dataclasses
from functools import partial

import diffrax as dfx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from stick_slip import G, Truth, constant, moved, straight_between

from mckibben_jax.effects import (
    CoulombFriction,
    Creep,
    IdealCylinder,
    KineticFriction,
    Presliding,
    SeriesCompliance,
    SupplyLag,
    Tip,
    ViscousDamping,
)
from mckibben_jax.model import Model, model
from mckibben_jax.motion import motion
from mckibben_jax.motion.friction_step import push
from mckibben_jax.muscle import Muscle
from mckibben_jax.state import State

pytestmark = pytest.mark.filterwarnings("error")

PRESSURE = 5e5
RAYON = Truth(f_s=0.02, ratio=7.0)
IRON = Truth(f_s=0.012, ratio=1.25)
TIMES = np.linspace(0, 1, 201)


def muscle(truth=RAYON, **measured):
    return Muscle(truth.length, truth.radius, truth.angle, **measured)


def rubbing(truth, *more):
    return model(
        muscle(truth), IdealCylinder(), CoulombFriction(truth.f_s), KineticFriction(truth.ratio, truth.v_s), *more
    )


def released(truth, load, *more, times=TIMES, **how):
    return np.asarray(motion.release(rubbing(truth, *more), load=load, pressure=PRESSURE, times=times, **how))


def error(truth, load, step):
    """Largest error, m."""
    expected = moved(truth, TIMES, load, constant(PRESSURE))
    return truth.length * np.abs(released(truth, load, step=step) - expected).max()


@pytest.mark.parametrize(
    ("truth", "mass", "allowed"), [(RAYON, 5, 3e-7), (RAYON, 20, 3e-8), (IRON, 5, 2.5e-6), (IRON, 20, 6e-7)]
)
def test_release_is_as_accurate_as_a_measurement(truth, mass, allowed):
    assert error(truth, mass * G, 2.5e-4) < allowed


@pytest.mark.parametrize(("truth", "mass"), [(RAYON, 20), (IRON, 20), (IRON, 40)])
def test_second_order(truth, mass):
    assert error(truth, mass * G, 1e-3) / error(truth, mass * G, 2.5e-4) > 11


@pytest.mark.parametrize(("driving", "friction", "drag"), [(-5.0, 20.0, 0.0), (-30.0, 20.0, 0.0), (-5.0, 20.0, 40.0)])
def test_a_stop_inside_a_step_is_exact(driving, friction, drag):
    speed, step = 0.1, 0.01
    end = push(lambda u, s: driving - friction * s - drag * u, jnp.array(speed), jnp.array(step))
    slowing = friction - driving
    stop = np.log1p(drag * speed / slowing) / drag if drag else speed / slowing
    way = (speed - slowing * stop) / drag if drag else speed * stop / 2
    back = min(driving + friction, 0.0)  # friction holds unless it is weaker than what drives
    np.testing.assert_allclose(end.speed, back * (step - stop), rtol=1e-9, atol=1e-15)
    np.testing.assert_allclose(end.way, way + back * (step - stop) ** 2 / 2, rtol=1e-6)


def test_the_cases_above_reverse_and_stick():
    phases = []
    moved(IRON, TIMES, 20 * G, constant(PRESSURE), segments=phases)
    signs = [sign for _, sign in phases]
    assert signs[:3] == [1, -1, 1]
    assert signs[-1] is None


@pytest.mark.parametrize(("truth", "mass", "allowed"), [(RAYON, 20, 1e-4), (RAYON, 5, 1e-4), (IRON, 20, 1e-3)])
def test_jacobian(truth, mass, allowed):
    names = ("f_s", "ratio", "v_s", "angle", "radius")
    values = np.array([getattr(truth, name) for name in names])

    def reference(vector):
        given = dataclasses.replace(truth, **dict(zip(names, vector, strict=True)))
        return moved(given, TIMES, mass * G, constant(PRESSURE))

    found = np.asarray(_jacobian(jnp.asarray(values), mass * G))
    for column, value in enumerate(values):
        change = np.zeros(len(values))
        change[column] = 1e-4 * value
        expected = (reference(values + change) - reference(values - change)) / (2e-4 * value)
        assert np.abs(found[:, column] - expected).max() < allowed * np.abs(expected).max(), names[column]


def test_a_hold_does_not_drift():
    times = np.linspace(0, 10, 101)
    held = released(IRON, 20 * G, times=times, step=1e-3)
    assert np.ptp(held[20:]) < 1e-14


def test_a_muscle_within_its_friction_never_moves():
    pull = RAYON.pull(0.1, PRESSURE)
    size = RAYON.friction(0.1, 0.0, PRESSURE)
    for load in (pull - 0.999 * size, pull + 0.999 * size):
        assert np.ptp(released(RAYON, load, start=0.1) - 0.1) < 1e-15
    for load, sign in ((pull - 1.001 * size, 1), (pull + 1.001 * size, -1)):
        assert sign * (released(RAYON, load, start=0.1)[-1] - 0.1) > 1e-5


def test_energy_balance():
    load = 20 * G
    times = np.linspace(0, 1, 8001)
    run = _moved(rubbing(IRON), load, PRESSURE, times, steps=8000)
    eps, rate = np.asarray(run.contraction), np.asarray(run.rate)
    gas = PRESSURE * (IRON.volume(eps) - IRON.volume(0.0))
    stored = load * IRON.length * eps + 0.5 * (load / G) * (IRON.length * rate) ** 2
    rubbed = IRON.friction(eps, rate, PRESSURE) * np.abs(rate) * IRON.length
    lost = np.concatenate([[0.0], np.cumsum((rubbed[1:] + rubbed[:-1]) / 2 * np.diff(times))])
    assert lost[-1] > 10
    np.testing.assert_allclose(gas - stored, lost, atol=2e-4 * lost[-1])


def test_creep_is_carried_along():
    truth = dataclasses.replace(RAYON, creep=2000.0, tau=0.3)
    times = np.linspace(0, 3, 301)
    expected = moved(truth, times, 10 * G, constant(PRESSURE))
    found = released(truth, 10 * G, Creep(2000.0, 0.3), times=times)
    assert expected[-1] - expected[60] > 1e-2  # it goes on creeping, sliding and sticking
    assert truth.length * np.abs(found - expected).max() < 1e-5


def test_presliding_is_carried_along():
    truth = dataclasses.replace(IRON, ratio=1.0, x_s=2e-3)
    times = np.linspace(0, 0.4, 81)
    expected = moved(truth, times, 20 * G, constant(PRESSURE))
    found = released(truth, 20 * G, Presliding(2e-3), times=times)
    assert truth.length * np.abs(found - expected).max() < 2e-5


def test_pressure_up_and_down_under_a_load():
    corners, values = np.array([0.0, 0.5, 0.8, 1.3]), np.array([0.5e5, 4e5, 4e5, 1.5e5])
    times = np.linspace(0, 1.3, 261)
    phases = []
    expected = moved(IRON, times, 10 * G, straight_between(corners, values), segments=phases)
    pressure = np.interp(times, corners, values)
    found = motion.step_response(rubbing(IRON), load=10 * G, pressure=pressure, times=times)
    assert {sign for _, sign in phases} == {1, -1, None}
    assert IRON.length * np.abs(np.asarray(found) - expected).max() < 2e-5


def test_pressure_at_the_port_reaches_the_muscle_late():
    tau, times = 0.05, np.linspace(0, 1, 201)
    port = np.where(times > 0, 4e5, 1e5)
    first = times[1]

    def inside(t):  # tau dP/dt = port - P for a port that rises over the first sample interval
        rise = 3e5 / first
        early = 1e5 + rise * (t - tau * (1 - np.exp(-t / tau)))
        late = 4e5 - rise * tau * (1 - np.exp(-first / tau)) * np.exp(-(t - first) / tau)
        return early if t < first else late

    inside.kinks = (first,)
    truth = dataclasses.replace(IRON, damping=50.0)
    expected = moved(truth, times, 10 * G, inside)
    given = rubbing(truth, SupplyLag(tau), ViscousDamping(50.0))
    found = motion.step_response(given, load=10 * G, pressure=port, times=times)
    assert truth.length * np.abs(np.asarray(found) - expected).max() < 1e-5


def test_a_general_method_agrees_where_there_is_no_dry_friction():
    smooth = model(muscle(), IdealCylinder(), ViscousDamping(100.0), Tip(1.1))
    splitting = _moved(smooth, 100.0, PRESSURE, TIMES, steps=4000)
    general = _moved(smooth, 100.0, PRESSURE, TIMES, steps=4000, solver=dfx.Tsit5())
    np.testing.assert_allclose(splitting.contraction, general.contraction, atol=3e-6)


def test_the_step_serves_diffrax_as_any_other():
    imposed = tuple(jnp.asarray(value) for value in (PRESSURE, 200.0, 200.0 / G))
    rig = motion._rig(rubbing(RAYON), jnp.asarray(TIMES), imposed, jnp.zeros(()), 1000, 1000)
    solution = dfx.diffeqsolve(
        dfx.ODETerm(lambda k, y, rig: rig.change(k, y)),
        motion.StickSlip(),
        t0=0.0,
        t1=1000.0,
        dt0=1.0,
        y0=motion._at_rest(rig, jnp.zeros(())),
        args=rig,
        saveat=dfx.SaveAt(ts=jnp.array([10.3, 100.7, 800.0])),
        adjoint=dfx.ForwardMode(),
    )
    times = np.array([0.0, 0.0103, 0.1007, 0.8, 1.0])
    expected = _moved(rubbing(RAYON), 200.0, PRESSURE, times, steps=1000).contraction[1:4]
    np.testing.assert_allclose(solution.ys.contraction, expected, atol=1e-12)


def test_samples_between_steps_are_as_good_as_those_at_steps():
    given, fine = rubbing(RAYON), np.linspace(0, 1, 4001)
    between = _moved(given, 200.0, PRESSURE, fine, steps=1000)
    expected = moved(RAYON, fine, 200.0, constant(PRESSURE))
    at_steps = np.abs(between.contraction[::4] - expected[::4]).max()
    assert np.abs(between.contraction - expected).max() < 1.5 * at_steps


def test_runs_together_are_runs_alone():
    given, steps = rubbing(IRON), 1000
    loads, ends = jnp.array([50.0, 150.0, 300.0]), jnp.array([1.0, 0.5, 0.8])
    states = jax.vmap(lambda end: _states(jnp.asarray(TIMES) * end, PRESSURE))(ends)
    run = jax.jit(motion.released, static_argnames="steps")
    together = jax.vmap(lambda s, w: run(given, s, w, 0.0, steps=steps))(states, loads)
    for i, load in enumerate(loads):
        alone = run(given, jax.tree.map(lambda a, i=i: a[i], states), load, 0.0, steps=steps)
        np.testing.assert_allclose(together[i], alone, atol=1e-12)


def test_repeated_times_do_no_harm():
    given = rubbing(RAYON)
    padded = np.concatenate([TIMES, np.full(30, TIMES[-1])])
    run = lambda times: _moved(given, 200.0, PRESSURE, times, steps=1000, since=0.0)  # noqa: E731
    np.testing.assert_allclose(run(padded).contraction[:201], run(TIMES).contraction, atol=1e-14)
    nowhere = jax.jacfwd(
        lambda load: (_moved(given, load, PRESSURE, np.zeros(5), steps=10).contraction,) * 2, has_aux=True
    )
    slope, value = nowhere(9.0)
    assert np.all(value == 0)
    assert np.all(slope == 0)


def test_before_the_release_the_muscle_is_held():
    times = np.linspace(-0.1, 0.5, 61)
    found = released(RAYON, 200.0, times=times, start=0.05)
    assert np.ptp(found[times <= 0] - 0.05) < 1e-15
    np.testing.assert_allclose(found[10:], released(RAYON, 200.0, times=times[10:], start=0.05), atol=1e-12)


def test_far_outside_everything_stays_finite():
    def run(vector, load):
        rubbed = CoulombFriction(vector[0]), KineticFriction(vector[1], vector[2])
        found = _moved(model(muscle(), IdealCylinder(), *rubbed, Tip()), load, PRESSURE, TIMES, steps=500)
        return found.contraction, found.finite

    at, loads = jnp.array([0.02, 0.3, 1e-3]), jnp.array([0.0, 20.0, 3e3, 2e4])
    slopes, finite = jax.vmap(lambda load: jax.jacfwd(run, has_aux=True)(at, load))(loads)
    assert np.all(finite)
    assert np.all(np.isfinite(slopes))


def test_straight_strands_do_not_stretch():
    run = _moved(model(muscle(), IdealCylinder()), 2e4, PRESSURE, TIMES, steps=500)
    np.testing.assert_allclose(run.contraction[-1], 1 - 1 / np.cos(RAYON.angle), rtol=1e-12)
    assert run.rate[-1] == 0


def test_numbers_that_are_none_are_told():
    run = _moved(rubbing(RAYON), 200.0, np.where(TIMES < 0.5, PRESSURE, np.nan), TIMES, steps=500)
    assert not run.finite
    assert np.all(np.isfinite(run.contraction))


def test_an_absent_effect_is_absent():
    whole = rubbing(IRON, Creep(500.0, 1.0), SupplyLag(0.1))
    kept = np.array([name in ("ideal_cylinder", "coulomb_friction") for name in whole.names])
    bare = model(muscle(IRON), IdealCylinder(), CoulombFriction(IRON.f_s))
    expected = _moved(bare, 200.0, PRESSURE, TIMES, steps=500).contraction
    off = Model(whole.muscle, whole.effects, jnp.asarray(kept, dtype=float))
    dead = Model(whole.muscle, whole.effects, jnp.ones(len(kept)), jnp.asarray(kept))
    for given in (off, dead):
        np.testing.assert_allclose(_moved(given, 200.0, PRESSURE, TIMES, steps=500).contraction, expected, atol=1e-12)


def test_fittings_that_give_way_move_a_sticking_muscle():
    stuck = model(muscle(), IdealCylinder(), CoulombFriction(0.2), SeriesCompliance(1e5))
    pressure = np.linspace(3e5, 3.5e5, 201)
    run = _moved(stuck, 800.0, pressure, TIMES, steps=500, start=0.05)
    felt = jax.vmap(lambda c, p: stuck.felt_now(State(c, p), (None,) * 3))(run.contraction, jnp.asarray(pressure))
    assert np.ptp(run.contraction) > 1e-4
    assert np.ptp(felt.contraction) < 0.02 * np.ptp(run.contraction)


def test_a_mass_may_be_told_from_its_load():
    free = Truth()
    expected = moved(free, TIMES, 300.0, constant(PRESSURE), mass=4.0)
    found = motion.release(
        model(muscle(free), IdealCylinder()), load=300.0, mass=4.0, pressure=PRESSURE, times=TIMES, step=1e-4
    )
    assert free.length * np.abs(np.asarray(found) - expected).max() < 1e-4
    heavier = model(muscle(free, moving_mass=4.0 - 300.0 / G), IdealCylinder())
    np.testing.assert_allclose(
        motion.release(heavier, load=300.0, pressure=PRESSURE, times=TIMES, step=1e-4), found, atol=1e-12
    )


@jax.jit
@partial(jax.jacfwd, argnums=0)
def _jacobian(vector, load):
    f_s, ratio, v_s, angle, radius = vector
    given = model(
        Muscle(RAYON.length, radius, angle), IdealCylinder(), CoulombFriction(f_s), KineticFriction(ratio, v_s)
    )
    return motion.release(given, load=load, pressure=PRESSURE, times=TIMES)


def _states(times, pressure):
    times = jnp.asarray(times)
    return State(jnp.zeros_like(times), jnp.broadcast_to(jnp.asarray(pressure), times.shape), time=times)


def _moved(given, load, pressure, times, *, steps, start=0.0, **how):
    return motion.moved(given, _states(times, pressure), load, start, steps=steps, **how)
