"""Effects that are in nobody's library: for the cases in which the right answer is "none of these"."""

from __future__ import annotations

import numpy as np

from .physics import Muscle, State, ideal_cylinder


def strain_bump(muscle: Muscle, state: State, A: float, centre: float, width: float):
    """A bump of A newtons around one contraction."""
    return A * np.exp(-(((state.contraction - centre) / width) ** 2))


def pressure_stair(muscle: Muscle, state: State, A: float, step: float):
    """A newtons more at every other full step of pressure: a valve that sticks in its seat."""
    return A * (np.floor(np.asarray(state.pressure) / step + 1e-9) % 2)


def screw_ripple(muscle: Muscle, state: State, A: float, p: float):
    """A lead screw of pitch p that pushes and pulls once a turn."""
    return A * np.sin(2 * np.pi * muscle.length * state.contraction / p)


def pressure_squared_spring(muscle: Muscle, state: State, A: float, P_ref: float, eps_ref: float):
    """A cubic spring that stiffens with the square of pressure."""
    return -A * (np.asarray(state.pressure) / P_ref) ** 2 * (np.asarray(state.contraction) / eps_ref) ** 3


def warming_gain(muscle: Muscle, state: State, g: float, tau: float):
    """A gain that grows by g while the load cell warms up over tau seconds of the whole session."""
    return g * (1 - np.exp(-np.asarray(state.time) / tau)) * ideal_cylinder(muscle, state)


def speed_hump(muscle: Muscle, state: State, A: float, v_top: float):
    """A loss to motion that is largest (A newtons) at the speed v_top."""
    speed = muscle.length * np.asarray(state.rate) / v_top
    return -2 * A * speed / (1 + speed**2)


def striped_friction(muscle: Muscle, state: State, A: float, p: float):
    """Dry friction in stripes: high and low over every p of the stroke."""
    stripes = np.sin(np.pi * muscle.length * np.asarray(state.contraction) / p) ** 2
    return -A * stripes * np.sign(state.rate)


def pressure_speed_spring(muscle: Muscle, state: State, A: float, P_ref: float, v_ref: float, eps_ref: float):
    """A stiffness in proportion to pressure and to speed: the same all along a run that knows one of each."""
    fast = np.abs(muscle.length * np.asarray(state.rate)) / v_ref
    return -A * (np.asarray(state.pressure) / P_ref) * fast * (np.asarray(state.contraction) / eps_ref)


STRANGERS = {
    "strain_bump": strain_bump,
    "pressure_stair": pressure_stair,
    "screw_ripple": screw_ripple,
    "pressure_squared_spring": pressure_squared_spring,
    "warming_gain": warming_gain,
    "speed_hump": speed_hump,
    "striped_friction": striped_friction,
    "pressure_speed_spring": pressure_speed_spring,
}
