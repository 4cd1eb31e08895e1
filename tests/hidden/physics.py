"""Laws of a braided muscle, written from the published equations for use as truth in tests.

Nothing here is shared with the program under test: numpy only, other algebra, other data types.
Forces are positive when they pull; SI units and radians throughout.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

GRAVITY = 9.80665
ATMOSPHERE = 101325.0
NODES, SHARES = np.polynomial.legendre.leggauss(12)


@dataclass(frozen=True)
class Muscle:
    """What is measured at rest."""

    length: float = 0.300
    radius: float = 0.007
    braid_angle: float = float(np.radians(20.0))
    wall_thickness: float = 0.0005
    wall_outside: float = 0.0
    shear_modulus: float | None = None
    strand_width: float | None = None
    strand_modulus: float | None = None
    strand_poisson: float | None = None
    moving_mass: float = 0.0


@dataclass(frozen=True)
class Truth:
    """A muscle and everything that happens in it: effect name -> its parameters."""

    muscle: Muscle = field(default_factory=Muscle)
    effects: dict[str, dict[str, float]] = field(default_factory=dict)


@dataclass(frozen=True)
class State:
    """What the muscle goes through; every field may be an array over samples."""

    contraction: np.ndarray | float
    pressure: np.ndarray | float
    time: np.ndarray | float = 0.0
    rate: np.ndarray | float = 0.0
    stretch: np.ndarray | float = 0.0


def cos_angle(muscle: Muscle, state: State):
    """Cosine of the braid angle; a stretched cord (1 + stretch) lies flatter in the same length."""
    return np.cos(muscle.braid_angle) * (1 - state.contraction) / (1 + state.stretch)


def sin_angle(muscle: Muscle, state: State):
    """Sine of the braid angle, kept off zero where the muscle would be pulled straight."""
    return np.sqrt(np.maximum(1 - cos_angle(muscle, state) ** 2, 1e-9))


def tan_angle(muscle: Muscle, state: State):
    """Tangent of the braid angle."""
    return sin_angle(muscle, state) / cos_angle(muscle, state)


def outer_radius(muscle: Muscle, state: State):
    """Radius of the braid: cord x sin(angle) / (2 pi turns)."""
    return muscle.radius / np.sin(muscle.braid_angle) * (1 + state.stretch) * sin_angle(muscle, state)


def radius_slope(muscle: Muscle, state: State):
    """d(radius)/d(contraction) at constant cord."""
    largest = muscle.radius / np.tan(muscle.braid_angle)
    return largest**2 * (1 - state.contraction) / outer_radius(muscle, state)


def contact_surface(muscle: Muscle, state: State):
    """Strand-on-strand surface, eq 35: rhombi of two strips of constant width."""
    at_rest = 2 * np.pi * muscle.radius * muscle.length * np.sin(2 * muscle.braid_angle)
    return at_rest / (2 * sin_angle(muscle, state) * cos_angle(muscle, state))


def braid_path(muscle: Muscle, state: State):
    """The braid's own stroke l0 (1 - cos(angle)/cos(angle at rest)): what friction follows."""
    return muscle.length * (1 - cos_angle(muscle, state) / np.cos(muscle.braid_angle))


def volume_pull(muscle: Muscle, state: State, volume_slope):
    """Pull of a pressure on a volume: (P / l0) dV/d(contraction)."""
    return state.pressure / muscle.length * volume_slope


def ideal_cylinder(muscle: Muscle, state: State):
    """Eq 10, from the volume pi r^2 l."""
    radius, slope = outer_radius(muscle, state), radius_slope(muscle, state)
    change = 2 * np.pi * radius * slope * muscle.length * (1 - state.contraction) - np.pi * radius**2 * muscle.length
    return volume_pull(muscle, state, change)


def conical_ends(muscle: Muscle, state: State, k_c: float):
    """Eq 25E less eq 10: each end is a cone of length k_c l0 eps from r0 to r."""
    radius, slope = outer_radius(muscle, state), radius_slope(muscle, state)
    cone = k_c * muscle.length * state.contraction
    missing = 2 * radius**2 - radius * muscle.radius - muscle.radius**2
    change = k_c * muscle.length * missing + cone * (4 * radius - muscle.radius) * slope
    return volume_pull(muscle, state, -2 * np.pi / 3 * change)


def reduced_length(muscle: Muscle, state: State, factor: float):
    """Volume pi r^2 (l - factor (r - r0)), less the cylinder."""
    radius, slope = outer_radius(muscle, state), radius_slope(muscle, state)
    change = factor * slope * (3 * radius**2 - 2 * radius * muscle.radius)
    return volume_pull(muscle, state, -np.pi * change)


def ring_pull(muscle: Muscle, state: State, ring, C10: float, C01: float):
    """Minus the slope of Rivlin's energy density along the braid, in a ring of rest radius `ring` (in Pa).

    Incompressible wall fixed to the braid: r_m^2 = r^2 + (R^2 - r0^2)/(1 - eps).
    """
    axial, axial_slope = (1 - state.contraction) ** 2, -2 * (1 - state.contraction)
    shift = (ring**2 - muscle.radius**2) / (1 - state.contraction)
    hoop = (outer_radius(muscle, state) ** 2 + shift) / ring**2
    hoop_slope = 2 * outer_radius(muscle, state) * radius_slope(muscle, state) + shift / (1 - state.contraction)
    hoop_slope = hoop_slope / ring**2
    both = hoop_slope / hoop + axial_slope / axial
    first = hoop_slope + axial_slope - both / (hoop * axial)
    second = -hoop_slope / hoop**2 - axial_slope / axial**2 + both * hoop * axial
    return -(C10 * first + C01 * second)


