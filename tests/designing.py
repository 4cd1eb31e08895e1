"""The muscle that the tests of designs begin with, what is asked of it, and its quantities."""

import dataclasses

import equinox as eqx
import numpy as np

from mckibben_jax.design.best import Limit, Task
from mckibben_jax.design.merit import QUANTITIES
from mckibben_jax.effects import IdealCylinder
from mckibben_jax.muscle import Muscle

MUSCLE = Muscle(length=0.3, radius=8e-3, braid_angle=np.radians(25.0), wall_thickness=1e-3, shear_modulus=0.54e6,
                breaking_stress=28e6)  # fmt: skip
BAR = 1e5
IDEAL = (IdealCylinder(),)
RANGES = {
    "braid_angle": (np.radians(12.0), np.radians(40.0)), "radius": (4e-3, 12e-3), "wall_thickness": (0.3e-3, 3e-3),
}  # fmt: skip
LIMITS = (
    Limit("stroke", {"pressure": 5 * BAR}, min=0.2),
    Limit("minimum_pressure_thin", max=BAR),
    Limit("burst_pressure", min=5 * BAR),
)
TASK = Task(MUSCLE, RANGES, "force", {"contraction": 0.1, "pressure": 5 * BAR}, LIMITS, IDEAL)
ALONE = dataclasses.replace(TASK, variables={"braid_angle": RANGES["braid_angle"]}, constraints=LIMITS[1:2])


def quantity(name, given, **at):
    """A quantity of a model."""
    return float(eqx.filter_jit(QUANTITIES[name].law)(given, at))


def grid(count):
    """Places all over the ranges."""
    axes = [np.linspace(*ends, count) for ends in RANGES.values()]
    return np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)
