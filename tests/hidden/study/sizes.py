"""How large an effect must be to leave a given misfit once the baseline has been refitted to it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq

from ..physics import BLADDERS
from ..simulator import FRICTIONS, TYPICAL, TYPICAL_STRANGERS, Noise, Recording, Truth, with_baseline
from .protocols import PROTOCOLS, WHOLE, Protocol

INFINITE = float("inf")
QUIET = Noise(sd=0.0)
FINE = 200  # samples of a run while a size is looked for
RAMP, SINE = 0.95, 0.1  # of the median, of the highest speed: slower is next to a turning point
LARGEST = 30.0  # times the typical size: beyond, an effect is called invisible
SMALLEST = 1e-4
RUBBER = {"bladder_neo_hookean": {"G": 3e5}}
NEEDS_RUBBER = ("bladder_hysteresis", "mullins")
ALL_TYPICAL = {**TYPICAL, **TYPICAL_STRANGERS}

# The value at which a parameter does nothing; what is not listed is a shape. Amplitudes not named here vanish at 0.
ABSENT = {
    "series_compliance": {"k_s": INFINITE},
    "tip": {"k": 1.0},
    "tip_pressure": {"b_k": 1.0, "a_k": 0.0},
    "strand_stretch": {"EA": INFINITE},
    "end_stop": {"K": 0.0},
    "textile_friction": {"beta": 1.0},
    "kinetic_friction": {"ratio": 1.0},
    "maxwell_slip": {"x_s": 0.0},
    "hill": {"b": INFINITE},
    "creep": {"K1": 0.0},
    "mullins": {"m": 0.0},
    "strain_bump": {"A": 0.0},
    "pressure_stair": {"A": 0.0},
    "screw_ripple": {"A": 0.0},
    "pressure_squared_spring": {"A": 0.0},
    "warming_gain": {"g": 0.0},
    "speed_hump": {"A": 0.0},
    "striped_friction": {"A": 0.0},
    "pressure_speed_spring": {"A": 0.0},
}
# What is physically sensible, and inside the range that a search may use; sizes stop there.
RANGES = {
    "pressure_offset.P_off": (-4.5e4, 4.5e4),
    "pressure_gain.g": (-0.25, 0.25),
    "contraction_offset.eps_off": (-0.04, 0.04),
    "supply_lag.tau": (2e-4, 4.0),
    "pressure_drop.tau": (0.0, 0.4),
    "dead_band.P_th": (0.0, 9e4),
    "radial_gap.gap": (0.0, 0.25),
    "series_compliance.k_s": (1.5e4, 5e7),
    "tip.k": (0.6, 1.6),
    "tip_pressure.b_k": (0.6, 1.6),
    "tip_pressure.a_k": (-0.45, 0.45),
    "strand_stretch.EA": (1.5e4, 5e7),
    "conical_ends.k_c": (0.0, 0.9),
    "reduced_length.factor": (0.0, 5.5),
    "bladder_ogden.n": (-11.0, 3.0),
    "textile_friction.beta": (0.25, 1.0),
    "kinetic_friction.ratio": (0.1, 15.0),
    "bladder_hysteresis.eta_b": (0.0, 0.45),
    "presliding.x_s": (2e-5, 0.08),
    "maxwell_slip.x_s": (2e-5, 0.08),
    "hill.b": (2e-3, 50.0),
    "mullins.m": (0.0, 0.8),
    "force_gain.g": (-0.25, 0.25),
    "time_delay.tau": (0.0, 0.8),
    "constant_friction.F_c": (0.0, 150.0),
    "warming_gain.g": (0.0, 0.5),
}


def base_of(hidden) -> dict[str, dict[str, float]]:
    """What the modeller knows: cylinder, Coulomb, and rubber where what is hidden acts on rubber."""
    return {**with_baseline(), **(RUBBER if set(hidden) & set(NEEDS_RUBBER) else {})}


def shape_keys(name: str) -> tuple[str, ...]:
    """Parameters that say how an effect looks, not how large it is."""
    amplitudes = ABSENT.get(name, ALL_TYPICAL[name])
    return tuple(key for key in ALL_TYPICAL[name] if key not in amplitudes)


def scaled(name: str, size: float, shapes: dict[str, float]) -> dict[str, float]:
    """An effect's parameters at `size` times its typical size, its shapes multiplied by `shapes`."""
    absent = ABSENT.get(name, {})
    out = {}
    for key, typical in ALL_TYPICAL[name].items():
        if key in shape_keys(name):
            out[key] = typical * shapes.get(key, 1.0)
        elif absent.get(key, 0.0) == INFINITE:
            out[key] = typical / size
        else:
            out[key] = absent.get(key, 0.0) + size * (typical - absent.get(key, 0.0))
    return out


def sensible(name: str, given: dict[str, float]) -> bool:
    """Whether every parameter is within its range."""
    ranges = ((RANGES.get(f"{name}.{key}", (-INFINITE, INFINITE)), value) for key, value in given.items())
    return all(low <= value <= high for (low, high), value in ranges)


def most(name: str, shapes: dict[str, float]) -> float:
    """The largest size that is sensible."""
    grid = np.geomspace(SMALLEST, LARGEST, 400)
    return float(max((size for size in grid if sensible(name, scaled(name, size, shapes))), default=0.0))


def hiding(base: dict, hidden: dict[str, dict[str, float]]) -> Truth:
    """A muscle with a baseline and hidden effects, a hidden friction in the place of Coulomb's."""
    kept = {name: given for name, given in base.items() if not (name in FRICTIONS and set(hidden) & set(FRICTIONS))}
    kept = {n: g for n, g in kept.items() if not (n.startswith("bladder_neo") and is_bladder(hidden))}
    return Truth(WHOLE, {**kept, **hidden})


