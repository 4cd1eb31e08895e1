"""Moving muscles: the splitting step against scipy's solve_ivp with the same stick and slip, found by events.

Run with `pytest tests/benchmarks/test_motion_bench.py --benchmark-only --benchmark-group-by=group -s`. Each side takes
the coarsest setting whose largest error against a 1e-11 reference is within the goal, so that neither is crippled;
setting and error stand in `extra_info`. scipy's share of a thousand releases is timed on some of them and scaled.
"""

import itertools
import subprocess
import sys
import time

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from motion_rivals import ANGLE, IRON, LENGTH, PRESSURE, RAYON, G, Values, compiled, release, slopes
from scipy.optimize import least_squares

from mckibben_jax import motion
from mckibben_jax.effects import IdealCylinder, KineticFriction, TextileFriction, Tip, ViscousDamping
from mckibben_jax.model import model
from mckibben_jax.muscle import Muscle

MUSCLES = {"rayon": RAYON, "iron": IRON}
TIMES = np.linspace(0, 1, 201)
MASSES = np.linspace(5, 40, 40)
FACTORS = np.linspace(0.8, 1.2, 25)  # of the friction: 40 loads x 25 muscles are a thousand releases
SAMPLE = [(mass, factor) for mass in MASSES[::8] for factor in FACTORS[::6]]
STEPS = (8e-3, 4e-3, 2e-3, 1e-3, 5e-4, 2.5e-4, 1.25e-4, 6.25e-5)
TOLERANCES = 10.0 ** -np.arange(3, 10)
METHODS = ("RK45", "DOP853", "LSODA")


def moved(values, mass, step=2.5e-4):
    """The library's release; `values` in the order of `Values`."""
    f_s, beta, ratio, v_s, k, damping, radius = values
    given = model(
        Muscle(LENGTH, radius, ANGLE), IdealCylinder(), Tip(k), TextileFriction(f_s, beta),
        KineticFriction(ratio, v_s), ViscousDamping(damping),
    )  # fmt: skip
    return motion.release(given, load=mass * G, pressure=PRESSURE, times=TIMES, step=step)


def changed(values: Values, factor: float) -> Values:
    return values._replace(f_s=values.f_s * factor)


def largest(found, expected) -> float:
    """Largest error, m."""
    return float(LENGTH * np.abs(np.asarray(found) - np.asarray(expected)).max())


@pytest.fixture(scope="module")
def expected():
    """1e-11 references of the sample."""
    return {name: [release(changed(v, f), m, TIMES) for m, f in SAMPLE] for name, v in MUSCLES.items()}


@pytest.fixture(scope="module")
def numba_rates():
    pytest.importorskip("numba")
    return compiled()


def library(step):
    """A thousand releases in one call, on the grid of masses and frictions."""
    many = jax.vmap(jax.vmap(lambda v, m: moved(v, m, step), (None, 0)), (0, None))
    run = jax.jit(many)
    return lambda vectors, masses: np.asarray(jax.block_until_ready(run(vectors, masses)))


def vectors(values):
    return jnp.array([changed(values, f) for f in FACTORS])


def coarsest_step(values, references, goal):
    """The longest step whose error on the sample is within the goal, what it runs, and the error."""
    for step in STEPS:
        run = library(step)
        found = run(vectors(values), jnp.asarray(MASSES))
        chosen = [found[list(FACTORS).index(f), list(MASSES).index(m)] for m, f in SAMPLE]
        error = largest(chosen, references)
        if error <= goal:
            return run, step, error
    raise AssertionError(f"no step reaches {goal}")


def fastest_scipy(values, references, goal, rates):
    """Method and tolerance that reach the goal on the sample in the least time, per release; and the error."""
    best = None
    for method in METHODS:
        for rtol in TOLERANCES:
            how = {"method": method, "rtol": rtol, "atol": rtol * 1e-3}
            start = time.perf_counter()
            found = [release(changed(values, f), m, TIMES, rates, **how) for m, f in SAMPLE]
            took = (time.perf_counter() - start) / len(SAMPLE)
            error = largest(found, references)
            if error <= goal:
                best = min(best or (np.inf, None, None), (took, how, error), key=lambda entry: entry[0])
                break
    return best


