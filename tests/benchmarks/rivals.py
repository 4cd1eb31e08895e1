"""The usual way, for comparison: a muscle in numpy, fitted by scipy with slopes by differences.

Written from the published equations and nothing of the library, as somebody would who sat down with the review and
scipy. Only what does not change between two evaluations is computed in advance, so that nothing here is slow on
purpose. SI units and radians; forces are positive when they pull.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import OptimizeResult, least_squares

TEXTILE_LOAD = 1000.0


@dataclass(frozen=True)
class Data:
    """Samples of force tests, one below the other."""

    contraction: np.ndarray
    rate: np.ndarray
    pressure: np.ndarray
    force: np.ndarray
    sigma: float
    length: float
    radius: float
    braid_angle: float


@dataclass(frozen=True)
class Rival:
    """One least-squares problem: what varies, its range, where a search starts, and the rows."""

    names: tuple[str, ...]
    lower: np.ndarray
    upper: np.ndarray
    start: np.ndarray
    data: Data
    priors: dict[str, tuple[float, float]]  # name to mean and standard deviation

    def rows(self, x: np.ndarray) -> np.ndarray:
        """Model minus measurement in standard deviations, and below it what the ruler said."""
        given = dict(zip(self.names, x, strict=True))
        known = [(given[name] - mean) / spread for name, (mean, spread) in self.priors.items()]
        return np.concatenate([(force(self.data, given) - self.data.force) / self.data.sigma, known])

    def solved(self, method: str = "trf", start: np.ndarray | None = None) -> OptimizeResult:
        """By scipy: `trf` within the ranges, or MINPACK's `lm` without them."""
        bounds = (self.lower, self.upper) if method == "trf" else (-np.inf, np.inf)
        inside = self.start if start is None else start
        if method == "trf":
            edge = 1e-10 * (self.upper - self.lower)
            inside = np.clip(inside, self.lower + edge, self.upper - edge)
        with np.errstate(invalid="ignore", over="ignore"):
            return least_squares(self.rows, inside, method=method, x_scale="jac", bounds=bounds)


# Physics -------------------------------------------------------------------------------------------------------------


def force(data: Data, given: dict[str, float]) -> np.ndarray:
    """What the load cell shows. An effect is there if its parameters are given."""
    contraction, pressure, rate = felt(data, given)
    pull = ideal(data, given, contraction, pressure) + springs(data, given, contraction)
    lost = friction(data, given, contraction, pressure, rate) * np.sign(rate)
    lost = lost + drag(data, given, contraction, pressure, rate)
    return pull - lost + given.get("force_offset.F_off", 0.0)


def felt(data: Data, given: dict[str, float]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Contraction, pressure and rate that the braid feels."""
    contraction, pressure, rate = data.contraction, data.pressure, data.rate
    if "pressure_offset.P_off" in given:
        pressure = pressure - given["pressure_offset.P_off"]
    if "pressure_gain.g" in given:
        pressure = pressure / (1 + given["pressure_gain.g"])
    if "contraction_offset.eps_off" in given:
        contraction = contraction - given["contraction_offset.eps_off"]
    if "dead_band.P_th" in given:
        pressure = np.maximum(pressure - given["dead_band.P_th"], 0.0)
    if "tip.k" in given:
        contraction, rate = given["tip.k"] * contraction, given["tip.k"] * rate
    return contraction, pressure, rate


def ideal(data: Data, given: dict[str, float], contraction: np.ndarray, pressure: np.ndarray) -> np.ndarray:
    """Eq 10."""
    radius, angle = geometry(data, given)
    a, b = 3 / np.tan(angle) ** 2, 1 / np.sin(angle) ** 2
    return np.pi * radius**2 * pressure * (a * (1 - contraction) ** 2 - b)


def springs(data: Data, given: dict[str, float], contraction: np.ndarray) -> np.ndarray | float:
    """Springs in parallel: a linear one, and one that acts beyond a contraction."""
    total = 0.0
    if "linear_spring.K" in given:
        total = total - given["linear_spring.K"] * data.length * contraction
    if "end_stop.K" in given:
        beyond = np.maximum(contraction - given["end_stop.eps_s"], 0.0)
        total = total - given["end_stop.K"] * data.length * beyond
    return total


def friction(
    data: Data, given: dict[str, float], contraction: np.ndarray, pressure: np.ndarray, rate: np.ndarray
) -> np.ndarray:
    """Size of dry friction: eqs 36 or 40, a part that knows no pressure, and what speed makes of it (eq 48)."""
    load = surface(data, given, contraction) * np.maximum(pressure, 0.0)
    if "textile_friction.f_s" in given:
        relative = np.maximum(load / TEXTILE_LOAD, 1e-300)
        size = given["textile_friction.f_s"] * TEXTILE_LOAD * relative ** given["textile_friction.beta"]
    else:
        size = given["coulomb_friction.f_s"] * load
    if "constant_friction.F_c" in given:
        size = size + given["constant_friction.F_c"]
    if "kinetic_friction.ratio" in given:
        fade = np.exp(-np.abs(data.length * rate) / given["kinetic_friction.v_s"])
        size = size * (given["kinetic_friction.ratio"] + (1 - given["kinetic_friction.ratio"]) * fade)
    return size


def drag(
    data: Data, given: dict[str, float], contraction: np.ndarray, pressure: np.ndarray, rate: np.ndarray
) -> np.ndarray | float:
    """What speed costs: in proportion to it, or by Hill's hyperbola while shortening."""
    total = 0.0
    if "viscous_damping.B" in given:
        total = total + given["viscous_damping.B"] * data.length * rate
    if "hill.b" in given:
        shortening = data.length * np.maximum(rate, 0.0)
        isometric = np.maximum(ideal(data, given, contraction, pressure), 0.0)
        total = total + (1 + given["hill.a_over_F0"]) * isometric * shortening / (shortening + given["hill.b"])
    return total


def surface(data: Data, given: dict[str, float], contraction: np.ndarray) -> np.ndarray:
    """Contact surface between strands, eq 35."""
    radius, angle = geometry(data, given)
    cosine = np.cos(angle) * (1 - contraction)
    sine = np.sqrt(np.maximum(1 - cosine**2, 1e-12))
    return np.pi * radius * data.length * np.sin(2 * angle) / (sine * cosine)


def geometry(data: Data, given: dict[str, float]) -> tuple[float, float]:
    """Radius and braid angle at rest."""
    return given.get("muscle.radius", data.radius), given.get("muscle.braid_angle", data.braid_angle)
