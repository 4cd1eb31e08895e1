"""Every law audited: what a cycle delivers is what its pressure supplied, and what rubber stores is given back."""

import jax.numpy as jnp
import numpy as np
import pytest
from equation_cases import LENGTH, angles, cones, moduli, radii, walls
from hypothesis import given
from hypothesis import strategies as st

from mckibben_jax.laws import braid, rubber, working_pressure

# Energy audit --------------------------------------------------------------------------------------------------------


def bore_volume(eps, radius, angle, wall):
    return jnp.pi * rubber.inner_radius(eps, radius, angle, wall) ** 2 * LENGTH * (1 - eps)


# Law (eps, P, radius, angle, wall, cone) and the volume its pressure fills, same arguments without P.
CONSERVATIVE = {
    "10": (
        lambda e, p, r, a, h, k: braid.ideal_force(e, p, r, a),
        lambda e, r, a, h, k: braid.cylinder_volume(e, LENGTH, r, a),
    ),
    "12": (
        lambda e, p, r, a, h, k: braid.ideal_force_schulte(braid.angle(e, a), p, r / jnp.sin(a)),
        lambda e, r, a, h, k: braid.cylinder_volume(e, LENGTH, r, a),
    ),
    "14": (
        lambda e, p, r, a, h, k: braid.ideal_force_gaylord(
            LENGTH * (1 - e), p, braid.cord_length(LENGTH, a), braid.turns(LENGTH, r, a)
        ),
        lambda e, r, a, h, k: braid.cylinder_volume(e, LENGTH, r, a),
    ),
    "25E": (
        lambda e, p, r, a, h, k: braid.cone_force(e, p, r, a, k),
        lambda e, r, a, h, k: braid.cone_cylinder_volume(e, LENGTH, r, a, k),
    ),
    # the pressure sees the bore; the wall's own energy returns after a cycle
    "32T": (
        lambda e, p, r, a, h, k: rubber.thick_wall_force(e, p, r, a, h, 1.2e5, 1e4),
        lambda e, r, a, h, k: bore_volume(e, r, a, h),
    ),
    "Liu": (
        lambda e, p, r, a, h, k: working_pressure.fibre_reinforced_force(e, p, r, a, h, 1.2e5, 1e4),
        lambda e, r, a, h, k: bore_volume(e, r, a, h),
    ),
}
UNSOUND = {
    "18": (
        lambda e, p, r, a, h, k: braid.real_force_printed(e, p, r, a, rubber.inner_radius(e, r, a, h)),
        CONSERVATIVE["32T"][1],
    ),
    "19": (lambda e, p, r, a, h, k: braid.real_force_thin_printed(e, p, r, a, h), CONSERVATIVE["10"][1]),
    "25": (lambda e, p, r, a, h, k: braid.cone_force_printed(e, p, r, a, k), CONSERVATIVE["25E"][1]),
}


def cycle(law, volume, *muscle, middle=0.09, half=0.07):
    """Work delivered and supplied over an ellipse in contraction and pressure: -oint F dl and oint P dV."""
    turn = 2 * np.pi * (np.arange(256) + 0.5) / 256
    eps, rate = middle - half * np.cos(turn), half * np.sin(turn)
    pressure = 2.5e5 + 1.5e5 * np.sin(turn)
    supplied = pressure * braid.slope(lambda e: volume(e, *muscle), eps) * rate
    return float(jnp.mean(law(eps, pressure, *muscle) * LENGTH * rate)), float(jnp.mean(supplied))


@pytest.mark.parametrize("name", CONSERVATIVE)
@given(angle=angles, radius=radii, wall=walls, cone=cones)
def test_a_cycle_delivers_the_work_of_the_pressure(name, angle, radius, wall, cone):
    delivered, supplied = cycle(*CONSERVATIVE[name], radius, angle, wall, cone)
    assert delivered == pytest.approx(supplied, rel=1e-9)


@pytest.mark.parametrize(("name", "sign"), [("18", -1), ("19", -1), ("25", 1)])
@given(angle=st.floats(np.radians(15), np.radians(25)), wall=st.floats(0.07, 0.3), cone=st.floats(0.2, 0.5))
def test_a_cycle_of_the_printed_laws_does_not(name, sign, angle, wall, cone):
    delivered, supplied = cycle(*UNSOUND[name], 0.01, angle, wall, cone)
    assert sign * (delivered / supplied - 1) > 0.01


