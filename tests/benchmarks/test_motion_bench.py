"""Moving muscles: the splitting step against scipy's solve_ivp with the same stick and slip, found by events.

Run with `pytest tests/benchmarks/test_motion_bench.py --benchmark-only --benchmark-group-by=group`; the numbers in
brackets are ratios. `error_m` in the saved results is the largest error of either side, m.
"""

import dataclasses
import itertools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from stick_slip import G, Truth, constant, moved

from mckibben_jax import motion
from mckibben_jax.effects import CoulombFriction, IdealCylinder, KineticFriction
from mckibben_jax.model import model
from mckibben_jax.muscle import Muscle

MUSCLES = {"rayon": Truth(f_s=0.02, ratio=7.0), "iron": Truth(f_s=0.012, ratio=1.25)}
TIMES = np.linspace(0, 1, 201)
PRESSURE = 5e5
LOADS = np.linspace(5, 40, 100) * G
SCIPY = {"method": "RK45", "rtol": 1e-6, "atol": 1e-9, "max_step": np.inf}


def reference(truth, load, **method):
    return moved(truth, TIMES, load, constant(PRESSURE), **method)


def release(vector, load):
    given = model(
        Muscle(0.3, 0.007, np.radians(20)), IdealCylinder(), CoulombFriction(vector[0]), KineticFriction(*vector[1:])
    )
    return motion.release(given, load=load, pressure=PRESSURE, times=TIMES)


def vector(truth):
    return jnp.array([truth.f_s, truth.ratio, truth.v_s])


def differences(truth, load):
    """Central differences of scipy's run in friction, ratio and v_s."""
    columns = []
    for name, sign in itertools.product(("f_s", "ratio", "v_s"), (1, -1)):
        changed = dataclasses.replace(truth, **{name: getattr(truth, name) * (1 + sign * 1e-3)})
        columns.append(reference(changed, load, **SCIPY))
    return columns


def compiled(function):
    run = jax.jit(function)
    return lambda *given: np.asarray(jax.block_until_ready(run(*given)))


ONE = compiled(release)
MANY = compiled(jax.vmap(release, in_axes=(None, 0)))
SLOPES = compiled(jax.jacfwd(release))


def measure(benchmark, group, run, expected=None, rounds=5):
    benchmark.group = group
    found = run()  # compiles
    if expected is not None:
        benchmark.extra_info["error_m"] = float(0.3 * np.abs(np.asarray(found) - expected).max())
    benchmark.pedantic(run, rounds=rounds)


@pytest.mark.parametrize("name", MUSCLES)
@pytest.mark.parametrize("side", ["library", "scipy"])
def test_one_release(benchmark, name, side):
    truth, load = MUSCLES[name], 20 * G
    runs = {"library": lambda: ONE(vector(truth), load), "scipy": lambda: reference(truth, load, **SCIPY)}
    measure(benchmark, f"one release, {name}", runs[side], reference(truth, load), rounds=10)


@pytest.mark.parametrize("name", MUSCLES)
@pytest.mark.parametrize("side", ["library", "scipy"])
def test_a_hundred_releases(benchmark, name, side):
    truth = MUSCLES[name]
    runs = {
        "library": lambda: MANY(vector(truth), LOADS),
        "scipy": lambda: np.stack([reference(truth, load, **SCIPY) for load in LOADS]),
    }
    expected = np.stack([reference(truth, load) for load in LOADS])
    measure(benchmark, f"a hundred releases, {name}", runs[side], expected, rounds=3)


@pytest.mark.parametrize("side", ["library", "scipy"])
def test_slopes_of_a_release(benchmark, side):
    truth, load = MUSCLES["rayon"], 20 * G
    runs = {"library": lambda: SLOPES(vector(truth), load), "scipy": lambda: differences(truth, load)}
    measure(benchmark, "slopes in three parameters, rayon", runs[side])
