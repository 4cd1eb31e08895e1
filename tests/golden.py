"""From the name of a quantity in golden.json to the public function that gives it."""

import inspect
from collections.abc import Callable
from math import radians

import jax
import jax.numpy as jnp

from mckibben_jax.laws import biology, braid, rubber, textile, working_pressure

# One function per quantity; its arguments are the inputs it uses, by the names they have in golden.json
# (a0 stands for alpha0_deg in radians, ri for the present radius of the bore by exact incompressibility).
QUANTITIES: dict[str, Callable] = {
    # braid: kinematics and extremes
    "eps_max_ideal": lambda a0: braid.largest_contraction(a0),
    "alpha_max_deg": lambda: jnp.rad2deg(braid.largest_angle()),
    "r_max": lambda r0, a0: braid.largest_radius(r0, a0),
    "B_cord_length": lambda l0, a0: braid.cord_length(l0, a0),
    "N_turns": lambda l0, r0, a0: braid.turns(l0, r0, a0),
    "k_c_max": lambda a0: braid.largest_cone_ratio(a0),
    "eps_at_45deg": lambda a0: braid.contraction_at_45_degrees(a0),
    "alpha_deg": lambda eps, a0: jnp.rad2deg(braid.angle(eps, a0)),
    "f_radius_ratio": lambda eps, a0: braid.radius_ratio(eps, a0),
    "r_over_l_check": lambda eps, l0, r0, a0: network_shape(eps, l0, r0, a0),
    "S_contact": lambda eps, l0, r0, a0: braid.contact_surface(eps, l0, r0, a0),
    "f_over_fc": lambda alpha_deg: braid.axial_share(jnp.deg2rad(alpha_deg)),
    # braid: pressure forces
    "F_ideal_cyl": lambda eps, P, r0, a0: braid.ideal_force(eps, P, r0, a0),
    "F_ideal_schulte": lambda eps, P, r0, a0: braid.ideal_force_schulte(braid.angle(eps, a0), P, r0 / jnp.sin(a0)),
    "F_ideal_gaylord": lambda eps, P, l0, r0, a0: braid.ideal_force_gaylord(
        l0 * (1 - eps), P, braid.cord_length(l0, a0), braid.turns(l0, r0, a0)
    ),
    "F_ideal_from_f": lambda eps, P, r0, a0: braid.force_from_radius(lambda e: braid.radius_ratio(e, a0), eps, P, r0),
    "F_ideal_k_eps": lambda eps, P, r0, a0, k: braid.tip_force(eps, P, r0, a0, k),
    "F_cyl_braid": lambda eps, P, r0, a0, ri: braid.braid_force(eps, P, r0, a0, ri),
    "F_real_cyl_exact_ri": lambda eps, P, r0, a0, ri: braid.real_force_printed(eps, P, r0, a0, ri),
    "F_real_cyl_thin_ri": lambda eps, P, r0, a0, h0: braid.real_force_printed(
        eps, P, r0, a0, rubber.inner_radius_thin(eps, r0, a0, h0)
    ),
    "F_real_cyl_thin": lambda eps, P, r0, a0, h0: braid.real_force_thin_printed(eps, P, r0, a0, h0),
    "F_real_cyl_max": lambda P, r0, a0, h0: braid.real_force_thin_printed(0.0, P, r0, a0, h0),
    "F_cylconic_printed": lambda eps, P, r0, a0, k_c: braid.cone_force_printed(eps, P, r0, a0, k_c),
    "F_cylconic_energy": lambda eps, P, r0, a0, k_c: braid.cone_force(eps, P, r0, a0, k_c),
    "eps_zero_force_energy_cone": lambda r0, a0, k_c: braid.zero_between(
        lambda eps: braid.cone_force(eps, 1e5, r0, a0, k_c), 1e-3, braid.largest_contraction(a0)
    ),
    "work_ratio_printed_over_PdV": lambda l0, r0, a0, k_c, eps_end: work_ratio(
        lambda eps: braid.cone_force_printed(eps, 1.0, r0, a0, k_c),
        lambda eps: braid.cone_cylinder_volume(eps, l0, r0, a0, k_c),
        l0,
        eps_end,
    ),
    "work_ratio_real_over_PdV": lambda l0, r0, a0, h0, eps_end: work_ratio(
        lambda eps: braid.real_force_printed(eps, 1.0, r0, a0, rubber.inner_radius(eps, r0, a0, h0)),
        lambda eps: jnp.pi * rubber.inner_radius(eps, r0, a0, h0) ** 2 * l0 * (1 - eps),
        l0,
        eps_end,
    ),
    # rubber
    "lambda1_thin": lambda eps, a0, h0: rubber.thin_inner_stretch(eps, a0, h0),
    "sigma1_thin": lambda lambda1, lambda2, G: rubber.thin_wall_stresses(lambda1, lambda2, G)[0],
    "sigma2_thin": lambda lambda1, lambda2, G: rubber.thin_wall_stresses(lambda1, lambda2, G)[1],
    "sigma1_minus_sigma3": lambda lambda1, lambda2, C10, C01: rubber.mooney_rivlin_stresses(lambda1, lambda2, C10, C01)[
        0
    ],
    "sigma2_minus_sigma3": lambda lambda1, lambda2, C10, C01: rubber.mooney_rivlin_stresses(lambda1, lambda2, C10, C01)[
        1
    ],
    "W_mooney_rivlin": lambda lambda1, lambda2, C10, C01: rubber.mooney_rivlin_energy(lambda1, lambda2, C10, C01),
    "F_elastic_schulte_printed": lambda eps, l0, r0, a0, k_e: rubber.schulte_elastic_force_printed(
        eps, l0, r0, a0, k_e
    ),
    "F_elastic_schulte_corrected": lambda eps, l0, r0, a0, k_e: rubber.schulte_elastic_force(eps, l0, r0, a0, k_e),
    "F_elastic_axial_thin_printed": lambda eps, r0, a0, h0, G: rubber.axial_elastic_force_printed(eps, r0, a0, h0, G),
    "F_elastic_thin_energy": lambda eps, r0, a0, h0, G: rubber.thin_elastic_force(eps, r0, a0, h0, G),
    "F_elastic_MR_concise_corrected": lambda eps, r0, a0, h0, C10, C01: rubber.concise_elastic_force(
        eps, r0, a0, h0, C10, C01
    ),
    "F_elastic_MR_thick": lambda eps, r0, a0, h0, C10, C01: rubber.thick_elastic_force(eps, r0, a0, h0, C10, C01),
    "E_elastic_MR_thick": lambda eps, l0, r0, a0, h0, C10, C01: (
        l0 * rubber.thick_wall_energy(r0 * braid.radius_ratio(eps, a0), 1 - eps, r0, r0 * (1 - h0), r0, C10, C01)
    ),
    "F_total_thick_MR": lambda eps, P, r0, a0, h0, C10, C01: rubber.thick_wall_force(eps, P, r0, a0, h0, C10, C01),
    # working pressure
    "P_min_thin_corrected": lambda eps, a0, h0, G: working_pressure.minimum_pressure_thin(eps, a0, h0, G),
    "P_min_thick_neo_hookean": lambda eps, a0, h0, G: working_pressure.minimum_pressure(eps, a0, h0, G / 2, 0.0),
    "P_min_thick_MR": lambda eps, a0, h0, C10, C01: working_pressure.minimum_pressure(eps, a0, h0, C10, C01),
    "P_max_burst": lambda eps, a0, h0, sigma_b: working_pressure.burst_pressure(eps, a0, h0, sigma_b),
    "N_wall_axial": lambda eps, P, r0, a0, h0, C10, C01: working_pressure.wall_axial_force(
        eps, P, r0, a0, h0, C10, C01
    ),
    # norm: P (1 - h0)/(G h0), which is the pressure itself for h0 = 1/2, G = 1
    "free_tube_pressure_norm": lambda lambda1: working_pressure.free_tube_pressure(lambda1, 0.5, 1.0),
    "length_held_tube_pressure_norm": lambda lambda1: working_pressure.held_tube_pressure(lambda1, 0.5, 1.0),
    "free_tube_ballooning_lambda1": lambda: working_pressure.ballooning_stretch(),
    "free_tube_ballooning_pressure_norm": lambda: working_pressure.free_tube_pressure(
        working_pressure.ballooning_stretch(), 0.5, 1.0
    ),
    # textile
    "F_friction_schulte": lambda eps, P, l0, r0, a0, f_s, f_st: textile.schulte_friction(
        P, r0 * braid.radius_ratio(eps, a0), l0 * (1 - eps), f_s + f_st
    ),
    "F_friction_hertz": lambda eps, P, l0, r0, a0, f_s, E, nu: textile.hertz_friction(
        P, braid.contact_surface(eps, l0, r0, a0), f_s, E, nu
    ),
    "r_contact": lambda P, D_s, E, nu: textile.sphere_contact_radius(P, D_s, E, nu),
    "S_scale": lambda P, E, nu: textile.hertz_scale(P, E, nu),
    "F_textile": lambda L, C, beta: textile.power_law_friction(L, C / textile.textile_constant(1.0, beta), beta),
    "f_kinetic": lambda xdot, f_s, f_k, xdot_s: textile.kinetic_coefficient(xdot, f_s, f_k, xdot_s),
    # biology
    "F_general": lambda u, F_max, eps, eps_max, F_res: biology.generic_force(
        u, biology.linear_spring_force(eps, F_max, eps_max), F_res
    ),
    "F_hill": lambda V, F0, a_over_F0, V_max: biology.hill_force(V, F0, a_over_F0 * F0, a_over_F0 * V_max),
    "F_V_hill": lambda V, F0, a_over_F0, V_max: biology.hill_viscous_force(V, F0, a_over_F0 * F0, a_over_F0 * V_max),
    "V_over_Vmax_hill": lambda F_over_F0, a_over_F0: biology.hill_velocity_ratio(F_over_F0, a_over_F0),
    "xddot_voigt": lambda M, B, K, F_ce, x, xdot, g: biology.voigt_acceleration(x, xdot, F_ce, M, B, K, g),
    "xddot": lambda M, F_dyn, g: biology.lifted_acceleration(F_dyn, M, g),
    "xddot_linear_coulomb": lambda u, F_max, l0, eps_max, F_k, M, x, xdot, g: biology.coulomb_acceleration(
        x, xdot, u * F_max, l0 * eps_max, F_k, M, g
    ),
}