@pytest.mark.parametrize(("angle", "cone", "ratio"), [(20, 0.5, 2.03), (20, 0.75, 2.87), (30, 1.0, 4.44)])
def test_printed_cones_create_work(angle, cone, ratio):
    angle = np.radians(angle)
    end = braid.largest_contraction(angle)
    work = braid.delivered_work(lambda e: braid.cone_force_printed(e, 1.0, 0.01, angle, cone), LENGTH, end)
    growth = jnp.diff(braid.cone_cylinder_volume(jnp.array([0.0, end]), LENGTH, 0.01, angle, cone))[0]
    assert float(work / growth) == pytest.approx(ratio, abs=0.005)


# Elastic laws as (force, energy per metre of rest length) of (eps, radius, angle, wall, c10, c01)
ELASTIC = {
    "28E": (
        lambda e, r, a, h, c10, c01: rubber.thin_elastic_force(e, r, a, h, 2 * c10),
        lambda e, r, a, h, c10, c01: thin_energy(e, r, a, h, 2 * c10),
    ),
    "32": (
        rubber.concise_elastic_force,
        lambda e, r, a, h, c10, c01: rubber.thin_wall_energy(
            braid.radius_ratio(e, a), 1 - e, rubber.wall_area(r, h), c10, c01
        ),
    ),
    "32T": (rubber.thick_elastic_force, lambda e, r, a, h, c10, c01: thick_energy(e, r, a, h, c10, c01)),
}


def thin_energy(eps, radius, angle, wall, modulus):
    hoop, area = rubber.thin_inner_stretch(eps, angle, wall), 2 * jnp.pi * radius**2 * wall * (1 - wall)
    return rubber.thin_wall_energy(hoop, 1 - eps, area, modulus / 2, 0.0)


def thick_energy(eps, radius, angle, wall, c10, c01):
    present = radius * braid.radius_ratio(eps, angle)
    return rubber.thick_wall_energy(present, 1 - eps, radius, radius * (1 - wall), radius, c10, c01)


@pytest.mark.parametrize("name", ELASTIC)
@given(angle=angles, radius=radii, wall=walls, c10=moduli, c01=moduli)
def test_elastic_work_is_the_stored_energy(name, angle, radius, wall, c10, c01):
    force, energy = ELASTIC[name]
    muscle = (radius, angle, wall, c10, c01)
    work = braid.delivered_work(lambda e: force(e, *muscle), 1.0, 0.2)
    assert float(-work) == pytest.approx(float(energy(0.2, *muscle) - energy(0.0, *muscle)), rel=1e-9)


@pytest.mark.parametrize(("angle", "share"), [(20, 0.047), (30, -0.039)])
def test_printed_axial_force_is_not_the_energy_of_its_rubber(angle, share):
    angle = np.radians(angle)
    end = braid.largest_contraction(angle)
    law = rubber.axial_elastic_force_printed
    work = braid.delivered_work(lambda e: law(e, 0.01, angle, 0.1, 0.54e6), 1.0, end)
    assert float(-work / thin_energy(end, 0.01, angle, 0.1, 0.54e6)) == pytest.approx(share, abs=5e-4)


@given(angle=angles, radius=radii, wall=walls, c10=moduli, c01=moduli)
def test_open_path_balances_pressure_and_rubber(angle, radius, wall, c10, c01):
    def pressure(eps):
        return 3e5 * (1 + jnp.sin(9 * eps))

    work = braid.delivered_work(
        lambda e: rubber.thick_wall_force(e, pressure(e), radius, angle, wall, c10, c01), LENGTH, 0.25
    )
    growth = braid.delivered_work(
        lambda e: pressure(e) * braid.slope(lambda x: bore_volume(x, radius, angle, wall), e), 1.0, 0.25
    )
    stored = LENGTH * thick_energy(0.25, radius, angle, wall, c10, c01)
    assert float(work) == pytest.approx(float(growth - stored), rel=1e-9)


@given(angle=angles, radius=radii, wall=walls, c10=moduli, c01=moduli)
def test_elastic_forces_vanish_at_rest(angle, radius, wall, c10, c01):
    size = radius**2 * wall * (c10 + c01) / np.tan(angle) ** 2
    for force, _ in ELASTIC.values():
        assert abs(float(force(0.0, radius, angle, wall, c10, c01))) < 1e-12 * size
    assert float(rubber.schulte_elastic_force(0.0, LENGTH, radius, angle, c10)) == 0
    assert float(working_pressure.minimum_pressure(0.0, angle, wall, c10, c01)) == 0
    printed = rubber.schulte_elastic_force_printed(0.0, LENGTH, radius, angle, c10)
    assert float(printed) == pytest.approx(2 * np.pi * c10 * radius * LENGTH)
    volume = float(rubber.wall_area(radius, wall)) * LENGTH
    left = rubber.concise_elastic_force_printed(0.0, angle, volume, c10, c01)
    assert float(left) == pytest.approx(-4 * c01 * volume / np.tan(angle) ** 2, rel=1e-6)
