"""A mass on the muscle: quick releases and pressure steps, with exact sticking; loads hung and swept slowly."""

from __future__ import annotations

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from .felt import FELT, felt, pull, through
from .lost import ELEMENTS, memoryless_drag, reaches, size, softening
from .physics import GRAVITY, State, Truth, braid_path
from .rig import Noise, Recording, disturbed, gathered, polyline

REST = 5 + ELEMENTS
CREEP, PORT, DAHL, TOP = 2, 3, 4, REST
RULER = Noise(sd=5e-5)  # metres


def direct_felt(truth: Truth, contraction, pressure, rate, time) -> State:
    """The felt state and its rate at one moment; the supply's lag has already been taken by the integrator."""
    names = [name for name in FELT if name != "supply_lag"]

    def at(offset):
        return through(truth, State(contraction + rate * offset, pressure, time, rate), names)

    nudge = 1e-5
    now = at(0.0)
    speed = (at(nudge).contraction - at(-nudge).contraction) / (2 * nudge)
    return State(now.contraction, now.pressure, time, speed, now.stretch)


class Ride:
    """One mass, one load, one pressure history. The vector: x, v, creep, lagged pressure, z, slip elements, top."""

    def __init__(self, truth: Truth, load: float, pressure, hangs=False):
        self.truth, self.load, self.pressure, self.hangs = truth, load, pressure, hangs
        self.mass = load / GRAVITY + truth.muscle.moving_mass
        self.lag = truth.effects.get("supply_lag")
        self.remembers = "presliding" in truth.effects or "maxwell_slip" in truth.effects

    def state(self, time, vector) -> State:
        length = self.truth.muscle.length
        pressure = vector[PORT] if self.lag else self.pressure(time)
        return direct_felt(self.truth, vector[0] / length, pressure, vector[1] / length, time)

    def start(self):
        """At rest, memory fresh; at rest length, or where the load hangs."""
        vector = np.zeros(REST + 1)
        vector[PORT] = self.pressure(0.0)
        if self.hangs:
            vector[0] = self.resting_place(vector)
        state = self.state(0.0, vector)
        vector[CREEP] = self.truth.muscle.length * state.contraction
        vector[TOP] = state.contraction
        return vector

    def resting_place(self, vector):
        """Where the frictionless pull carries the load."""

        def surplus(place):
            there = np.array(vector)
            there[0] = place
            return float(pull(self.truth, self.state(0.0, there))) - self.load

        if surplus(0.0) < 0:
            raise ValueError(f"the muscle cannot carry {self.load:.0f} N at {vector[PORT] / 1e5:.2f} bar")
        return brentq(surplus, 0.0, 0.6 * self.truth.muscle.length)

    def net(self, time, vector) -> tuple[float, float]:
        """Force on the mass without dry friction, and the size of dry friction."""
        state = self.state(time, vector)
        drag = memoryless_drag(self.truth, state)
        if "creep" in self.truth.effects:
            stroke = self.truth.muscle.length * state.contraction
            drag = drag + self.truth.effects["creep"]["K1"] * (stroke - vector[CREEP])
        if "mullins" in self.truth.effects:
            top = max(vector[TOP], state.contraction)
            drag = drag + softening(self.truth, state, top, **self.truth.effects["mullins"])
        return float(pull(self.truth, state) - drag - self.load), float(size(self.truth, state))

    def memory_slopes(self, time, vector, state: State):
        """Time derivatives of what is remembered."""
        slopes = np.zeros(REST + 1)
        effects, muscle = self.truth.effects, self.truth.muscle
        if "creep" in effects:
            slopes[CREEP] = (muscle.length * state.contraction - vector[CREEP]) / effects["creep"]["tau"]
        if self.lag:
            slopes[PORT] = (self.pressure(time) - vector[PORT]) / self.lag["tau"]
        if self.remembers:
            path = self.path_speed(vector, time)
            if "presliding" in effects:
                slopes[DAHL] = (path - abs(path) * vector[DAHL]) / effects["presliding"]["x_s"]
            else:
                elements = vector[DAHL + 1 : REST]
                slides = (np.abs(elements) >= 1) & (np.sign(elements) == np.sign(path))
                slopes[DAHL + 1 : REST] = np.where(slides, 0.0, path / reaches(**effects["maxwell_slip"]))
        return slopes

    def path_speed(self, vector, time):
        """Speed of the braid along its own path."""
        ahead, behind = np.array(vector), np.array(vector)
        ahead[0], behind[0] = vector[0] + 1e-5 * vector[1], vector[0] - 1e-5 * vector[1]
        paths = [braid_path(self.truth.muscle, self.state(time, one)) for one in (ahead, behind)]
        return float(paths[0] - paths[1]) / 2e-5

    def slopes(self, time, vector, sign):
        """Right-hand side while the mass moves towards `sign` (0: held)."""
        out = self.memory_slopes(time, vector, self.state(time, vector))
        if sign == 0 and not self.remembers:
            return out
        force, friction = self.net(time, vector)
        if self.remembers:
            sign = self.remembered(vector)
        out[0], out[1] = vector[1], (force - sign * friction) / self.mass
        return out

    def remembered(self, vector) -> float:
        """Direction of friction as presliding or slip elements hold it."""
        return float(np.clip(vector[DAHL] + vector[DAHL + 1 : REST].mean(), -1, 1))

    def heading(self, time, vector) -> float:
        """Which way the resting mass sets off; 0 where friction holds it."""
        force, friction = self.net(time, vector)
        if self.remembers:
            surplus = force - self.remembered(vector) * friction
            return float(np.sign(surplus)) if abs(surplus) > 1e-6 else 0.0
        return float(np.sign(force)) if abs(force) > friction * (1 + 1e-9) + 1e-9 else 0.0

    def run(self, times):
        """Position at `times`, one smooth piece after the other."""
        vector, now, place = self.start(), 0.0, np.zeros(len(times))
        end = float(times[-1])
        for _ in range(1000):
            sign = self.heading(now, vector)
            piece = self.piece(now, end, vector, sign)
            inside = (times >= now) & (times <= piece.t[-1])
            place[inside] = piece.sol(times[inside])[0]
            vector, now = piece.y[:, -1].copy(), float(piece.t[-1])
            if now >= end - 2e-9:
                place[times >= now] = vector[0]
                return place
            vector[1] = 0.0
            # Between two stops the motion has one direction, so its largest contraction is at one of them.
            vector[TOP] = max(vector[TOP], self.state(now, vector).contraction)
            if sign == 0:
                # Leave the exact edge of sticking by one tiny step, or the same event fires again.
                now = min(end, now + 1e-9)
        raise RuntimeError("the mass never stops chattering")

    def piece(self, now, end, vector, sign):
        """Integrate until the mass stops, or until friction lets it go."""

        def stops(time, y, _sign):
            return y[1]

        def breaks_loose(time, y, _sign):
            force, friction = self.net(time, y)
            return abs(force) - friction * (1 + 2e-9) - 2e-9

        event = stops if sign else breaks_loose
        # Friction with memory never sticks hard; only the rubber's largest strain needs the turning points then.
        unbroken = self.remembers and (sign == 0 or "mullins" not in self.truth.effects)
        event.terminal, event.direction = True, -sign if sign else 1.0
        return solve_ivp(
            self.slopes, (now, end), vector, args=(sign,), rtol=1e-7, atol=1e-9, dense_output=True,
            events=None if unbroken else event, max_step=0.01,
        )  # fmt: skip


