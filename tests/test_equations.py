"""The equations against each other, against their limits, and against textbooks."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from equation_cases import LENGTH, angles, cones, moduli, nodes, radii, walls, weights
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy import constants

from mckibben_jax.laws import biology, braid, rubber, textile, working_pressure

# Identities ----------------------------------------------------------------------------------------------------------


@given(angle=angles, radius=radii, eps=st.floats(-0.02, 0.5), pressure=st.floats(1e4, 8e5))
def test_the_ideal_law_in_all_its_forms(angle, radius, eps, pressure):
    ideal = float(braid.ideal_force(eps, pressure, radius, angle))
    size = np.pi * radius**2 * pressure / np.tan(angle) ** 2
    others = [
        braid.force_from_radius(lambda e: braid.radius_ratio(e, angle), eps, pressure, radius),
        braid.force_from_volume(lambda e: braid.cylinder_volume(e, LENGTH, radius, angle), eps, pressure, LENGTH),
        braid.tip_force(eps / 1.3, pressure, radius, angle, 1.3),
        braid.cone_force(eps, pressure, radius, angle, 0.0),
        braid.real_force_printed(eps, pressure, radius, angle, radius * braid.radius_ratio(eps, angle)),
        braid.real_force_thin_printed(eps, pressure, radius, angle, 0.0),
    ]
    np.testing.assert_allclose(np.array(others), ideal, atol=1e-12 * size, rtol=0)
    left = braid.virtual_work(ideal, eps, pressure, LENGTH, radius, angle)
    assert abs(float(left)) < 1e-11 * size * LENGTH


@given(angle=angles, eps=st.floats(0.0, 0.4))
def test_angle_radius_and_length_are_those_of_one_triangle(angle, eps):
    present = braid.angle(eps, angle)
    assert float(jnp.sin(present) / jnp.sin(angle)) == pytest.approx(float(braid.radius_ratio(eps, angle)), rel=1e-12)
    assert float(jnp.cos(present)) == pytest.approx(float(braid.cos_angle(eps, angle)), rel=1e-12)
    assert float(jnp.tan(present)) == pytest.approx(float(braid.tan_angle(eps, angle)), rel=1e-12)
    surface = braid.contact_surface(eps, LENGTH, 0.007, angle)
    flat = 2 * jnp.pi * 0.007 * LENGTH * braid.rhombus_area(1.0, present) / braid.rhombus_area(1.0, angle)
    assert float(surface) == pytest.approx(float(flat), rel=1e-12)


@given(angle=angles, eps=st.floats(0.0, 0.3), cone=cones)
def test_corrected_cones_add_what_the_printed_ones_leave_out(angle, eps, cone):
    r = float(braid.radius_ratio(eps, angle))
    missing = -np.pi * (r**2 - 1) - 2 / 3 * np.pi * cone * (2 * r + 1) * (r - 1)
    printed = float(braid.cone_force_printed(eps, 1.0, 1.0, angle, cone))
    assert float(braid.cone_force(eps, 1.0, 1.0, angle, cone)) == pytest.approx(printed + missing, abs=1e-11)


@given(angle=angles, eps=st.floats(0.0, 0.4))
def test_printed_cones_of_no_length_are_not_the_cylinder(angle, eps):
    # the push of the pressure on the annulus around the fitting is missing whatever the cones
    excess = braid.cone_force_printed(eps, 1.0, 1.0, angle, 0.0) - braid.ideal_force(eps, 1.0, 1.0, angle)
    assert float(excess) == pytest.approx(np.pi * (float(braid.radius_ratio(eps, angle)) ** 2 - 1), abs=1e-11)


@given(angle=angles, cone=cones, share=st.floats(0.01, 1.0))
def test_cones_always_pull_less_than_the_cylinder(angle, cone, share):
    eps = share * min(1 / (1 + 2 * cone), 0.5)
    assert braid.cone_force(eps, 1.0, 1.0, angle, cone) < braid.ideal_force(eps, 1.0, 1.0, angle)


@given(angle=angles, eps=st.floats(0.0, 0.4), wall=walls, c10=moduli, c01=moduli)
def test_concise_force_is_the_printed_one_corrected(angle, eps, wall, c10, c01):
    x, c, area = 1 - eps, 1 / np.tan(angle) ** 2, float(rubber.wall_area(0.01, wall))
    printed = float(rubber.concise_elastic_force_printed(eps, angle, area * LENGTH, c10, c01))
    expected = printed / LENGTH + area * c01 * 4 * c * x / (1 + c * (1 - x**2)) ** 2
    corrected = float(rubber.concise_elastic_force(eps, 0.01, angle, wall, c10, c01))
    assert corrected == pytest.approx(expected, rel=1e-9, abs=1e-9 * area * (c10 + c01) * c)


@given(angle=angles, eps=st.floats(0.0, 0.4), wall=walls)
def test_printed_axial_force_is_the_formula_of_28(angle, eps, wall):
    l1, x = float(rubber.thin_inner_stretch(eps, angle, wall)), 1 - eps
    bracket = (1 - 1 / (l1**2 * x**4)) * (1 / l1**2 + 2 * (1 - wall) * x / wall)
    expected = -np.pi * (0.01 * wall) ** 2 * 0.54e6 * bracket
    assert float(rubber.axial_elastic_force_printed(eps, 0.01, angle, wall, 0.54e6)) == pytest.approx(
        expected, rel=1e-8, abs=1e-8
    )


# The thick wall ------------------------------------------------------------------------------------------------------


def energy_by_quadrature(braid_radius, axial, rest, inner, outer, c10, c01):
    middle, half = (outer + inner) / 2, (outer - inner) / 2
    big = middle + half * nodes
    hoop = jnp.sqrt((big**2 + axial * braid_radius**2 - rest**2) / axial) / big
    return jnp.sum(half * weights * rubber.mooney_rivlin_energy(hoop, axial, c10, c01) * 2 * jnp.pi * big)


@given(
    inner=st.floats(0.4, 0.95), outer=st.floats(1.0, 1.4), wide=st.floats(0.95, 2.0), axial=st.floats(0.6, 1.1),
    c10=moduli, c01=moduli,
)  # fmt: skip
def test_wall_energy_is_the_integral_braid_embedded_or_not(inner, outer, wide, axial, c10, c01):
    wall = (wide, axial, 1.0, inner, outer, c10, c01)
    assume(axial * wide**2 - 1 + inner**2 > 0.1)
    assert float(rubber.thick_wall_energy(*wall)) == pytest.approx(float(energy_by_quadrature(*wall)), rel=1e-9)


@given(inner=st.floats(0.4, 0.9), wide=st.floats(1.0, 2.0), axial=st.floats(0.6, 1.0), c10=moduli, c01=moduli)
def test_wall_energy_of_two_layers_adds_up(inner, wide, axial, c10, c01):
    assume(axial * wide**2 - 1 + inner**2 > 0.1)

    def layer(start, end):
        return float(rubber.thick_wall_energy(wide, axial, 1.0, start, end, c10, c01))

    assert layer(inner, 1.2) == pytest.approx(layer(inner, 1.0) + layer(1.0, 1.2), rel=1e-10)


def test_wall_energy_is_exact_to_second_order_at_rest():
    def closed(eps, wall, law):
        return law(braid.radius_ratio(eps, 0.35), 1 - eps, 1.0, 1.0 - wall, 1.0, 1.2e5, 1e4)

    second = jax.grad(jax.grad(closed))
    for law in (jax.grad(closed), second, jax.jacfwd(second)):
        law = jax.jit(law, static_argnums=2)
        for wall in (1e-3, 0.07, 0.3):
            exact = float(law(0.0, wall, energy_by_quadrature))
            assert float(law(0.0, wall, rubber.thick_wall_energy)) == pytest.approx(exact, rel=1e-9, abs=1e-6)


@given(angle=angles, eps=st.floats(0.0, 0.4), wall=walls, c10=moduli, c01=moduli)
def test_filling_pressure_is_the_slope_of_the_wall_energy(angle, eps, wall, c10, c01):
    # at a held length the braid's radius grows by dr: P_min 2 pi r l dr = dE
    wide, axial = braid.radius_ratio(eps, angle), 1 - eps
    slope = jax.grad(rubber.thick_wall_energy)(wide, axial, 1.0, 1.0 - wall, 1.0, c10, c01)
    direct = working_pressure.minimum_pressure(eps, angle, wall, c10, c01)
    assert float(direct) == pytest.approx(float(slope / (2 * jnp.pi * wide * axial)), rel=1e-9, abs=1e-9 * (c10 + c01))


@given(angle=angles, eps=st.floats(0.0, 0.4), wall=walls, c10=moduli, c01=moduli)
def test_filling_pressure_in_its_usual_form(angle, eps, wall, c10, c01):
    r, lz, bore = float(braid.radius_ratio(eps, angle)), 1 - eps, 1 - wall
    inner = float(rubber.inner_radius(eps, 1.0, angle, wall))
    k = bore**2 - lz * inner**2
    bracket = (np.log(1 / bore) - np.log(r / inner)) / lz + k / (2 * lz**2) * (1 / r**2 - 1 / inner**2)
    direct = float(working_pressure.minimum_pressure(eps, angle, wall, c10, c01))
    assert direct == pytest.approx(2 * (c10 + c01 * lz**2) * bracket, rel=1e-8, abs=1e-8 * (c10 + c01))


@given(angle=angles, eps=st.floats(0.0, 0.4), wall=walls, c10=moduli, c01=moduli, pressure=st.floats(0.0, 6e5))
def test_balance_of_stresses_gives_the_force_of_energy(angle, eps, wall, c10, c01, pressure):
    # the assumptions of Liu and Rahn lead to 32T
    muscle = (0.01, angle, wall, c10, c01)
    energy = float(rubber.thick_wall_force(eps, pressure, *muscle))
    stresses = float(working_pressure.fibre_reinforced_force(eps, pressure, *muscle))
    assert stresses == pytest.approx(energy, rel=1e-9, abs=1e-9 * (pressure + c10 + c01) * 1e-3)
    radial, _, _ = working_pressure.wall_stresses(0.01, eps, pressure, *muscle)
    left = float(working_pressure.minimum_pressure(eps, angle, wall, c10, c01)) - pressure
    assert float(radial) == pytest.approx(left, rel=1e-9, abs=1e-3)


def test_stresses_balance_at_every_radius():
    muscle = (0.1, 3e5, 0.01, 0.35, 0.3, 1.2e5, 1e4)

    def present(big):
        k = (1 - 0.1) * (0.01 * braid.radius_ratio(0.1, 0.35)) ** 2 - 0.01**2
        return jnp.sqrt((big**2 + k) / (1 - 0.1))

    big = np.linspace(0.0072, 0.0098, 7)
    radial, hoop, _ = working_pressure.wall_stresses(big, *muscle)
    growth = braid.slope(lambda x: working_pressure.wall_stresses(x, *muscle)[0], big) / braid.slope(present, big)
    np.testing.assert_allclose(growth, (hoop - radial) / present(big), rtol=1e-9)


@pytest.mark.parametrize(
    ("tip", "strokes"), [(1.0, (0.2614, 0.3242, 0.3448, 0.3612)), (1.25, (0.2091, 0.2594, 0.2759, 0.2890))]
)
def test_rubber_explains_the_short_stroke_at_low_pressure(tip, strokes):
    @jax.jit
    def stroke(pressure):
        def pull(eps):
            return rubber.thick_wall_force(tip * eps, pressure, 0.007, np.radians(20), 0.07, 0.27e6, 0.0)

        return braid.zero_between(pull, 0.05, 0.5)

    found = [float(stroke(pressure)) for pressure in (1e5, 2e5, 3e5, 5e5)]
    assert found == pytest.approx(strokes, abs=6e-5)


# Rest and limits -----------------------------------------------------------------------------------------------------


@given(angle=angles, eps=st.floats(0.0, 0.35))
def test_laws_of_a_wall_become_those_without_one(angle, eps):
    wall = 1e-7
    ideal = float(braid.ideal_force(eps, 1.0, 1.0, angle))
    bore = rubber.inner_radius(eps, 1.0, angle, wall)
    size = 1e-5 / np.tan(angle) ** 2
    assert float(braid.real_force_printed(eps, 1.0, 1.0, angle, bore)) == pytest.approx(ideal, abs=size)
    assert float(braid.real_force_thin_printed(eps, 1.0, 1.0, angle, wall)) == pytest.approx(ideal, abs=size)


@given(angle=angles, eps=st.floats(0.02, 0.35))
def test_thick_walls_become_thin_ones(angle, eps):
    wall, c10 = 1e-6, 0.27e6
    thick = float(working_pressure.minimum_pressure(eps, angle, wall, c10, 0.0))
    assert thick == pytest.approx(float(working_pressure.minimum_pressure_thin(eps, angle, wall, 2 * c10)), rel=1e-4)
    thick = float(rubber.thick_elastic_force(eps, 0.01, angle, wall, c10, 0.0))
    assert thick == pytest.approx(float(rubber.thin_elastic_force(eps, 0.01, angle, wall, 2 * c10)), rel=1e-4)
    assert thick == pytest.approx(float(rubber.concise_elastic_force(eps, 0.01, angle, wall, c10, 0.0)), rel=1e-4)


def test_only_the_corrected_filling_pressure_is_a_limit():
    angle, wall = np.radians(30), 1e-4
    end, norm = braid.largest_contraction(angle), (1 - wall) / wall
    exact = working_pressure.minimum_pressure(end, angle, wall, 0.5, 0.0)
    corrected = working_pressure.minimum_pressure_thin(end, angle, wall, 1.0)
    printed = working_pressure.minimum_pressure_thin_printed(end, angle, wall, 1.0)
    found = [float(norm * pressure) for pressure in (exact, corrected, printed)]
    assert found == pytest.approx([1.02538, 1.02547, 1.18365], abs=1e-5)


@given(hoop=st.floats(0.5, 3.0), axial=st.floats(0.5, 2.0), modulus=moduli)
def test_stresses_of_mooney_without_c01_are_those_of_treloar(hoop, axial, modulus):
    mooney = rubber.mooney_rivlin_stresses(hoop, axial, modulus / 2, 0.0)
    np.testing.assert_allclose(mooney, rubber.treloar_stresses(hoop, axial, 1 / (hoop * axial), modulus), rtol=1e-12)
    np.testing.assert_allclose(mooney, rubber.thin_wall_stresses(hoop, axial, modulus), rtol=1e-12)


@given(hoop=st.floats(0.5, 3.0), axial=st.floats(0.5, 2.0), c10=moduli, c01=moduli)
def test_stresses_are_slopes_of_the_energy(hoop, axial, c10, c01):
    # true stress of an incompressible solid: stretch times slope of W at the other stretch held
    slopes = jax.grad(rubber.mooney_rivlin_energy, argnums=(0, 1))(hoop, axial, c10, c01)
    stresses = rubber.mooney_rivlin_stresses(hoop, axial, c10, c01)
    np.testing.assert_allclose(stresses, [hoop * slopes[0], axial * slopes[1]], rtol=1e-9, atol=1e-9 * (c10 + c01))
    series = rubber.rivlin_energy(hoop, axial, [[0.0, c01], [c10, 0.0]])
    energy = float(rubber.mooney_rivlin_energy(hoop, axial, c10, c01))
    assert float(series) == pytest.approx(energy, rel=1e-12, abs=1e-9)


def test_small_strain_modulus():
    # simple tension of incompressible rubber: E = 3 G
    def tension(stretch):
        return (
            rubber.mooney_rivlin_stresses(stretch**-0.5, stretch, 1.2e5, 1e4)[1]
            - (rubber.mooney_rivlin_stresses(stretch**-0.5, stretch, 1.2e5, 1e4)[0])
        )

    assert float(jax.grad(tension)(1.0)) == pytest.approx(3 * float(rubber.shear_modulus(1.2e5, 1e4)))


def test_hardness_of_the_review():
    np.testing.assert_allclose(rubber.shear_modulus_of_hardness([45, 65]), [0.54e6, 1.37e6])
    assert np.all(np.diff(rubber.shear_modulus_of_hardness(np.linspace(30, 75, 40))) > 0)


# Free tubes, friction, Hill ------------------------------------------------------------------------------------------


@given(hoop=st.floats(1.0, 4.0))
def test_free_tube_has_half_the_hoop_stress_along(hoop):
    hoop_stress, axial_stress = rubber.thin_wall_stresses(hoop, working_pressure.free_tube_axial_stretch(hoop), 1.0)
    assert float(axial_stress) == pytest.approx(float(hoop_stress) / 2, abs=1e-10)


def test_only_the_free_tube_balloons():
    hoop = np.linspace(1.0, 6.0, 200)
    assert np.all(np.diff(working_pressure.held_tube_pressure(hoop, 0.1, 1e6)) > 0)
    peak = hoop[np.argmax(working_pressure.free_tube_pressure(hoop, 0.1, 1e6))]
    assert peak == pytest.approx(float(working_pressure.ballooning_stretch()), abs=0.03)


@given(pressure=st.floats(1e3, 1e6), coefficient=st.floats(0.005, 0.3))
def test_powers_of_friction(pressure, coefficient):
    surface = 0.013

    def exponent(law):
        return float(jax.grad(lambda x: jnp.log(law(jnp.exp(x))))(jnp.log(pressure)))

    assert exponent(lambda p: textile.coulomb_friction(surface * p, coefficient)) == pytest.approx(1)
    assert exponent(lambda p: textile.hertz_friction(p, surface, coefficient, 2e9, 0.4)) == pytest.approx(4 / 3)
    assert exponent(lambda p: textile.power_law_friction(surface * p, coefficient, 0.7)) == pytest.approx(0.7)
    assert exponent(lambda p: textile.sphere_contact_area(p, 1e-3, 2e9, 0.4)) == pytest.approx(2 / 3)
    assert exponent(lambda p: textile.cylinder_contact_area(p, 1e-3, 0.4, 2e9, 0.4)) == pytest.approx(1 / 2)


@given(load=st.floats(0.0, 2e4), coefficient=st.floats(0.005, 0.3))
def test_textile_friction_of_exponent_one_is_coulomb(load, coefficient):
    textile_friction = float(textile.power_law_friction(load, coefficient, 1.0))
    assert textile_friction == pytest.approx(float(textile.coulomb_friction(load, coefficient)), rel=1e-12)


@given(angle=angles, eps=st.floats(0.0, 0.4), pressure=st.floats(1e3, 8e5))
def test_crossing_friction_is_the_work_of_turning_discs(angle, eps, pressure):
    # (2/3) mu N R_c per crossing, N summing to pi r l P, through twice the change of the braid angle
    mu_radius, radius = 0.3e-3, 0.007 * float(braid.radius_ratio(eps, angle))
    moment = 2 / 3 * mu_radius * np.pi * radius * LENGTH * (1 - eps) * pressure
    turning = 2 * float(braid.slope(lambda e: braid.angle(e, angle), eps)) / LENGTH
    force = textile.crossing_friction(pressure, radius, braid.angle(eps, angle), mu_radius)
    assert float(force) == pytest.approx(moment * turning, rel=1e-9)


def test_what_nobody_holds_falls_as_the_standard_says():
    assert float(biology.lifted_acceleration(0.0, 3.0)) == -constants.g
    assert float(biology.voigt_acceleration(0.0, 0.0, 0.0, 3.0, 1.0, 1.0)) == -constants.g


def test_a_bore_that_would_close_stays_open_by_a_hair():
    """What is open stays as it is; else the squared bore that is left is positive and a millionth of that at rest."""
    at_rest = 4e-5
    assert float(rubber.open_bore(-0.5 * at_rest, at_rest)) == -0.5 * at_rest
    for much in (1.0, 1.5, 40.0):
        assert 0 < float(rubber.open_bore(-much * at_rest, at_rest)) + at_rest < 2e-6 * at_rest


def test_hertz_contact_of_two_crossing_spheres_of_textbooks():
    # 3 F R/(4 E') with R = D/4 and E' = E/(2 (1 - nu^2))
    force, width, modulus = 2e5 * 1e-6, 1e-3, textile.hertz_modulus(2e9, 0.4)
    textbook = (3 * force * width / 4 / (4 * modulus)) ** (1 / 3)
    assert float(textile.sphere_contact_radius(2e5, width, 2e9, 0.4)) == pytest.approx(float(textbook), rel=1e-12)


def test_contact_of_parallel_cylinders_of_textbooks():
    """Johnson 1985, eq 4.43: b^2 = 4 q R/(pi E*), 1/E* = 2 (1 - nu^2)/E, 1/R = 1/R1 + 1/R2; strands of radius D/2."""
    width, angle, stiffness = 1e-3, 0.4, 2e9 / (2 * (1 - 0.4**2))
    line = width / np.sin(angle)
    for_each_length = 2e5 * width**2 / np.sin(2 * angle) / line
    half = np.sqrt(4 * for_each_length * (width / 4) / (np.pi * stiffness))
    found = textile.cylinder_contact_area(2e5, width, angle, 2e9, 0.4)
    assert float(found) == pytest.approx(2 * half * line, rel=1e-12)
    assert float(textile.cylinder_contact_area(2e5, width, np.pi / 2 - angle, 2e9, 0.4)) == pytest.approx(float(found))


@given(speed=st.floats(-1.0, 1.0), ratio=st.floats(0.2, 8.0))
def test_kinetic_friction_is_the_same_both_ways(speed, ratio):
    assert float(textile.kinetic_factor(speed, ratio, 0.1)) == float(textile.kinetic_factor(-speed, ratio, 0.1))
    bounds = sorted((1.0, ratio))
    assert bounds[0] - 1e-12 <= float(textile.kinetic_factor(speed, ratio, 0.1)) <= bounds[1] + 1e-12


@given(velocity=st.floats(0.0, 0.6), force=st.floats(50, 2000), curvature=st.floats(0.05, 1.0))
def test_hill_in_its_three_forms(velocity, force, curvature):
    a, b = curvature * force, curvature * 0.6
    pull = float(biology.hill_force(velocity, force, a, b))
    assert (pull + a) * velocity == pytest.approx((force - pull) * b, abs=1e-9 * force)
    assert float(biology.largest_velocity(force, a, b)) == pytest.approx(0.6)
    assert 0.6 * float(biology.hill_velocity_ratio(pull / force, curvature)) == pytest.approx(velocity, abs=1e-9)
    assert float(biology.hill_viscous_force(-velocity, force, a, b)) == 0


@pytest.mark.parametrize(("ratio", "misfit"), [(7.0, 0.022), (2.0, 0.096)])
def test_only_strongly_rising_friction_looks_like_hill(ratio, misfit):
    speed = np.linspace(0, 1, 200)
    hill = np.array(biology.hill_viscous_force(speed, 1.0, 0.12, 0.12))
    residues = []
    for scale in np.linspace(0.05, 1.0, 400):
        shape = np.array(textile.kinetic_factor(speed, ratio, scale))
        residues.append(np.sqrt(np.mean((hill - shape * (shape @ hill) / (shape @ shape)) ** 2)))
    assert min(residues) == pytest.approx(misfit, abs=5e-4)
