"""Reference for muscles that move: scipy's DOP853 between events, formulas written out, stick and slip told apart.

Nothing here comes from the library. State: contraction, its rate, creep's dashpot (m), presliding's direction.
"""

from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp

G = 9.80665


@dataclass(frozen=True)
class Truth:
    """A muscle in numbers, SI and radians; friction f_s S P with the speed dependence of eq 48."""

    f_s: float = 0.0
    ratio: float = 1.0
    v_s: float = 0.2
    damping: float = 0.0
    creep: float = 0.0
    tau: float = 1.0
    x_s: float = 0.0
    length: float = 0.3
    radius: float = 0.007
    angle: float = np.radians(20)

    def pull(self, eps, pressure):
        a, b = 3 / np.tan(self.angle) ** 2, 1 / np.sin(self.angle) ** 2
        return np.pi * self.radius**2 * pressure * (a * (1 - eps) ** 2 - b)

    def volume(self, eps):
        wide = 1 - np.cos(self.angle) ** 2 * (1 - eps) ** 2
        return np.pi * self.radius**2 * wide / np.sin(self.angle) ** 2 * self.length * (1 - eps)

    def friction(self, eps, rate, pressure):
        narrow = np.sqrt(1 - np.cos(self.angle) ** 2 * (1 - eps) ** 2) / np.sin(self.angle)
        surface = 2 * np.pi * self.radius * self.length / (narrow * (1 - eps))
        speed = np.abs(rate) * self.length
        return self.f_s * surface * pressure * (self.ratio + (1 - self.ratio) * np.exp(-speed / self.v_s))

    def acceleration(self, y, sign, pressure, load, mass):
        eps, rate, dashpot, z = y
        drag = self.damping * rate * self.length + self.creep * (eps * self.length - dashpot)
        direction = z if self.x_s else sign
        size = self.friction(eps, rate, pressure)
        return (self.pull(eps, pressure) - drag - direction * size - load) / (mass * self.length)

    def rates(self, y, sign, pressure, load, mass):
        eps, rate, dashpot, z = y
        follow = (eps * self.length - dashpot) / self.tau
        turn = self.length * (rate - abs(rate) * z) / self.x_s if self.x_s else 0.0
        return [rate, self.acceleration(y, sign, pressure, load, mass) if sign is not None else 0.0, follow, turn]


def moved(truth, times, load, pressure, mass=None, start=0.0, segments=None, **method):
    """Contraction at the times; `pressure` a function of time. Appends (time, sign) of each phase to `segments`."""
    method = {"method": "DOP853", "rtol": 1e-11, "atol": 1e-13, "max_step": 0.02} | method
    mass = load / G if mass is None else mass
    t, end = max(times[0], 0.0), times[-1]
    y = np.array([start, 0.0, start * truth.length, 0.0])
    out = np.full(len(times), start)
    while t < end:
        up, down = (truth.acceleration(y, s, pressure(t + 1e-9), load, mass) for s in (1, -1))
        sign = np.sign(y[1]) if y[1] else 1 if up > 1e-9 else -1 if down < -1e-9 else None
        smooth = truth.x_s > 0

        def rates(s, y, sign=sign):
            return truth.rates(y, sign, pressure(s), load, mass)

        def stops(s, y, t=t, sign=sign):
            return sign * y[1] if s > t + 1e-7 else 1.0  # at rest it is 0 already where a slide begins

        def leaves_up(s, y):
            return truth.acceleration(y, 1, pressure(s), load, mass) - 2e-9

        def leaves_down(s, y):
            return truth.acceleration(y, -1, pressure(s), load, mass) + 2e-9

        stops.direction, leaves_up.direction, leaves_down.direction = -1, 1, -1
        events = [] if smooth else [leaves_up, leaves_down] if sign is None else [stops]
        for event in events:
            event.terminal = True
        kinks = [k for k in getattr(pressure, "kinks", ()) if k > t + 1e-9]
        until = min([end, *kinks])
        part = solve_ivp(rates, (t, until), y, events=events, dense_output=True, **method)
        inside = (times >= t) & (times <= part.t[-1])
        out[inside] = part.sol(times[inside])[0]
        if segments is not None:
            segments.append((t, sign))
        t, y = part.t[-1], part.y[:, -1].copy()
        if part.status == 1:
            y[1] = 0.0
    return out


def constant(pressure):
    """A pressure that stays."""
    return lambda t: pressure


def straight_between(times, values):
    """Pressure in straight lines between its values."""

    def pressure(t):
        return np.interp(t, times, values)

    pressure.kinks = tuple(times)
    return pressure
