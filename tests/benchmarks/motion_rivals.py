"""Moving muscles as one would write them with scipy: `solve_ivp` between stops found as events, in numpy or numba.

M x'' = F - friction - drag - M g: ideal law behind a tip factor, textile friction that depends on speed, viscous drag;
the formulas are written out here, nothing comes from the library.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

G = 9.80665
LENGTH, ANGLE, PRESSURE = 0.3, math.radians(20.0), 5e5


class Values(NamedTuple):
    """f_s and beta of textile friction at 1 kN, fast over slow friction and its speed, tip factor, drag, radius."""

    f_s: float = 0.02
    beta: float = 1.0
    ratio: float = 7.0
    v_s: float = 0.2
    k: float = 1.0
    B: float = 0.0
    radius: float = 0.007


RAYON, IRON = Values(), Values(f_s=0.012, ratio=1.25)


def forces(eps: float, rate: float, v: tuple) -> tuple[float, float]:
    """Pull less drag, and the size of dry friction, N."""
    f_s, beta, ratio, v_s, k, damping, radius = v
    felt, sine = k * eps, math.sin(ANGLE)
    pull = math.pi * radius**2 * PRESSURE * (3 / math.tan(ANGLE) ** 2 * (1 - felt) ** 2 - 1 / sine**2)
    wide = math.sqrt(max(1 - (math.cos(ANGLE) * (1 - felt)) ** 2, 1e-12)) / sine
    contact = 2 * math.pi * radius * LENGTH / (wide * (1 - felt)) * PRESSURE
    speed = abs(k * rate) * LENGTH
    size = f_s * 1e3 * (contact / 1e3) ** beta * (ratio + (1 - ratio) * math.exp(-speed / v_s))
    return pull - damping * k * rate * LENGTH, size


def slopes(_: float, y: np.ndarray, sign: float, mass: float, v: tuple) -> tuple[float, float]:
    """Right-hand side while the muscle slides towards `sign`."""
    driving, size = forces(y[0], y[1], v)
    return y[1], ((driving - sign * size) / mass - G) / LENGTH


def compiled() -> Callable:
    """The same right-hand side compiled by numba."""
    import numba

    inner = numba.njit(forces)

    @numba.njit
    def rates(_, y, sign, mass, v):
        driving, size = inner(y[0], y[1], v)
        return np.array([y[1], ((driving - sign * size) / mass - G) / LENGTH])

    rates(0.0, np.zeros(2), 1.0, 20.0, tuple(RAYON))
    return rates


def release(values: Values, mass: float, times: np.ndarray, rates: Callable = slopes, **method) -> np.ndarray:
    """Contraction at `times` of a muscle let go at 0: slides, stops, and stays or turns back."""
    method = {"method": "DOP853", "rtol": 1e-11, "atol": 1e-13} | method
    v = tuple(float(value) for value in values)
    t, y, out = 0.0, np.zeros(2), np.zeros(len(times))

    def stops(_t, y, sign, _mass, _v):
        return y[1] * sign

    stops.terminal, stops.direction = True, -1
    while t < times[-1]:
        driving, size = forces(y[0], 0.0, v)
        left = driving - mass * G
        if abs(left) <= size:
            out[times >= t] = y[0]
            break
        sign = math.copysign(1.0, left)
        # past its own stop a trial step slides on as if nothing were: only what lies before the event counts
        part = solve_ivp(rates, (t, times[-1]), y, args=(sign, mass, v), events=stops, dense_output=True, **method)
        inside = (times >= t) & (times <= part.t[-1])
        out[inside] = part.sol(times[inside])[0]
        t, y = part.t[-1], np.array([part.y[0, -1], 0.0])
    return out
