"""Muscles drawn from the prior, measured by the simulator that shares no code with the program.

The prior is what the program is told: radius and braid angle as an owner states them, a rubber known within a factor,
friction somewhere in a range. Noise is of the four kinds that the program's likelihood can be.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import log
from pathlib import Path

import numpy as np

from fitting.problem.priors import Prior
from fitting.recordings.experiment import read_experiment
from fitting.recordings.records import Experiment
from mckibben_jax.effect import Effect
from mckibben_jax.effects import BladderNeoHookean, IdealCylinder, TextileFriction

from ..hidden.rig import correlated
from ..hidden.simulator import TYPICAL, Dataset, Muscle, Noise, Truth, loops, write

STATED = {"radius": (7e-3, 1e-4), "braid_angle": (float(np.radians(20.0)), float(np.radians(0.5)))}
PRIORS = {
    "bladder_neo_hookean.G": Prior("log-normal", 3e5, 1.3),
    "textile_friction.f_s": Prior("uniform", 0.008, 0.03),
    "textile_friction.beta": Prior("uniform", 0.6, 1.0),
}
PROTOCOL = {"turns": (0.0, 0.22, 0.07, 0.16, 0.0), "samples": 160}  # ten runs of two loops
SIGMA = 0.8  # N
NOISES = ("white", "AR(1)", "AR(1) and white", "white and an offset of each run")
# What may be left out: whatever such loops show. A gain or an offset of the rig that geometry makes up for, and what
# needs a pressure that moves, is no misfit at any size.
LEFT_OUT = (
    "tip", "tip_pressure", "dead_band", "radial_gap", "series_compliance", "conical_ends", "reduced_length",
    "end_stop", "linear_spring", "constant_friction", "kinetic_friction", "presliding", "maxwell_slip",
    "viscous_damping", "creep", "bladder_hysteresis", "mullins", "strand_bending", "force_offset", "time_delay",
)  # fmt: skip
SMALLEST, LARGEST = 0.03, 1.0  # times the effect's typical size


@dataclass(frozen=True)
class Drawn:
    """One muscle of the prior: what is true of what varies (SI), its readings, and the error of each."""

    truth: dict[str, float]
    experiment: Experiment
    errors: np.ndarray  # N, row by row of the file
    noise: str
    left_out: str | None
    scale: float


def draw(number: int, seed: int, folder: Path, leave_out: bool) -> Drawn:
    """Data set `number` of a study, written to a folder and read from there as a user's would be."""
    random = np.random.default_rng([seed, number, int(leave_out)])
    truth = from_prior(random)
    effects: dict[str, dict[str, float]] = {"ideal_cylinder": {}}
    for name in PRIORS:
        effect, key = name.split(".")
        effects.setdefault(effect, {})[key] = truth[name]
    hidden = LEFT_OUT[number % len(LEFT_OUT)] if leave_out else None
    scale = float(np.exp(random.uniform(log(SMALLEST), log(LARGEST))))
    if hidden:
        effects[hidden] = sized(hidden, scale)
    muscle = Muscle(
        radius=truth["muscle.radius"], braid_angle=truth["muscle.braid_angle"],
        shear_modulus=truth["bladder_neo_hookean.G"],
    )  # fmt: skip
    kind = NOISES[number % len(NOISES)]
    data, errors = measured(random, Truth(muscle, effects), kind)
    write(data, folder)
    return Drawn(truth, read_experiment(folder), errors, kind, hidden, scale)


def from_prior(random: np.random.Generator) -> dict[str, float]:
    """A truth, by full name."""
    found = {f"muscle.{name}": mean + sd * random.standard_normal() for name, (mean, sd) in STATED.items()}
    for name, prior in PRIORS.items():
        if prior.kind == "uniform":
            found[name] = random.uniform(prior.first, prior.second)
        else:
            found[name] = prior.first * prior.second ** random.standard_normal()
    return {name: float(value) for name, value in found.items()}


NEUTRAL = {"k": 1.0, "b_k": 1.0, "ratio": 1.0, "factor": 0.0}
SHAPES = ("P_k", "eps_s", "v_s", "x_s", "spread", "tau", "w")  # say where an effect acts, not how much


def sized(name: str, scale: float) -> dict[str, float]:
    """An effect so many times as far from doing nothing as it typically is."""
    found = {}
    for key, value in TYPICAL[name].items():
        away = 1.0 if key in SHAPES and name != "time_delay" and len(TYPICAL[name]) > 1 else scale
        away = 1 / scale if key in ("k_s",) else away  # a softer spring is more of it
        found[key] = NEUTRAL.get(key, 0.0) + away * (value - NEUTRAL.get(key, 0.0))
    return found


def measured(random: np.random.Generator, truth: Truth, kind: str) -> tuple[Dataset, np.ndarray]:
    """The muscle in the simulated rig, and the error of each reading (N)."""
    recording = loops(truth, noise=Noise(sd=0.0), **PROTOCOL)
    run = recording.columns["run"]
    errors = np.concatenate([ERRORS[kind](random, int(np.sum(run == one))) for one in np.unique(run)])
    columns = {**recording.columns, "force": recording.clean + SIGMA * errors}
    stated = {
        "length": "300 mm",
        "radius": "{:.9g} +/- {:.9g} mm".format(*(1e3 * x for x in STATED["radius"])),
        "braid_angle": "{:.12g} +/- {:.9g} deg".format(*np.degrees(STATED["braid_angle"])),
        "wall_thickness": "0.5 mm",
    }
    noisy = replace(recording, columns=columns, noise_sd=SIGMA)
    return Dataset("Drawn", stated, truth, (noisy,)), SIGMA * errors


ERRORS: dict[str, Callable[[np.random.Generator, int], np.ndarray]] = {
    NOISES[0]: lambda random, n: random.standard_normal(n),
    NOISES[1]: lambda random, n: correlated(random, n, 0.8),
    NOISES[2]: lambda random, n: 0.8 * correlated(random, n, 0.9) + 0.6 * random.standard_normal(n),
    NOISES[3]: lambda random, n: 0.9 * random.standard_normal(n) + 0.4 * random.standard_normal(),
}


def model() -> tuple[Effect, ...]:
    """The model that the data are drawn from, but for what is left out, at the middle of the prior."""
    return IdealCylinder(), BladderNeoHookean(G=3e5), TextileFriction(f_s=0.018, beta=0.8)