@pytest.mark.parametrize("goal", [1e-4, 1e-5, 1e-6])
@pytest.mark.parametrize("name", MUSCLES)
def test_a_thousand_releases(benchmark, expected, numba_rates, name, goal):
    values = MUSCLES[name]
    run, step, error = coarsest_step(values, expected[name], goal)
    benchmark.group = "a thousand releases"
    benchmark.pedantic(lambda: run(vectors(values), jnp.asarray(MASSES)), rounds=5)
    mine = benchmark.stats.stats.min
    benchmark.extra_info.update(step=step, error_m=error)
    for side, rates in (("numpy", slopes), ("numba", numba_rates)):
        took, how, off = fastest_scipy(values, expected[name], goal, rates)
        benchmark.extra_info[f"scipy_{side}"] = {"ratio": 1e3 * took / mine, "error_m": off, **how}
    print(name, goal, f"{mine * 1e3:.0f} ms", benchmark.extra_info)


@pytest.mark.parametrize(("name", "accuracy"), [("rayon", 1e-4), ("iron", 1e-3)])
def test_slopes_in_eight_numbers(benchmark, numba_rates, name, accuracy):
    """d x(t)/d(seven parameters and the mass) of one release, of the same accuracy as differences of scipy's runs."""
    values, mass = np.array([*MUSCLES[name]]), 20.0
    at = np.array([*np.where(values == 0, 20.0, values), mass])  # drag may not be 0 for relative differences

    def scipy_slopes(step, **how):
        columns = []
        for i, value in enumerate(at):
            ends = [at + np.eye(8)[i] * value * step * sign for sign in (1, -1)]
            runs = [release(Values(*end[:7]), end[7], TIMES, numba_rates, **how) for end in ends]
            columns.append((runs[0] - runs[1]) / (2 * step * value))
        return np.stack(columns, axis=1)

    truth = scipy_slopes(1e-4)
    error = lambda found: float((np.abs(found - truth).max(0) / np.abs(truth).max(0)).max())  # noqa: E731
    for step in STEPS:
        slope = jax.jit(jax.jacfwd(lambda x, step=step: moved(x[:7], x[7], step)))
        run = lambda slope=slope: np.asarray(slope(jnp.asarray(at)))  # noqa: E731
        off = error(run())
        if off <= accuracy:
            break
    assert off <= accuracy
    benchmark.group = "slopes"
    benchmark.pedantic(run, rounds=10)
    mine, best = benchmark.stats.stats.min, (np.inf, None)
    for method, rtol, width in itertools.product(METHODS, TOLERANCES, (1e-2, 1e-3, 1e-4)):
        how = {"method": method, "rtol": rtol, "atol": rtol * 1e-3}
        start = time.perf_counter()
        found = scipy_slopes(width, **how)
        took = time.perf_counter() - start
        if error(found) <= accuracy:
            best = min(best, (took, f"{method} {rtol:g}, steps of {width:g}"), key=lambda entry: entry[0])
    benchmark.extra_info.update(step=step, error=off, scipy=best[1], ratio=best[0] / mine)
    print(name, f"{mine * 1e3:.2f} ms", benchmark.extra_info)


FIT = {"f_s": (0.002, 0.1), "beta": (0.5, 1.2), "ratio": (0.5, 15.0), "v_s": (0.02, 1.0), "k": (0.9, 1.4),
       "B": (0.0, 500.0), "radius": (0.006, 0.008)}  # fmt: skip
HIDDEN = Values(f_s=0.018, beta=0.8, ratio=5.0, v_s=0.15, k=1.1, B=60.0, radius=0.0071)
LOADS = np.array([8.0, 12.0, 18.0, 25.0, 32.0, 40.0])