def network_shape(eps: float, l0: float, r0: float, a0: float) -> jax.Array:
    """r/l of a network of one row and one column that has the muscle's shape at rest."""
    side, angle = l0 / (2 * jnp.cos(a0)), braid.angle(eps, a0)
    rows = r0 / (side * jnp.sin(a0) / jnp.pi)
    return braid.network_circumference(side, rows, angle) / (2 * jnp.pi) / braid.network_length(side, 1, angle)


def work_ratio(force: Callable, volume: Callable, l0: float, end: float) -> jax.Array:
    """Work of a force at P = 1 Pa over the growth of the volume."""
    return braid.delivered_work(force, l0, end) / (volume(jnp.asarray(end)) - volume(jnp.asarray(0.0)))


def evaluate(quantity: str, **inputs: float) -> float:
    """The value of one quantity of golden.json for its inputs."""
    known = {name: float(value) for name, value in inputs.items()}
    if "alpha0_deg" in known:
        known["a0"] = radians(known["alpha0_deg"])
    law = QUANTITIES[quantity]
    wanted = inspect.signature(law).parameters
    with jax.enable_x64(True):  # also where no conftest has switched it on
        if "ri" in wanted:
            known["ri"] = float(rubber.inner_radius(known["eps"], known["r0"], known["a0"], known["h0"]))
        return float(_compiled(quantity)(**{name: known[name] for name in wanted}))


_CACHE: dict[str, Callable] = {}


def _compiled(quantity: str) -> Callable:
    # one compilation per quantity instead of one dispatch per operation
    return _CACHE.setdefault(quantity, jax.jit(QUANTITIES[quantity]))