def bladder_mooney_rivlin(muscle: Muscle, state: State, C10: float, C01: float):
    """Eq 32T: thick wall, the energy's slope integrated over the wall by Gauss points in R^2."""
    outside = (muscle.radius + muscle.wall_outside) ** 2
    bore = (muscle.radius + muscle.wall_outside - muscle.wall_thickness) ** 2
    force = 0.0
    for node, share in zip(NODES, SHARES, strict=True):
        ring = np.sqrt(0.5 * (outside + bore) + 0.5 * (outside - bore) * node)
        force = force + share * ring_pull(muscle, state, ring, C10, C01)
    return 0.5 * np.pi * (outside - bore) * force


def bladder_neo_hookean(muscle: Muscle, state: State, G: float):
    """Eq 32T with C10 = G/2 and C01 = 0."""
    return bladder_mooney_rivlin(muscle, state, 0.5 * G, 0.0)


def bladder_ogden(muscle: Muscle, state: State, G: float, n: float):
    """One term of Ogden's law in a thick wall: the slopes of the stretches times their nominal stresses."""
    outside = (muscle.radius + muscle.wall_outside) ** 2
    bore = (muscle.radius + muscle.wall_outside - muscle.wall_thickness) ** 2
    axial, axial_slope = 1 - state.contraction, -1.0
    shift = axial * outer_radius(muscle, state) ** 2 - muscle.radius**2  # l2 r^2 = R^2 + shift for every ring
    shift_slope = axial_slope * outer_radius(muscle, state) ** 2
    shift_slope = shift_slope + 2 * axial * outer_radius(muscle, state) * radius_slope(muscle, state)
    force = 0.0
    for node, share in zip(NODES, SHARES, strict=True):
        ring = 0.5 * (outside + bore) + 0.5 * (outside - bore) * node
        hoop = np.sqrt((ring + shift) / (ring * axial))
        hoop_slope = hoop * 0.5 * (shift_slope / (ring + shift) - axial_slope / axial)
        radial = 1 / (hoop * axial)
        radial_slope = -radial * (hoop_slope / hoop + axial_slope / axial)
        slopes = ((hoop, hoop_slope), (axial, axial_slope), (radial, radial_slope))
        force = force - share * sum(2 * G / n * stretch ** (n - 1) * slope for stretch, slope in slopes)
    return 0.5 * np.pi * (outside - bore) * force


def bladder_thin_mooney_rivlin(muscle: Muscle, state: State, C10: float, C01: float):
    """Eq 32 corrected: the whole wall strains as the braid's own radius does."""
    outside = muscle.radius + muscle.wall_outside
    area = np.pi * (outside**2 - (outside - muscle.wall_thickness) ** 2)
    return area * ring_pull(muscle, state, muscle.radius, C10, C01)


def bladder_schulte(muscle: Muscle, state: State, k_e: float):
    """Eq 26 corrected: two independent tensions in the wall."""
    radius = outer_radius(muscle, state)
    axial = -2 * np.pi * k_e * radius * muscle.length * state.contraction
    return axial - 4 * np.pi**2 * k_e * radius * (radius - muscle.radius) / tan_angle(muscle, state) ** 2


def strand_bending(muscle: Muscle, state: State, c_b: float, alpha_f: float | None = None):
    """Strands formed at the angle alpha_f (at rest unless given) and bent since."""
    formed = muscle.braid_angle if alpha_f is None else alpha_f
    return -c_b * (sin_angle(muscle, state) - np.sin(formed)) / tan_angle(muscle, state)


def end_stop(muscle: Muscle, state: State, K: float, eps_s: float):
    """A stop of stiffness K (N/m) beyond the contraction eps_s."""
    return -K * muscle.length * np.maximum(state.contraction - eps_s, 0.0)


def linear_spring(muscle: Muscle, state: State, K: float):
    """A spring of stiffness K (N/m) at rest in the muscle at rest."""
    return -K * muscle.length * state.contraction


def weight(muscle: Muscle, state: State, m: float):
    """A mass hung between muscle and load cell."""
    return -m * GRAVITY * np.ones_like(np.asarray(state.contraction, float))


BLADDERS = {
    "bladder_neo_hookean": bladder_neo_hookean,
    "bladder_mooney_rivlin": bladder_mooney_rivlin,
    "bladder_ogden": bladder_ogden,
    "bladder_thin_mooney_rivlin": bladder_thin_mooney_rivlin,
    "bladder_schulte": bladder_schulte,
}
STORED = {
    "ideal_cylinder": ideal_cylinder,
    "conical_ends": conical_ends,
    "reduced_length": reduced_length,
    "strand_bending": strand_bending,
    "end_stop": end_stop,
    "linear_spring": linear_spring,
    "weight": weight,
    **BLADDERS,
}
