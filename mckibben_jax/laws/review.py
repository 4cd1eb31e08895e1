"""The review's table: every equation of Tondu 2012 by its number, the function to call and what is wrong in print.

Status: "ok", correct as printed; "misprint", a slip in the formula or in a number beside it; "questionable", the
algebra is as intended but the physics does not hold; "addition", not in the review. `function` is the sound form,
`printed` the review's own where that differs and is worth comparing. `formula` is what `function` computes, unless it
says `formula_printed`: then it is what `printed` computes.
"""

from collections.abc import Callable
from difflib import get_close_matches
from typing import NamedTuple

from mckibben_jax.laws import biology, braid, rubber, textile, working_pressure
from mckibben_jax.laws.symbols import meanings


class Equation(NamedTuple):
    """One line of the table: `correction` says in one sentence what differs from print, or is empty."""

    number: str
    quantity: str
    function: Callable
    status: str
    correction: str
    formula: str
    own_symbols: str  # what is meant in this equation alone; the others are in the glossary
    printed: Callable | None = None
    formula_printed: bool = False

    @property
    def symbols(self) -> str:
        """What the symbols of the formula mean."""
        return meanings(self.formula, self.own_symbols)


def lookup(number: str) -> Equation:
    """The equation of this number, such as "25" or "25E" (letters in either case)."""
    known = {equation.number.lower(): equation for equation in EQUATIONS}
    wanted = str(number).strip().lower().removeprefix("eq").strip(" .")
    if wanted in known:
        return known[wanted]
    near = get_close_matches(wanted, known, n=3, cutoff=0.4)
    hint = f" (did you mean {' or '.join(known[name].number for name in near)}?)" if near else ""
    raise ValueError(f"the review has no equation {str(number)!r}{hint}; there are 1 to 48, 25E, 32T and a few more")


_HILL = "F0 isometric force, a (N) and b (m/s) of Hill, V shortening velocity"