def ridden(truth, pressures, load, run, times, noise: Noise, random, set_pressure=None):
    """Columns of one run in which the position is measured."""
    if set_pressure is None:
        place = Ride(truth, load, lambda _time: pressures[0]).run(times)
    else:
        place = Ride(truth, load, lambda time: float(np.interp(time, times, set_pressure)), hangs=True).run(times)
    columns = {
        "run": np.full(len(times), run),
        "time": times,
        "pressure": pressures + noise.pressure * random.standard_normal(len(times)),
        "displacement": disturbed(random, place, pressures, noise),
        "load": np.full(len(times), load),
        "clean": place,
    }
    return columns


def quick_release(
    truth: Truth, pressures=(5e5,), masses=(5.0, 10.0, 20.0, 30.0, 45.0, 60.0), duration=0.6, rate=500.0,
    noise=RULER, seed=0, file="quick_release.csv",
) -> Recording:  # fmt: skip
    """A mass (kg) on the muscle held at rest length under pressure, let go at t = 0. Noise in metres."""
    random, runs = np.random.default_rng(seed), []
    times = np.arange(round(duration * rate) + 1) / rate
    for level in pressures:
        for mass in masses:
            steady = np.full(len(times), level)
            runs.append(ridden(truth, steady, mass * GRAVITY, len(runs), times, noise, random))
    return gathered(runs, file, "quick release", "displacement", noise.sd)