def is_bladder(hidden) -> bool:
    """Whether the hidden effects bring rubber of their own."""
    return any(name in BLADDERS and name not in RUBBER for name in hidden)


def clean(protocol: Protocol, truth: Truth) -> tuple[np.ndarray, np.ndarray]:
    """The force of all recordings without noise, and which samples are away from turning points."""
    made = protocol.recordings(truth, QUIET, samples=FINE)
    sines = [part.given.get("sine", False) for part in protocol.parts]
    moving = [away(recording, sine) for recording, sine in zip(made, sines, strict=True)]
    return np.concatenate([recording.clean for recording in made]), np.concatenate(moving)


def away(recording: Recording, sine: bool) -> np.ndarray:
    """Which samples count: all where the length is held or a point stands alone, else those that move fast enough."""
    columns, moving = recording.columns, np.ones(len(recording.clean), bool)
    if recording.test != "loop":
        return moving
    for run in np.unique(columns["run"]):
        mine = columns["run"] == run
        speed = np.abs(np.gradient(columns["displacement"][mine], columns["time"][mine]))
        moving[mine] = speed > (SINE * np.max(speed) if sine else RAMP * np.median(speed))
    return moving


def shares(protocol: Protocol, truth: Truth) -> np.ndarray:
    """How many samples of the data each of those of `clean` stands for, relative to the first recording's.

    Runs are thinned while a size is looked for and the points of a map are not: without this they would count more.
    """
    whole, fine = (protocol.recordings(truth, QUIET, samples=samples) for samples in (None, FINE))
    each = [len(a.clean) / len(b.clean) for a, b in zip(whole, fine, strict=True)]
    return np.concatenate([np.full(len(b.clean), share / each[0]) for share, b in zip(each, fine, strict=True)])


class Refit(NamedTuple):
    """What a refit of the baseline starts from; arrays over the samples of `clean`."""

    force: np.ndarray  # N
    moving: np.ndarray
    weight: np.ndarray  # of the moving samples: roots of their shares, of mean square 1
    slopes: np.ndarray  # (samples, parameters) of what a refit moves
    precision: np.ndarray  # of what is known of each parameter


@cache
def _refit(protocol: str, rubber: bool) -> Refit:
    """The baseline of a protocol."""
    plan = PROTOCOLS[protocol]
    base = Truth(WHOLE, base_of(NEEDS_RUBBER if rubber else ()))
    force, moving = clean(plan, base)
    slopes, precision = [], []
    for name, key in (("coulomb_friction", "f_s"), ("bladder_neo_hookean", "G"))[: 1 + rubber]:
        given = base.effects[name]
        more = {**base.effects, name: {**given, key: 1.01 * given[key]}}
        slopes.append((clean(plan, Truth(WHOLE, more))[0] - force) / 0.01)
        precision.append(0.0)
    for key, error in plan.errors.items():
        value = getattr(WHOLE, key)
        other = replace(WHOLE, **{key: value + 0.1 * error})
        ratio = other.length / WHOLE.length
        slopes.append((clean(plan.stretched(ratio), Truth(other, base.effects))[0] - force) / 0.1)
        precision.append(1.0)
    share = shares(plan, base)[moving]
    return Refit(force, moving, np.sqrt(share / share.mean()), np.stack(slopes, axis=1), np.array(precision))


def misfit(protocol: str, hidden: dict[str, dict[str, float]], noise_sd: float, among: Sequence[str] = ()) -> float:
    """Rms force (N) that hidden effects leave once the baseline has been refitted (linearly) to them.

    `among` names what else will be hidden: the baseline knows rubber where one of them acts on rubber.
    """
    base = base_of({*hidden, *among})
    known = _refit(protocol, "bladder_neo_hookean" in base).force
    change = clean(PROTOCOLS[protocol], hiding(base, hidden))[0] - known
    return float(np.sqrt(np.mean(beside_refit(protocol, base, change, noise_sd) ** 2)))


def beside_refit(protocol: str, base: dict, change: np.ndarray, noise_sd: float) -> np.ndarray:
    """What a refit of the baseline, held by what is known of the geometry, leaves of a change of force.

    Weighted so that the mean square is that over all samples of the data, however they were thinned here.
    """
    refit = _refit(protocol, "bladder_neo_hookean" in base)
    slopes, change = refit.slopes[refit.moving], change[refit.moving]
    whole = np.vstack([refit.weight[:, None] * slopes / noise_sd, np.diag(refit.precision)])
    right = np.concatenate([refit.weight * change / noise_sd, np.zeros(len(refit.precision))])
    step = np.linalg.lstsq(whole, right, rcond=None)[0]
    return refit.weight * (change - slopes @ step)


def sized(
    protocol: str, name: str, target: float, shapes: dict[str, float], noise_sd: float, among: Sequence[str] = ()
) -> dict[str, float] | None:
    """Parameters at which an effect alone leaves `target` newtons (rms); None where no sensible size does."""

    def excess(log_size: float) -> float:
        left = misfit(protocol, {name: scaled(name, float(np.exp(log_size)), shapes)}, noise_sd, among)
        return np.log(max(left, 1e-9) / target)

    highest = np.log(most(name, shapes))
    lowest = np.log(SMALLEST)
    if not np.isfinite(highest) or excess(highest) < 0:
        return None
    if excess(lowest) > 0:  # a law that cannot be made small in this place
        return None
    found = brentq(excess, lowest, highest, xtol=0.01)
    return scaled(name, float(np.exp(found)), shapes)  # pyright: ignore[reportArgumentType, reportCallIssue]
