"""What is lost to motion: dry friction (size x direction) and drag."""

from __future__ import annotations

import numpy as np

from .felt import elastic
from .physics import State, Truth, braid_path, contact_surface, ideal_cylinder, outer_radius, tan_angle

TEXTILE_LOAD = 1000.0
ELEMENTS = 4


def hertz_scale(modulus: float, poisson: float, pressure):
    """S_scale of eq 38."""
    pressure = np.maximum(pressure, 1e-6)
    return 0.5 * (8 / 3) ** (1 / 3) * (modulus / ((1 - poisson**2) * pressure)) ** (1 / 3)


def coulomb_friction(muscle, state: State, f_s: float):
    """f_s S P"""
    return f_s * contact_surface(muscle, state) * np.maximum(state.pressure, 0.0)


def textile_friction(muscle, state: State, f_s: float, beta: float):
    """f_s L (S P / L)^beta with L = 1 kN"""
    load = contact_surface(muscle, state) * np.maximum(state.pressure, 0.0)
    return f_s * TEXTILE_LOAD * (load / TEXTILE_LOAD) ** beta


def hertz_friction(muscle, state: State, f_s: float):
    """f_s S P / S_scale, eqs 36 and 38"""
    scale = hertz_scale(muscle.strand_modulus, muscle.strand_poisson, state.pressure)
    return coulomb_friction(muscle, state, f_s) / scale


def schulte_friction(muscle, state: State, f: float):
    """2 pi r l P f, eq 33"""
    length = muscle.length * (1 - state.contraction)
    return 2 * np.pi * outer_radius(muscle, state) * length * np.maximum(state.pressure, 0.0) * f


def constant_friction(muscle, state: State, F_c: float):
    """F_c whatever the pressure"""
    return F_c * np.ones_like(np.asarray(state.contraction, float))


def crossing_friction(muscle, state: State, mu_R: float):
    """(4/3) pi mu_R P r / tan(angle): crossings that turn on each other"""
    pressure = np.maximum(state.pressure, 0.0)
    return 4 / 3 * np.pi * mu_R * pressure * outer_radius(muscle, state) / tan_angle(muscle, state)


SIZES = {
    "coulomb_friction": coulomb_friction,
    "textile_friction": textile_friction,
    "hertz_friction": hertz_friction,
    "schulte_friction": schulte_friction,
    "constant_friction": constant_friction,
    "crossing_friction": crossing_friction,
}


def size(truth: Truth, state: State):
    """Dry friction: the braid's, times what speed makes of it, plus the rubber's own."""
    effects = truth.effects
    parts = [law(truth.muscle, state, **effects[name]) for name, law in SIZES.items() if name in effects]
    total = sum(parts, np.zeros_like(np.asarray(state.contraction, float)))
    if "kinetic_friction" in effects:
        ratio, v_s = effects["kinetic_friction"]["ratio"], effects["kinetic_friction"]["v_s"]
        speed = np.abs(truth.muscle.length * np.asarray(state.rate))
        total = total * (ratio + (1 - ratio) * np.exp(-speed / v_s))
    if "bladder_hysteresis" in effects:
        total = total + effects["bladder_hysteresis"]["eta_b"] * np.abs(elastic(truth, state))
    return total


def dahl(path, x_s: float):
    """Direction with a transition length: z -> s + (z - s) exp(-|dx|/x_s), exact for every step."""
    z, out = 0.0, np.zeros(len(path))
    steps = np.diff(path)
    fades, signs = np.exp(-np.abs(steps) / x_s), np.sign(steps)
    for i, (fade, sign) in enumerate(zip(fades.tolist(), signs.tolist(), strict=True)):
        z = sign + (z - sign) * fade
        out[i + 1] = z
    return out


def reaches(x_s: float, spread: float):
    """Length after which each slip element slides."""
    order = np.arange(ELEMENTS)
    return x_s * spread ** ((2 * order - ELEMENTS + 1) / (ELEMENTS - 1))


def maxwell_slip(path, x_s: float, spread: float):
    """Mean of elements that each follow the path and slip at +-1."""
    total = np.zeros(len(path))
    for reach in reaches(x_s, spread):
        z, out = 0.0, [0.0]
        for step in (np.diff(path) / reach).tolist():
            z = min(1.0, max(-1.0, z + step))
            out.append(z)
        total += np.array(out)
    return total / ELEMENTS


def direction(truth: Truth, state: State):
    """Direction of dry friction along the braid's path: its sign, or what memory makes of it."""
    path = braid_path(truth.muscle, state)
    if "presliding" in truth.effects:
        return dahl(path, **truth.effects["presliding"])
    if "maxwell_slip" in truth.effects:
        return maxwell_slip(path, **truth.effects["maxwell_slip"])
    speed = np.gradient(path, state.time)
    return np.where(np.abs(speed) > 1e-10, np.sign(speed), 0.0)


def relaxed(time, stroke, tau: float):
    """y with tau dy/dt = x - y and y = x at the first sample, exact for a piecewise linear x."""
    y, out = stroke[0], [stroke[0]]
    steps, fades = np.diff(time), np.exp(-np.diff(time) / tau)
    for i, (dt, fade) in enumerate(zip(steps.tolist(), fades.tolist(), strict=True)):
        slope = (stroke[i + 1] - stroke[i]) / dt
        y = stroke[i + 1] - slope * tau + (y - stroke[i] + slope * tau) * fade
        out.append(y)
    return np.array(out)


def hill_drag(truth: Truth, state: State, a_over_F0: float, b: float):
    """(F0 + a) v / (v + b) while shortening"""
    speed = np.maximum(truth.muscle.length * np.asarray(state.rate), 0.0)
    isometric = np.maximum(ideal_cylinder(truth.muscle, state), 0.0)
    return (1 + a_over_F0) * isometric * speed / (speed + b)


def softening(truth: Truth, state: State, top, m: float, w: float):
    """Mullins: the share of the rubber's pull that is gone below the largest contraction so far."""
    return m * elastic(truth, state) * (1 - np.exp(-(top - state.contraction) / w))


def memoryless_drag(truth: Truth, state: State):
    """Drag that follows from the state alone."""
    total = np.zeros_like(np.asarray(state.contraction, float))
    if "viscous_damping" in truth.effects:
        total = total + truth.effects["viscous_damping"]["B"] * truth.muscle.length * np.asarray(state.rate)
    if "hill" in truth.effects:
        total = total + hill_drag(truth, state, **truth.effects["hill"])
    return total


def lost(truth: Truth, state: State):
    """Size x direction + drag over one run, memory fresh at its first sample."""
    total = size(truth, state) * direction(truth, state) + memoryless_drag(truth, state)
    if "creep" in truth.effects:
        stroke = truth.muscle.length * np.asarray(state.contraction)
        given = truth.effects["creep"]
        total = total + given["K1"] * (stroke - relaxed(state.time, stroke, given["tau"]))
    if "mullins" in truth.effects:
        top = np.maximum.accumulate(state.contraction)
        total = total + softening(truth, state, top, **truth.effects["mullins"])
    return total