def test_a_fit_of_six_releases_in_seven_parameters(benchmark, numba_rates):
    """scipy's trf both times from the same starts: with the library's rows and slopes, or scipy's and differences.

    The search is the same, so that only what a row and a slope cost is compared, and how good they are.
    """
    scatter = np.random.default_rng(0)
    data = np.stack([release(HIDDEN, m, TIMES) for m in LOADS]) + scatter.normal(0, 1e-4, (6, 201)) / LENGTH
    lower, upper = np.array(list(FIT.values())).T
    starts = lower + (upper - lower) * scatter.uniform(0.05, 0.95, (8, 7))
    scale = lambda place: lower + place * (upper - lower)  # noqa: E731
    rows = lambda runs: ((runs - data) * LENGTH / 1e-4).ravel()  # noqa: E731
    many = jax.vmap(lambda v, m: moved(v, m, 1e-3), (None, 0))
    both = jax.jit(lambda v: (many(v, jnp.asarray(LOADS)), jax.jacfwd(many)(v, jnp.asarray(LOADS))))
    both(jnp.asarray(starts[0]))

    def mine(place):
        return rows(np.asarray(both(scale(place))[0]))

    def tangents(place):
        return np.asarray(both(scale(place))[1]).reshape(-1, 7) * (upper - lower) * LENGTH / 1e-4

    how = {"method": "LSODA", "rtol": 1e-7, "atol": 1e-10}

    def scipys(place):
        return rows(np.stack([release(Values(*scale(place)), m, TIMES, numba_rates, **how) for m in LOADS]))

    def searched(residual, jac):
        begin = time.perf_counter()
        ends = [
            least_squares(residual, (s - lower) / (upper - lower), jac, bounds=(0, 1), max_nfev=60).cost for s in starts
        ]
        return ends, (time.perf_counter() - begin) / len(starts)

    benchmark.group = "fit of six releases"
    kept = []
    benchmark.pedantic(lambda: kept.append(searched(mine, tangents)), rounds=1)
    theirs, took = searched(scipys, "2-point")
    floor = min(min(kept[0][0]), min(theirs)) * 1.02
    benchmark.extra_info.update(
        seconds_per_start=kept[0][1], reached=int(np.sum(np.array(kept[0][0]) < floor)), of=len(starts),
        scipy_seconds=took, scipy_reached=int(np.sum(np.array(theirs) < floor)), ratio=took / kept[0][1],
    )  # fmt: skip
    print(benchmark.extra_info)


MILLION = """
import sys, time, resource
import jax; jax.config.update("jax_enable_x64", True)
import numpy as np, jax.numpy as jnp
from mckibben_jax.effects import IdealCylinder, CoulombFriction, Presliding
from mckibben_jax.model import model
from mckibben_jax.muscle import Muscle
from mckibben_jax.state import State
count = int(sys.argv[1])
time_ = np.arange(count) * 1e-3
eps = 0.1 + 0.1 * np.sin(time_)
z = jnp.zeros(count)
run = State(jnp.asarray(eps), z + 3e5, jnp.asarray(0.1 * np.cos(time_)), z, z, z, jnp.asarray(time_))
def rows(v, run):
    return model(Muscle(0.3, v[2], 0.35), IdealCylinder(), CoulombFriction(v[0]), Presliding(v[1])).force(run)
def both(v, run):
    one = lambda t: jax.jvp(lambda w: rows(w, run), (v,), (t,))
    r, J = jax.vmap(one, out_axes=(None, 0))(jnp.eye(3))
    return J @ J.T, J @ r
v = jnp.array([0.012, 2e-3, 0.007])
base = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
f = jax.jit(both).lower(v, run).compile()
jax.block_until_ready(f(v, run))
begin = time.perf_counter(); jax.block_until_ready(f(v, run)); took = time.perf_counter() - begin
print(took, base / 1024, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)
"""


def test_a_million_samples_with_memory_in_one_step_of_a_fit(benchmark):
    """Rows, slopes in three parameters and normal equations, in a process of its own: seconds, and MiB at the peak."""
    words = [sys.executable, "-c", MILLION, "1000000"]
    said = []
    benchmark.pedantic(lambda: said.append(subprocess.run(words, capture_output=True, text=True, check=True).stdout))
    took, before, peak = map(float, said[0].split())
    benchmark.extra_info.update(step_s=took, peak_MiB=peak, before_MiB=before)
    assert peak < 2048
    print(benchmark.extra_info)
