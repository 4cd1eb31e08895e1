"""From what the rig says to what the braid feels, and the frictionless pull there."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.optimize import brentq

from .physics import ATMOSPHERE, BLADDERS, STORED, Muscle, State, Truth, outer_radius, radius_slope, tan_angle
from .strangers import STRANGERS


def pressure_offset(muscle: Muscle, state: State, P_off: float):
    """true = reading - P_off"""
    return replace(state, pressure=state.pressure - P_off)


def pressure_gain(muscle: Muscle, state: State, g: float):
    """true = reading / (1 + g)"""
    return replace(state, pressure=state.pressure / (1 + g))


def contraction_offset(muscle: Muscle, state: State, eps_off: float):
    """true = reading - eps_off"""
    return replace(state, contraction=state.contraction - eps_off)


def lagged(time, port, tau: float):
    """First-order answer to a piecewise linear port pressure, steady at the first sample (exact)."""
    out, inside = np.empty(len(port)), port[0]
    out[0] = inside
    for i in range(1, len(port)):
        dt = time[i] - time[i - 1]
        slope = (port[i] - port[i - 1]) / dt
        # On a ramp the lag settles to port - slope * tau; the distance from that decays.
        inside = port[i] - slope * tau + (inside - port[i - 1] + slope * tau) * np.exp(-dt / tau)
        out[i] = inside
    return out


def supply_lag(muscle: Muscle, state: State, tau: float):
    """The muscle's pressure follows the port's; a single state has no history and is left alone."""
    if np.ndim(state.pressure) == 0 or np.ndim(state.time) == 0:
        return state
    return replace(state, pressure=lagged(state.time, state.pressure, tau))


def pressure_drop(muscle: Muscle, state: State, tau: float):
    """P - tau (P + 1 atm) (dV/dt)/V with V = pi r^2 l."""
    growth = 2 * radius_slope(muscle, state) / outer_radius(muscle, state) - 1 / (1 - state.contraction)
    return replace(state, pressure=state.pressure - tau * (state.pressure + ATMOSPHERE) * growth * state.rate)


def dead_band(muscle: Muscle, state: State, P_th: float):
    """Only what exceeds P_th works on the braid."""
    return replace(state, pressure=np.maximum(state.pressure - P_th, 0.0))


def gap_pressure(muscle: Muscle, gap: float) -> float:
    """Pressure that brings a free thin neo-Hookean tube of outer radius r0 (1 - gap) to r0 (23F)."""
    hoop = 1 / (1 - gap)
    axial = 1.0 if gap == 0 else brentq(lambda x: 2 * hoop**2 * x**4 - hoop**4 * x**2 - 1, 0.3, 3 * hoop)
    share = muscle.wall_thickness / (muscle.radius * (1 - gap))
    return muscle.shear_modulus * share / (1 - share) / axial * (1 - 1 / (hoop**4 * axial**2))


def radial_gap(muscle: Muscle, state: State, gap: float):
    """A bladder narrower than the braid: a dead band that its own stiffness sets."""
    return dead_band(muscle, state, gap_pressure(muscle, gap))


def tip(muscle: Muscle, state: State, k: float):
    """The braid contracts k times what the muscle's length says."""
    return replace(state, contraction=k * state.contraction)


def tip_pressure(muscle: Muscle, state: State, b_k: float, a_k: float, P_k: float):
    """As tip, with k = b_k + a_k exp(-P/P_k)."""
    return replace(state, contraction=(b_k + a_k * np.exp(-state.pressure / P_k)) * state.contraction)


def strand_stretch(muscle: Muscle, state: State, EA: float):
    """Cord longer by eta = 2 pi r^2 P / (tan^2 cos EA), all from the unstretched cord."""
    rigid = replace(state, stretch=0.0)
    tangent = tan_angle(muscle, rigid)
    cosine = 1 / np.sqrt(1 + tangent**2)
    tension = 2 * np.pi * outer_radius(muscle, rigid) ** 2 * state.pressure / (tangent**2 * cosine)
    return replace(state, stretch=tension / EA)


FELT = {
    "pressure_offset": pressure_offset,
    "pressure_gain": pressure_gain,
    "contraction_offset": contraction_offset,
    "supply_lag": supply_lag,
    "pressure_drop": pressure_drop,
    "dead_band": dead_band,
    "radial_gap": radial_gap,
    "series_compliance": None,
    "tip": tip,
    "tip_pressure": tip_pressure,
    "strand_stretch": strand_stretch,
}


BEFORE, BEHIND = (
    list(FELT)[: list(FELT).index("series_compliance")],
    list(FELT)[list(FELT).index("series_compliance") + 1 :],
)


def through(truth: Truth, state: State, names) -> State:
    """The felt effects `names` in turn."""
    for name in names:
        if name == "series_compliance" and name in truth.effects:
            state = yielded(truth, state, **truth.effects[name])
        elif name in truth.effects:
            state = FELT[name](truth.muscle, state, **truth.effects[name])
    return state


def yielded(truth: Truth, state: State, k_s: float, resisted=None) -> State:
    """The muscle is shorter than the rig says by pull/k_s, the pull being the muscle's own (Newton's method).

    `resisted` takes a force from the pull at a felt state; nothing, unless given.
    """

    def excess(contraction):
        there = through(truth, replace(state, contraction=contraction), BEHIND)
        taken = 0.0 if resisted is None else resisted(there)
        return contraction - state.contraction - (pull(truth, there) - taken) / (k_s * truth.muscle.length)

    own, step = np.asarray(state.contraction, float), 1e-7
    for _ in range(30):
        gap = excess(own)
        slope = (excess(own + step) - excess(own - step)) / (2 * step)
        own = own - np.clip(gap / slope, -0.05, 0.05)
        if np.max(np.abs(gap)) < 1e-13:
            break
    return replace(state, contraction=own)


def felt(truth: Truth, state: State) -> State:
    """What the braid feels. On a time grid the rate is that of the felt contraction, by differences."""
    state = through(truth, state, FELT)
    if np.ndim(state.contraction) == 1 and np.ndim(state.time) == 1:
        return replace(state, rate=np.gradient(state.contraction, state.time))
    return state


def elastic(truth: Truth, state: State):
    """The pull of the rubber alone."""
    laws = [law for name, law in BLADDERS.items() if name in truth.effects]
    names = [name for name in BLADDERS if name in truth.effects]
    return sum(
        (law(truth.muscle, state, **truth.effects[name]) for law, name in zip(laws, names, strict=True)),
        np.zeros_like(np.asarray(state.contraction, float)),
    )


def pull(truth: Truth, state: State):
    """Frictionless pull at a felt state; strangers count as pull."""
    laws = {**STORED, **STRANGERS}
    parts = [laws[name](truth.muscle, state, **given) for name, given in truth.effects.items() if name in laws]
    return sum(parts, np.zeros_like(np.asarray(state.contraction, float)))
