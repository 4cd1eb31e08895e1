"""The equations under change: of units, and of each of their arguments."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from equation_cases import LENGTH, angles
from hypothesis import given
from hypothesis import strategies as st

from mckibben_jax.laws import biology, braid, rubber, textile, working_pressure

# Units ---------------------------------------------------------------------------------------------------------------

ONE, M, AREA, VOLUME, KG = (0, 0, 0), (0, 1, 0), (0, 2, 0), (0, 3, 0), (1, 0, 0)
PA, N, SPEED, ACCELERATION = (1, -1, -2), (1, 1, -2), (0, 1, -1), (0, 1, -2)
E, P, R, L, A, H = (0.1, ONE), (3e5, PA), (0.007, M), (0.3, M), (0.35, ONE), (0.1, ONE)
C10, C01, G = (1.2e5, PA), (1e4, PA), (0.54e6, PA)
F0 = (900.0, N)
# law, arguments as (value, dimension in mass, length, time), dimension of the result
DIMENSIONS = [
    (braid.ideal_force, (E, P, R, A), N),
    (braid.real_force_printed, (E, P, R, A, (0.009, M)), N),
    (braid.real_force_thin_printed, (E, P, R, A, H), N),
    (braid.cone_force, (E, P, R, A, (0.3, ONE)), N),
    (braid.cone_force_printed, (E, P, R, A, (0.3, ONE)), N),
    (braid.ideal_force_schulte, (A, P, R), N),
    (braid.ideal_force_gaylord, (L, P, (0.32, M), (2.5, ONE)), N),
    (braid.virtual_work, (F0, E, P, L, R, A), (1, 2, -2)),
    (braid.cylinder_volume, (E, L, R, A), VOLUME),
    (braid.cone_cylinder_volume, (E, L, R, A, (0.3, ONE)), VOLUME),
    (braid.reduced_length_volume, (E, L, R, A, (2.0, ONE)), VOLUME),
    (braid.contact_surface, (E, L, R, A), AREA),
    (rubber.thin_elastic_force, (E, R, A, H, G), N),
    (rubber.concise_elastic_force, (E, R, A, H, C10, C01), N),
    (rubber.thick_elastic_force, (E, R, A, H, C10, C01), N),
    (rubber.thick_wall_force, (E, P, R, A, H, C10, C01), N),
    (rubber.thick_wall_energy, ((0.009, M), (0.9, ONE), R, (0.006, M), (0.0075, M), C10, C01), N),
    (rubber.schulte_elastic_force, (E, L, R, A, (1e4, PA)), N),
    (rubber.schulte_elastic_force_printed, (E, L, R, A, (1e4, PA)), N),
    (rubber.axial_elastic_force_printed, (E, R, A, H, G), N),
    (rubber.concise_elastic_force_printed, (E, A, (1e-5, VOLUME), C10, C01), (1, 2, -2)),
    (rubber.inner_radius, (E, R, A, H), M),
    (working_pressure.minimum_pressure, (E, A, H, C10, C01), PA),
    (working_pressure.minimum_pressure_thin, (E, A, H, G), PA),
    (working_pressure.free_tube_pressure, ((1.4, ONE), H, G), PA),
    (working_pressure.burst_pressure, (E, A, H, (28e6, PA)), PA),
    (working_pressure.wall_axial_force, (E, P, R, A, H, C10, C01), N),
    (working_pressure.fibre_reinforced_force, (E, P, R, A, H, C10, C01), N),
    (textile.schulte_friction, (P, R, L, H), N),
    (textile.hertz_friction, (P, (0.013, AREA), H, (2e9, PA), (0.4, ONE)), N),
    (textile.crossing_friction, (P, R, A, (1e-4, M)), N),
    (textile.sphere_contact_radius, (P, (1e-3, M), (2e9, PA), (0.4, ONE)), M),
    (textile.cylinder_contact_area, (P, (1e-3, M), A, (2e9, PA), (0.4, ONE)), AREA),
    (textile.hertz_scale, (P, (2e9, PA), (0.4, ONE)), ONE),
    (textile.kinetic_factor, ((0.05, SPEED), (2.0, ONE), (0.1, SPEED)), ONE),
    (biology.hill_viscous_force, ((0.05, SPEED), F0, (100.0, N), (0.07, SPEED)), N),
    (biology.largest_velocity, (F0, (100.0, N), (0.07, SPEED)), SPEED),
    (
        biology.coulomb_acceleration,
        ((0.02, M), (0.1, SPEED), F0, (0.09, M), (40.0, N), (20.0, KG), (9.8, ACCELERATION)),
        ACCELERATION,
    ),
    (
        biology.voigt_acceleration,
        ((0.02, M), (0.1, SPEED), F0, (20.0, KG), (300.0, (1, 0, -1)), (3e3, (1, 0, -2)), (9.8, ACCELERATION)),
        ACCELERATION,
    ),
    (biology.release_velocity, ((200.0, N), F0, (0.09, M), (40.0, N), (20.0, KG)), SPEED),
]


@pytest.mark.parametrize(("law", "arguments", "result"), DIMENSIONS, ids=lambda x: getattr(x, "__name__", None))
def test_units_by_rescaling(law, arguments, result):
    units = np.array([3.7, 0.21, 1.9])

    def scaled(value, dimension):
        return value * np.prod(units ** np.array(dimension, dtype=float))

    before, after = float(law(*(value for value, _ in arguments))), float(law(*(scaled(*x) for x in arguments)))
    assert after == pytest.approx(scaled(before, result), rel=1e-9)


@pytest.mark.parametrize(("law", "arguments", "result"), DIMENSIONS, ids=lambda x: getattr(x, "__name__", None))
def test_slopes_in_every_argument_are_finite_at_rest_too(law, arguments, result):
    moving = [value for value, _ in arguments]
    resting = [0.0 if place in (E, P) else value for value, place in zip(moving, arguments, strict=True)]
    if law is textile.hertz_scale or law in (textile.sphere_contact_radius, textile.cylinder_contact_area):
        resting = moving  # contacts without pressure have no size to differentiate
    slope = jax.jit(jax.grad(law, argnums=tuple(range(len(moving)))))
    for values in (moving, resting):
        slopes = slope(*values)
        assert np.all(np.isfinite(slopes))


@given(angle=angles, eps=st.floats(0.0, 0.4), factor=st.floats(0.0, 3.0))
def test_reduced_length_takes_its_volume_from_the_cylinder(angle, eps, factor):
    r = 0.007 * float(braid.radius_ratio(eps, angle))
    lost = np.pi * r**2 * factor * (r - 0.007)
    whole = float(braid.cylinder_volume(eps, LENGTH, 0.007, angle))
    reduced = float(braid.reduced_length_volume(eps, LENGTH, 0.007, angle, factor))
    assert reduced == pytest.approx(whole - lost, rel=1e-12)


def test_textile_friction_is_homogeneous_in_its_own_constant():
    # C L^beta whatever the kilonewton inside: the same C and load in two writings
    for beta in (0.6, 0.7, 1.0):
        coefficient = 0.3 / float(textile.textile_constant(1.0, beta))
        assert float(textile.power_law_friction(40.0, coefficient, beta)) == pytest.approx(0.3 * 40.0**beta)


# Derivatives ---------------------------------------------------------------------------------------------------------

# law of one variable, and where it is awkward: rest, no pressure, no speed, the end of the stroke and beyond
STROKE_ENDS = (0.0, 1e-6, 0.1, 0.3855, 0.386, 0.5, -0.02)
SMOOTH = {
    "ideal": (lambda e: braid.ideal_force(e, 3e5, 0.007, 0.35), STROKE_ENDS),
    "radius": (lambda e: braid.radius_ratio(e, 0.35), STROKE_ENDS),
    "angle": (lambda e: braid.angle(e, 0.35), STROKE_ENDS),
    "cones": (lambda e: braid.cone_force(e, 3e5, 0.007, 0.35, 0.3), STROKE_ENDS),
    "reduced length": (lambda e: braid.reduced_length_volume(e, 0.3, 0.007, 0.35, 2.0), STROKE_ENDS),
    "contact": (lambda e: braid.contact_surface(e, 0.3, 0.007, 0.35), STROKE_ENDS),
    "thick": (lambda e: rubber.thick_elastic_force(e, 0.007, 0.35, 0.1, 1.2e5, 1e4), STROKE_ENDS),
    "thin": (lambda e: rubber.thin_elastic_force(e, 0.007, 0.35, 0.1, 0.54e6), STROKE_ENDS),
    "concise": (lambda e: rubber.concise_elastic_force(e, 0.007, 0.35, 0.1, 1.2e5, 1e4), STROKE_ENDS),
    "schulte": (lambda e: rubber.schulte_elastic_force(e, 0.3, 0.007, 0.35, 1e4), STROKE_ENDS),
    "axial printed": (lambda e: rubber.axial_elastic_force_printed(e, 0.007, 0.35, 0.1, 0.54e6), STROKE_ENDS),
    "filling": (lambda e: working_pressure.minimum_pressure(e, 0.35, 0.1, 1.2e5, 1e4), STROKE_ENDS),
    "ideal, pressure": (lambda p: braid.ideal_force(0.1, p, 0.007, 0.35), (0.0, 1e5)),
    "coulomb, pressure": (lambda p: textile.coulomb_friction(0.013 * p, 0.02), (0.0, 1e5)),
    "crossing, pressure": (lambda p: textile.crossing_friction(p, 0.007, 0.35, 1e-4), (0.0, 1e5)),
    "hertz, pressure": (lambda p: textile.hertz_friction(p, 0.013, 0.2, 2e9, 0.4), (1e2, 1e5)),
    "textile, pressure": (lambda p: textile.power_law_friction(0.013 * p, 0.02, 0.7), (1e2, 1e5)),
    "kinetic, speed": (lambda v: textile.kinetic_factor(v, 2.0, 0.1), (0.0, 0.05, -0.05)),
    "hill, speed": (lambda v: biology.hill_viscous_force(v, 900.0, 100.0, 0.07), (0.05, -0.05)),
}


@pytest.mark.parametrize("name", SMOOTH)
def test_gradients_equal_finite_differences(name):
    law, places = SMOOTH[name]
    at, law = np.array(places), jax.jit(law)
    step = 1e-6 * np.maximum(abs(at), 1.0)
    ahead, behind = law(at + step), law(at - step)
    slope = np.array(jax.jit(jax.vmap(jax.grad(law)))(at))
    noise = 2e-6 * np.maximum(abs(slope), abs(ahead) / np.maximum(abs(at), 1.0))
    assert np.all(abs(slope - (ahead - behind) / (2 * step)) <= noise + 1e-12), slope
    assert np.all(np.isfinite(jax.jit(jax.vmap(jax.grad(jax.grad(law))))(at)))


@pytest.mark.parametrize("exponent", [0.3, 0.7, 1.0, 1.3])
def test_gradients_without_load_are_finite(exponent):
    for argument in range(3):
        slope = jax.grad(textile.power_law_friction, argnums=argument)(0.0, 0.02, exponent)
        assert np.isfinite(float(slope))
    assert np.isfinite(float(jax.grad(lambda p: textile.hertz_friction(p, 0.013, 0.2, 2e9, 0.4))(0.0)))
    assert float(textile.power_law_friction(0.0, 0.02, exponent)) == 0


def test_hill_has_the_one_sided_slope_at_no_speed():
    slope = jax.grad(lambda v: biology.hill_viscous_force(v, 900.0, 100.0, 0.07))(0.0)
    assert float(slope) == pytest.approx(1000.0 / 0.07)


@pytest.mark.parametrize(
    "name", ["ideal", "radius", "angle", "cones", "contact", "thick", "thin", "concise", "schulte", "filling"]
)
def test_derivatives_are_finite_even_where_there_is_no_cylinder(name):
    law, at = SMOOTH[name][0], np.array([-0.2, -0.0642, -0.05, 0.0, 0.6, 0.9])
    assert np.all(np.isfinite(jax.jit(law)(at)))
    assert np.all(np.isfinite(jax.jit(jax.vmap(jax.grad(law)))(at)))


@pytest.mark.parametrize("name", SMOOTH)
def test_same_alone_in_a_batch_and_compiled(name):
    law, places = SMOOTH[name]
    places = jnp.array(places)
    compiled = jax.jit(law)
    alone = np.array([compiled(x) for x in places])
    for batch in (law(places), jax.vmap(law)(places), compiled(places)):
        np.testing.assert_allclose(batch, alone, rtol=1e-10, atol=1e-12)


def test_a_root_carries_its_derivative():
    def stroke(angle):
        return braid.zero_between(lambda e: braid.ideal_force(e, 1e5, 0.007, angle), 0.01, 0.6)

    exact = jax.grad(braid.largest_contraction)(0.35)
    assert float(jax.grad(stroke)(0.35)) == pytest.approx(float(exact), rel=1e-9)


def test_nothing_needs_64_bit():
    with jax.enable_x64(False):
        force = rubber.thick_wall_force(jnp.float32(0.1), 3e5, 0.007, 0.35, 0.1, 1.2e5, 1e4)
        assert force.dtype == jnp.float32
        assert np.isfinite(force)