def step(
    truth: Truth, levels=((1.5e5, 3e5), (1.5e5, 5e5)), masses=(10.0, 20.0), duration=1.5, rate=250.0, rise=0.02,
    noise=RULER, seed=0, file="step.csv",
) -> Recording:  # fmt: skip
    """The valve's set pressure goes from one level to another within `rise` seconds, 0.1 s after the start.

    The mass hangs at rest before that, where the frictionless pull carries it.
    """
    random, runs = np.random.default_rng(seed), []
    times = np.arange(round(duration * rate) + 1) / rate
    for low, high in levels:
        for mass in masses:
            port = np.interp(times, [0.1, 0.1 + rise], [low, high])
            columns = ridden(truth, port, mass * GRAVITY, len(runs), times, noise, random, set_pressure=port)
            columns["set_pressure"] = columns.pop("pressure")
            runs.append(columns)
    return gathered(runs, file, "step", "displacement", noise.sd)


NO_ISOTONIC = {"presliding", "maxwell_slip", "creep", "mullins", "viscous_damping", "hill", "pressure_drop"}


def balance(truth: Truth, time, pressure, load: float, sign: float):
    """Contraction at which pull - sign x friction = load, for a whole pressure history (bisection)."""
    low, high = np.full(len(pressure), -0.04), np.full(len(pressure), 0.55)
    for _ in range(52):
        middle = 0.5 * (low + high)
        state = felt(truth, State(middle, pressure, time, np.zeros_like(time)))
        state = State(state.contraction, state.pressure, time, 0.0, state.stretch)
        more = pull(truth, state) - sign * size(truth, state) > load
        low, high = np.where(more, middle, low), np.where(more, high, middle)
    return 0.5 * (low + high)


def isotonic(
    truth: Truth, masses=(8.0, 15.0, 25.0), turns=(1.5e5, 5e5, 1.5e5, 5e5, 1.5e5), ramp=0.5e5, samples=600,
    noise=RULER, seed=0, file="isotonic.csv",
) -> Recording:  # fmt: skip
    """Pressure swept slowly under a hung load: the position stays until friction is overcome (play operator)."""
    if NO_ISOTONIC & set(truth.effects):
        raise ValueError(f"no isotonic simulation with {sorted(NO_ISOTONIC & set(truth.effects))}")
    random, runs = np.random.default_rng(seed), []
    for mass in masses:
        load = mass * GRAVITY
        time, pressure = polyline(turns, ramp, samples, 0.02)
        up, down = balance(truth, time, pressure, load, 1.0), balance(truth, time, pressure, load, -1.0)
        place = [float(np.clip(0.5 * (up[0] + down[0]), up[0], down[0]))]
        for least, most in zip(up[1:].tolist(), down[1:].tolist(), strict=True):
            place.append(min(max(place[-1], least), most))
        pick = slice(None, None, len(time) // (samples - 1))
        stroke = truth.muscle.length * np.array(place)[pick]
        runs.append({
            "run": np.full(len(stroke), len(runs)),
            "time": time[pick],
            "pressure": pressure[pick],
            "displacement": disturbed(random, stroke, pressure[pick], noise),
            "load": np.full(len(stroke), load),
            "clean": stroke,
        })  # fmt: skip
    return gathered(runs, file, "isotonic", "displacement", noise.sd)