EQUATIONS: tuple[Equation, ...] = (
    Equation(
        "1", "generic artificial muscle, linear spring", biology.generic_force, "ok",
        "The stiffness u F_max of the text is per unit eps/eps_max; in N/m it is u F_max/(eps_max l0).",
        "F = u F_max (1 - eps/eps_max) - F_res", "u activation, F_max largest force, F_res friction and elasticity",
    ),
    Equation(
        "2", "generic artificial muscle, any spring", biology.generic_force, "ok", "",
        "F = u F_spring(eps) - F_res(u, eps, deps/dt)", "u activation, F_spring at full activation, F_res resistance",
    ),
    Equation(
        "3", "contraction function", braid.radius_ratio, "ok", "", "r/r0 = f(eps), eps = (l0 - l)/l0",
        "f contraction function",
    ),
    Equation(
        "4", "virtual work of a cylinder", braid.virtual_work, "ok", "", "2 pi r l P dr + pi r^2 P dl + F dl = 0",
        "",
    ),
    Equation(
        "5", "force from the contraction function", braid.force_from_radius, "ok",
        "The dot on f is d/d eps, not d/dt.", "F = pi r0^2 P [2 (1 - eps) f f' - f^2]",
        "f contraction function r/r0",
    ),
    Equation(
        "6", "force from the volume, by contraction", braid.force_from_volume, "ok", "", "F = (P/l0) dV/d eps",
        "",
    ),
    Equation(
        "7", "force from the volume, by length", braid.force_from_volume, "ok", "", "F = -P dV/dl",
        "",
    ),
    Equation(
        "8", "kinematics of the braid", braid.angle, "ok", "",
        "r/r0 = sin(alpha)/sin(alpha0), l/l0 = cos(alpha)/cos(alpha0)",
        "",
    ),
    Equation(
        "9", "radius ratio of the braid", braid.radius_ratio, "ok", "",
        "f = sqrt(1 - cos^2(alpha0) (1 - eps)^2)/sin(alpha0)", "",
    ),
    Equation(
        "10", "ideal force", braid.ideal_force, "ok", "",
        "F = pi r0^2 P [a (1 - eps)^2 - b], a = 3/tan^2(alpha0), b = 1/sin^2(alpha0)", "",
    ),
    Equation(
        "11", "extremes of the ideal law", braid.largest_contraction, "ok",
        "Brackets: the root multiplies cos(alpha0).",
        "F_max = pi r0^2 P (a - b), eps_max = 1 - 1/(sqrt(3) cos(alpha0)), r_max = sqrt(2/3) r0/sin(alpha0), "
        "alpha_max = atan(sqrt(2))", "a, b of equation 10",
    ),
    Equation(
        "12", "ideal force by the braid angle (Schulte)", braid.ideal_force_schulte, "ok", "",
        "F = pi r90^2 P (3 cos^2(alpha) - 1)", "r90 = r0/sin(alpha0)",
    ),
    Equation(
        "13", "cord", braid.turns, "ok", "", "B = l0/cos(alpha0), B/N = 2 pi r0/sin(alpha0)",
        "",
    ),
    Equation(
        "14", "ideal force by the length (Gaylord)", braid.ideal_force_gaylord, "misprint",
        "The argument printed as mu is lambda2 = l/l0.", "F = P (3 lambda2^2 l0^2 - B^2)/(4 pi N^2)",
        "lambda2 = 1 - eps",
    ),
    Equation(
        "15", "network of pantographs", braid.network_length, "ok", "",
        "l = 2 m s cos(alpha), 2 pi r = 2 n s sin(alpha)", "m columns, n rows, s side of a pantograph",
    ),
    Equation(
        "16", "virtual work of the network", braid.axial_share, "ok", "", "f = f_c/tan(alpha)",
        "f axial force of a row, f_c circumferential force of a column",
    ),
    Equation(
        "17", "force of the braid", braid.braid_force, "misprint",
        "The middle step 2 n f must be n f; the right side is correct.", "F = n f = 2 pi r_i r P/tan^2(alpha)",
        "n rows, f axial force of a row",
    ),
    Equation(
        "18", "cylinder with a wall", braid.ideal_force, "questionable",
        "Takes the wall to carry no stress: 2 to 3 % of P dV is missing; an incompressible wall of no stiffness leaves "
        "eq 10 at the outer radius.",
        "F = (2 pi r_i r/tan^2(alpha) - pi r_i^2) P", "", braid.real_force_printed, True,
    ),
    Equation(
        "19", "cylinder with a thin wall", braid.ideal_force, "questionable",
        "Follows from 18 and shares its fault.",
        "F = F10 - pi r0^2 P 2 h0 (2 cos^2(alpha) - 1)/[(1 - eps) sin^2(alpha)]", "",
        braid.real_force_thin_printed, True,
    ),
    Equation(
        "20", "largest force with a thin wall", braid.ideal_force, "misprint",
        "The losses of 9 and 8 % beside it need h0 = 0.1, not 0.01; follows from 18 and shares its fault.",
        "F = pi r0^2 P [2/tan^2(alpha0) - 1 - 2 h0 (1/tan^2(alpha0) - 1)]", "", braid.real_force_thin_printed, True,
    ),
    Equation(
        "21", "stresses of Treloar", rubber.treloar_stresses, "ok", "",
        "s1 - s3 = G (l1^2 - l3^2), s2 - s3 = G (l2^2 - l3^2)", "",
    ),
    Equation(
        "22", "stresses in a thin wall", rubber.thin_wall_stresses, "ok", "",
        "s1 = G (l1^2 - 1/(l1 l2)^2), s2 = G (l2^2 - 1/(l1 l2)^2)", "",
    ),
    Equation(
        "23", "pressure to fill the braid, thin wall", working_pressure.minimum_pressure_thin, "misprint",
        "lambda2 in the bracket must be squared, by s1 t/r_i with 22 and by the limit of a thick wall.",
        "P (1 - h0)/(G h0) = (1/lambda2) (1 - 1/(lambda1^4 lambda2^2))", "",
        working_pressure.minimum_pressure_thin_printed,
    ),
    Equation(
        "23T", "pressure to fill the braid, thick wall", working_pressure.minimum_pressure, "addition",
        "The wall keeps this much of the pressure, the braid gets the rest.",
        "P = 2 (C10 + C01 lz^2) {[ln(r0/r_i0) - ln(r/r_i)]/lz + K/(2 lz^2) (1/r^2 - 1/r_i^2)}",
        "lz = 1 - eps, K = r_i0^2 - lz r_i^2",
    ),
    Equation(
        "23F", "pressure in a free tube", working_pressure.free_tube_pressure, "addition",
        "The law behind figure 8(a): ballooning at 0.7499 G h0/(1 - h0), lambda1 = 1.5769.",
        "2 l1^2 l2^4 - l1^4 l2^2 - 1 = 0, P (1 - h0)/(G h0) = (1/l2) (1 - 1/(l1^4 l2^2))", "",
    ),
    Equation(
        "24", "burst pressure", working_pressure.burst_pressure, "misprint",
        "The breaking stress beside it is 28 MN/m^2, not 280.", "P = sigma_b h0/((1 - h0) lambda1^2 lambda2)",
        "sigma_b breaking stress",
    ),
    Equation(
        "25", "cylinder with conical ends", braid.cone_force, "questionable",
        "Leaves out the axial push of P on the moving cones and the change of their length: delivers 2 to 4 times "
        "P dV; use 25E.",
        "F = pi r0^2 P {-1 + 2 (1 - eps)/tan^2(alpha0) [1 - eps + (k_c eps/3) (r0/r - 4)]}",
        "k_c cone length per l0 eps", braid.cone_force_printed, True,
    ),
    Equation(
        "25E", "cylinder with conical ends, by its volume", braid.cone_force, "addition",
        "Same shape as 25, F = -P dV/dl: below the cylinder, not above it.",
        "V = pi r^2 (l - 2 l_c) + (2 pi l_c/3) (r^2 + r r0 + r0^2), l_c = k_c l0 eps", "k_c cone ratio",
    ),
    Equation(
        "26", "linear elastic force (Schulte)", rubber.schulte_elastic_force, "misprint",
        "l - l0 for l in the first term, or the force does not vanish at rest.",
        "F = 2 pi k_e r (l - l0) - 4 pi^2 k_e r (r - r0)/tan^2(alpha)", "k_e stiffness in Pa",
        rubber.schulte_elastic_force_printed,
    ),
    Equation(
        "27", "axial elastic force of a thin wall, by stress", rubber.thin_elastic_force, "questionable",
        "Sign wrong where the wall is in tension, hoop part missing; use 28E.", "F = -pi (r^2 - r_i^2) s2",
        "", rubber.axial_elastic_force_printed, True,
    ),
    Equation(
        "28", "axial elastic force of a thin wall", rubber.thin_elastic_force, "questionable",
        "Contradicts the energy of its own rubber: 0.05 or less of it; use 28E.",
        "F = -pi t0^2 G [1 - 1/(lambda1^2 (1 - eps)^4)] [1/lambda1^2 + 2 (1 - h0) (1 - eps)/h0]",
        "", rubber.axial_elastic_force_printed, True,
    ),
    Equation(
        "28E", "elastic force of a thin wall, by its energy", rubber.thin_elastic_force, "addition",
        "About 16 times 28 at eps = 0.1, 20 deg, h0 = 0.1.",
        "F = dE/dl, E = 2 pi r_i0 t0 l0 (G/2) (lambda1^2 + lambda2^2 + (lambda1 lambda2)^-2 - 3)",
        "",
    ),
    Equation(
        "29", "energy of Rivlin", rubber.rivlin_energy, "ok", "C_00 = 0.", "W = sum C_ij (I1 - 3)^i (I2 - 3)^j",
        "",
    ),
    Equation(
        "30", "energy of Mooney and Rivlin", rubber.mooney_rivlin_energy, "ok", "",
        "W = C10 (I1 - 3) + C01 (I2 - 3)", "G = 2 (C10 + C01)",
    ),
    Equation(
        "31", "stresses of Mooney and Rivlin", rubber.mooney_rivlin_stresses, "ok", "",
        "s1 - s3 = 2 (l1^2 - l3^2) (W1 + l2^2 W2), s2 - s3 = 2 (l2^2 - l3^2) (W1 + l1^2 W2)",
        "W1, W2 slopes of W in I1, I2",
    ),
    Equation(
        "32", "elastic force of a Mooney-Rivlin wall that follows the braid", rubber.concise_elastic_force, "misprint",
        "Divide by l0 (printed: joules), + before the last term, and x is the axial stretch.",
        "F = (V_b/l0) {C10 [2 x (1 - c) - 2 x (1 + c - 2 c x^2)/(x^2 + c x^2 (1 - x^2))^2] "
        "+ C01 [2 x (1 + c - 2 c x^2) - 2/x^3 + 2 c x/(1 + c (1 - x^2))^2]}",
        "x = l/l0, c = (l0/(2 pi r0 N))^2 = 1/tan^2(alpha0), V_b volume of the wall",
        rubber.concise_elastic_force_printed,
    ),
    Equation(
        "32T", "elastic force of a thick Mooney-Rivlin wall", rubber.thick_elastic_force, "addition",
        "Exact for a cylinder; 1.4 times 32 for a wall ratio of 0.28.",
        "F = dE/dl, E = l0 int W(lambda_theta, lz) 2 pi R dR, lz r_m^2 = R^2 + k",
        "R and r_m radius in the wall, at rest and now, k = lz r_i^2 - r_i0^2",
    ),
    Equation(
        "33", "friction over the whole cylinder (Schulte)", textile.schulte_friction, "questionable",
        "The area exceeds the contact of the strands, and strands stick to the bladder.",
        "F = 2 pi r l P (f_s + f_st)", "F friction, f_s strand on strand, f_st strand on tube",
    ),
    Equation(
        "34", "contact surface, by the angle", braid.contact_surface, "ok",
        "The rhombus is that of two strips of constant width, not of constant side.",
        "S = 2 pi r0 l0 sin(2 alpha0)/sin(2 alpha)", "",
    ),
    Equation(
        "35", "contact surface, by the contraction", braid.contact_surface, "ok",
        "On conical ends, beside it: '> dS(r)' fails beyond 45 deg.",
        "S = 2 pi r0 l0 sin(alpha0)/[(1 - eps) sqrt(1 - cos^2(alpha0) (1 - eps)^2)]", "",
    ),
    Equation(
        "36", "friction of the braid", textile.hertz_friction, "questionable",
        "No transmission from the slip of strands to the stroke; proportional to l0 by construction.",
        "F = (f_s/S_scale) S P", "F friction, f_s coefficient",
    ),
    Equation(
        "37", "contact radius of two strands (Hertz)", textile.sphere_contact_radius, "ok", "",
        "r_c = (3/8)^(1/3) (F_c (D/2)/E*)^(1/3), E* = E/(2 (1 - nu^2)), F_c = P D^2",
        "D strand width, E modulus, nu Poisson's ratio of a strand",
    ),
    Equation(
        "38", "scale factor", textile.hertz_scale, "ok",
        "A ratio of lengths that the review uses to scale an area.",
        "S_scale = 0.5 (8/3)^(1/3) [E/((1 - nu^2) P)]^(1/3)", "E modulus, nu Poisson's ratio of a strand",
    ),
    Equation(
        "39", "static friction", textile.hertz_friction, "questionable",
        "Grows as P^(4/3), against 0.70 to 0.75 measured.", "F = F of 36", "F friction",
    ),
    Equation(
        "40", "textile friction", textile.power_law_friction, "ok", "",
        "F = C L^beta, beta < 1", "beta exponent, F friction, L load, C in N^(1 - beta): C = f (1 kN)^(1 - beta)",
    ),
    Equation(
        "41", "muscle of Voigt type", biology.voigt_acceleration, "ok", "", "M x'' + B x' + K x = F_ce - M g",
        "x = l0 eps, B damping, K stiffness, F_ce contractile force",
    ),
    Equation(
        "42", "lifted load", biology.lifted_acceleration, "ok", "", "M x'' = F_dyn - M g",
        "x = l0 eps, F_dyn pull in motion",
    ),
    Equation("43", "law of Hill", biology.hill_force, "ok", "", "(F + a) V = (F0 - F) b", _HILL),
    Equation(
        "44", "law of Hill, normalised", biology.hill_velocity_ratio, "ok", "",
        "(F/F0 + a/F0) (V/V_max) = (1 - F/F0) (a/F0)", _HILL,
    ),
    Equation(
        "45", "viscous part of Hill's law", biology.hill_viscous_force, "ok", "Shortening only, V >= 0.",
        "F = F0 - F_V, F_V = (F0 + a) V/(V + b)", _HILL,
    ),
    Equation(
        "46", "curvature of two braids", biology.hill_velocity_ratio, "ok", "Data: `biology.CURVATURE_RAYON`, `_IRON`.",
        "a/F0 = 0.12 rayon, 0.54 iron", _HILL,
    ),
    Equation(
        "47", "linear spring with constant friction", biology.coulomb_acceleration, "questionable",
        "V = A M g + B does not follow: the velocity without acceleration goes as (1 - w)/sqrt(w), `release_velocity`.",
        "u F_max (1 - x/(l0 eps_max)) - F_k sign(x') - M x'' = M g",
        "u activation, F_k kinetic friction, w = M g/(u F_max - F_k)",
    ),
    Equation(
        "48", "kinetic friction", textile.kinetic_coefficient, "misprint",
        "|x'| for x', or it blows up for x' < 0; f_k/f_s = 7 is friction that rises with speed.",
        "f = f_k + (f_s - f_k) exp(-|x'|/x'_s)", "f coefficient, f_s at rest, f_k when fast, x'_s scale of speed",
    ),
    Equation(
        "tip", "empirical tip correction", braid.tip_force, "ok", "", "F = F10(k eps, P)", "k factor",
    ),
    Equation(
        "length", "reduced length (Kothera et al.)", braid.reduced_length_volume, "ok", "",
        "l' = l - 2 (r - r0)", "l' length that counts",
    ),
    Equation(
        "note 4", "incompressibility of a thin wall", rubber.thin_inner_stretch, "misprint",
        "Garbled in print.", "(pi r^2 - pi r_i^2) l = pi t (2 r_i + t) l ~ 2 pi t r_i l", "t present thickness",
    ),
    Equation(
        "fatigue", "life of a latex bladder (Klute and Hannaford)", working_pressure.fatigue_cycles, "ok", "",
        "4320 cycles at 25 %, 17 620 at 5 %", "eps largest contraction of a cycle",
    ),
    Equation(
        "Liu", "fibre-reinforced tube (Liu and Rahn)", working_pressure.fibre_reinforced_force, "addition",
        "The review gives no force; the balance of stresses gives that of 32T.",
        "F = 2 pi r^2 (P - P_min)/tan^2(alpha) + 2 pi int s_z r dr - pi r_i^2 P", "",
    ),
    Equation(
        "Doumit", "contact of strands as parallel cylinders (Doumit et al.)", textile.cylinder_contact_area, "addition",
        "The review gives no formula; Hertz for cylinders along the rhombus of a crossing.",
        "2 b L, b = sqrt(4 (N/L) (D/4)/(pi E*))",
        "L length of contact, N load of a crossing, D strand width, E* contact modulus of equation 37",
    ),
)  # fmt: skip
