"""Quantities of a design against closed forms, scipy and finite differences."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from designing import BAR, IDEAL, MUSCLE, RANGES, quantity
from scipy.integrate import quad, solve_ivp

from mckibben_jax.design.best import Task, quantities_of
from mckibben_jax.design.merit import QUANTITIES, built
from mckibben_jax.effects import (
    BladderNeoHookean,
    CoulombFriction,
    ForceOffset,
    IdealCylinder,
    Presliding,
    SeriesCompliance,
    Tip,
)  # fmt: skip
from mckibben_jax.laws import braid, gas, rubber


def test_quantities_are_the_laws():
    given, at = built(MUSCLE, (IdealCylinder(), BladderNeoHookean())), {"contraction": 0.1, "pressure": 3 * BAR}
    wall = (8e-3, float(MUSCLE.braid_angle), 1 / 8, 0.27e6, 0.0)
    law = jax.jit(lambda eps: rubber.thick_wall_force(eps, 3 * BAR, *wall))
    assert quantity("force", given, **at) == pytest.approx(float(law(0.1)), rel=1e-12)
    end = quantity("stroke", given, pressure=3 * BAR)
    assert float(law(end)) == pytest.approx(0, abs=1e-8)
    places = np.linspace(0, end, 4001)
    area = 0.3 * np.trapezoid(law(places), places)
    assert quantity("work", given, pressure=3 * BAR) == pytest.approx(area, rel=1e-6)
    slope = float(law(0.1001) - law(0.0999)) / 2e-4
    assert quantity("stiffness", given, **at) == pytest.approx(-slope / 0.3, rel=1e-6)
    bore = float(rubber.inner_radius(0.1, *wall[:3]))
    assert quantity("gas_volume", given, contraction=0.1) == pytest.approx(np.pi * bore**2 * 0.27, rel=1e-12)
    outside = 8e-3 * float(braid.radius_ratio(0.1, wall[1]))
    assert quantity("outer_radius", given, contraction=0.1) == pytest.approx(outside, rel=1e-12)


@pytest.mark.parametrize(
    ("effect", "stroke"),
    [(None, 1.0), (Tip(k=1.25), 0.8), (SeriesCompliance(k_s=1e5), 1.0), (CoulombFriction(), 1.0), (ForceOffset(), 1.0)],
    ids=str,
)
def test_any_effects_count(effect, stroke):
    """A tip shortens the stroke; a spring in series changes nothing where F = 0, nor what is lost or read."""
    given = built(MUSCLE, IDEAL if effect is None else (*IDEAL, effect))
    end = stroke * float(braid.largest_contraction(MUSCLE.braid_angle))
    assert quantity("stroke", given, pressure=3 * BAR) == pytest.approx(end, abs=1e-6)


def test_hysteresis_of_the_ideal_muscle_with_coulomb_friction():
    """Twice l0 f_s P int S d eps, S = 2 pi r0 l0/(rho (1 - eps)): int = sin a [arsech(1/sqrt 3) - arsech(cos a)]."""
    given = built(MUSCLE, (IdealCylinder(), CoulombFriction(f_s=0.02)))
    angle = float(MUSCLE.braid_angle)
    area = np.sin(angle) * (np.arccosh(1 / np.cos(angle)) - np.arccosh(np.sqrt(3))) * -1
    loss = 2 * 0.3 * 0.02 * 3 * BAR * 2 * np.pi * 8e-3 * 0.3 * area
    assert quantity("hysteresis_loss", given, pressure=3 * BAR) == pytest.approx(loss, rel=1e-10)
    assert quantity("hysteresis_loss", built(MUSCLE, IDEAL), pressure=3 * BAR) == 0


def test_what_remembers_does_not_change_a_slow_loop():
    plain, remembering = (built(MUSCLE, (IdealCylinder(), CoulombFriction(), *more)) for more in ((), (Presliding(),)))
    loss = quantity("hysteresis_loss", plain, pressure=3 * BAR)
    assert quantity("hysteresis_loss", remembering, pressure=3 * BAR) == pytest.approx(loss, rel=1e-12)


def test_efficiency_is_work_over_the_air_that_is_drawn():
    """The work of the ideal muscle is P dV; the air's by integrating v dp from the atmosphere for the mass drawn."""
    pressure, constant = 3 * BAR, 287.0 * 293.0
    present = pressure + 101325.0
    end = float(braid.largest_contraction(MUSCLE.braid_angle))
    full, rest = (float(braid.cylinder_volume(eps, 0.3, 8e-3, MUSCLE.braid_angle)) for eps in (end, 0.0))
    wall = np.pi * (8e-3**2 - 7e-3**2) * 0.3
    mass = (present * (full - wall) - 101325.0 * (rest - wall)) / constant
    energy = mass * quad(lambda p: constant / p, 101325.0, present)[0]
    expected = pressure * (full - rest) / energy
    assert quantity("efficiency", built(MUSCLE, IDEAL), pressure=pressure) == pytest.approx(expected, rel=1e-8)
    rubbing = built(MUSCLE, (IdealCylinder(), CoulombFriction(f_s=0.02)))
    lost = quantity("hysteresis_loss", rubbing, pressure=pressure) / 2
    assert quantity("efficiency", rubbing, pressure=pressure) == pytest.approx(expected - lost / energy, rel=1e-8)


@pytest.mark.parametrize("pressure", [0.5 * BAR, 5 * BAR])
def test_response_time_is_that_of_the_equation_of_filling(pressure):
    """Choked flow at 5 bar, then not; never choked at 0.5 bar. ISO 6358 integrated by scipy until 90 % are there."""
    supply, volume, conductance = pressure + 101325.0, 4e-5, 5e-9

    def rate(_, p):
        beyond = max(p[0] / supply - 0.3, 0) / 0.7
        return [conductance * supply * 1e5 * np.sqrt(max(1 - beyond**2, 0)) / volume]

    def filled(_, p):
        return p[0] - 101325.0 - 0.9 * pressure

    filled.terminal = True
    solved = solve_ivp(rate, (0, 10), [101325.0], events=filled, rtol=1e-10, atol=1e-3, max_step=5e-4)
    assert float(gas.filling_time(pressure, volume, conductance)) == pytest.approx(solved.t_events[0][0], rel=1e-7)
    given = built(MUSCLE, IDEAL)
    wide = quantity("response_time", given, pressure=pressure, conductance=conductance)
    narrow = quantity("response_time", given, pressure=pressure, conductance=conductance / 2, contraction=0.1)
    share = quantity("gas_volume", given, contraction=0.1) / quantity(
        "gas_volume", given, contraction=quantity("stroke", given, pressure=pressure)
    )
    assert narrow == pytest.approx(2 * share * wide, rel=1e-9)


@pytest.mark.parametrize("name", QUANTITIES)
def test_gradients_are_those_of_finite_differences(name):
    effects = (IdealCylinder(), BladderNeoHookean(), Tip(k=1.1), CoulombFriction())
    task = Task(MUSCLE, RANGES, name, {"contraction": 0.1, "pressure": 4 * BAR}, effects=effects)
    law = jax.jit(lambda v: quantities_of(task)(v)[0])
    at = np.array([np.radians(24.0), 8e-3, 1.1e-3])
    slopes = np.asarray(jax.jacfwd(law)(jnp.asarray(at)))
    for i in range(3):
        step = np.zeros(3)
        step[i] = 1e-5 * at[i]
        difference = (float(law(at + step)) - float(law(at - step))) / (2 * step[i])
        assert slopes[i] == pytest.approx(difference, rel=1e-6, abs=1e-6 * abs(float(law(at))) / at[i])
