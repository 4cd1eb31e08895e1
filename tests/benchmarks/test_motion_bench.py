"""Moving muscles: the splitting step against scipy's solve_ivp with the same stick and slip, found by events.

Run with `pytest tests/benchmarks/test_motion_bench.py --benchmark-only --benchmark-group-by=group -s`. Each side takes
the coarsest setting whose largest error against a 1e-11 reference is within the goal, so that neither is crippled;
setting and error stand in `extra_info`. scipy's share of a thousand releases is timed on some of them and scaled.
Ratios are of processor time, all threads of the process counted, so that other work on the machine does not enter.
"""

import itertools
import subprocess
import sys
import time
from dataclasses import replace
from functools import cache
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from motion_rivals import ANGLE, IRON, LENGTH, PRESSURE, RAYON, G, Values, compiled, release, slopes
from scipy.optimize import least_squares

from fitting.least_squares.search import joined, rows_and_slopes, solve
from fitting.least_squares.shooting import begin_by_shooting
from fitting.least_squares.subset import subset_of
from fitting.problem.residuals import problem
from fitting.problem.unknowns import unknowns
from fitting.recordings.records import Experiment, Recording, Run
from mckibben_jax.effects import IdealCylinder, KineticFriction, TextileFriction, Tip, ViscousDamping
from mckibben_jax.model import model
from mckibben_jax.motion import motion
from mckibben_jax.muscle import Muscle

MUSCLES = {"rayon": RAYON, "iron": IRON}
TIMES = np.linspace(0, 1, 201)
MASSES = np.linspace(5, 40, 40)
FACTORS = np.linspace(0.8, 1.2, 25)  # of the friction: 40 loads x 25 muscles are a thousand releases
SAMPLE = [(mass, factor) for mass in MASSES[::8] for factor in FACTORS[::12]]
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


@cache
def reference(name):
    """1e-11 references of the sample."""
    return [release(changed(MUSCLES[name], f), m, TIMES) for m, f in SAMPLE]


@pytest.fixture(scope="module")
def numba_rates():
    pytest.importorskip("numba")
    return compiled()


@cache
def library(step):
    """A thousand releases in one call, on the grid of masses and frictions."""
    many = jax.vmap(jax.vmap(lambda v, m: moved(v, m, step), (None, 0)), (0, None))
    run = jax.jit(many)
    return lambda vectors, masses: np.asarray(jax.block_until_ready(run(vectors, masses)))


def vectors(values):
    return jnp.array([changed(values, f) for f in FACTORS])


def of_sample(found):
    return [found[list(FACTORS).index(f), list(MASSES).index(m)] for m, f in SAMPLE]


def longest_step(name, references, goal):
    """The longest step whose error on the sample is within the goal, what it runs, and the error."""
    for step in STEPS:
        run = library(step)
        error = largest(of_sample(run(vectors(MUSCLES[name]), jnp.asarray(MASSES))), references)
        if error <= goal:
            return run, step, error
    raise AssertionError(f"no step reaches {goal}")


@cache
def tried_by_scipy(name, side):
    """Processor time (s) of one release, largest error of the sample, and setting, for every method and tolerance."""
    rates, tried = slopes if side == "numpy" else compiled(), []
    references = reference(name)
    for method in METHODS:
        for rtol in TOLERANCES:
            how = {"method": method, "rtol": rtol, "atol": rtol * 1e-3}
            start = time.process_time()
            found = [release(changed(MUSCLES[name], f), m, TIMES, rates, **how) for m, f in SAMPLE]
            took = (time.process_time() - start) / len(SAMPLE)
            tried.append((took, largest(found, references), f"{method} {rtol:g}"))
            if tried[-1][1] <= min(GOALS):
                break
    return tried


GOALS = (1e-4, 1e-5, 1e-6)  # m


@pytest.mark.parametrize("goal", GOALS)
@pytest.mark.parametrize("name", MUSCLES)
def test_a_thousand_releases(benchmark, name, goal):
    pytest.importorskip("numba")
    values = MUSCLES[name]
    run, step, error = longest_step(name, reference(name), goal)
    benchmark.group = "a thousand releases"
    busy = []

    def timed():
        begin = time.process_time()
        run(vectors(values), jnp.asarray(MASSES))
        busy.append(time.process_time() - begin)

    benchmark.pedantic(timed, rounds=5)
    mine = min(busy)
    benchmark.extra_info.update(step=step, error_m=error, processor_s=mine)
    for side in ("numpy", "numba"):
        took, off, how = min(entry for entry in tried_by_scipy(name, side) if entry[1] <= goal)
        benchmark.extra_info[f"scipy_{side}"] = {"ratio": 1e3 * took / mine, "error_m": off, "how": how}
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
    busy = []

    def timed():
        begin = time.process_time()
        run()
        busy.append(time.process_time() - begin)

    benchmark.pedantic(timed, rounds=10)
    mine, best = min(busy), (np.inf, None)
    for method, rtol, width in itertools.product(METHODS, TOLERANCES, (1e-2, 1e-3, 1e-4)):
        how = {"method": method, "rtol": rtol, "atol": rtol * 1e-3}
        start = time.process_time()
        found = scipy_slopes(width, **how)
        took = time.process_time() - start
        if error(found) <= accuracy:
            best = min(best, (took, f"{method} {rtol:g}, steps of {width:g}"), key=lambda entry: entry[0])
    benchmark.extra_info.update(step=step, error=off, processor_s=mine, scipy=best[1], ratio=best[0] / mine)
    print(name, f"{mine * 1e3:.2f} ms", benchmark.extra_info)


FIT = {"f_s": (0.002, 0.1), "beta": (0.5, 1.2), "ratio": (0.5, 15.0), "v_s": (0.02, 1.0), "k": (0.9, 1.4),
       "B": (0.0, 500.0), "radius": (0.006, 0.008)}  # fmt: skip
HIDDEN = Values(f_s=0.018, beta=0.8, ratio=5.0, v_s=0.15, k=1.1, B=60.0, radius=0.0071)
SCATTER, STEPS_OF_FIT = 1e-4, 1000  # m; 1 ms
LOADS = np.array([8.0, 12.0, 18.0, 25.0, 32.0, 40.0])


def of_the_library(data, lower, upper):
    """The library's own problem for the six releases, and the subset that frees the seven within the same ranges."""
    runs = tuple(_run(f"{m:g} kg", m, row) for m, row in zip(LOADS, data, strict=True))
    recording = Recording("releases", "quick release", runs, SCATTER)
    muscle = Muscle(LENGTH, HIDDEN.radius, ANGLE)
    experiment = Experiment("bench", Path(), muscle, (recording,), {}, "")
    effects = [IdealCylinder(), Tip(), TextileFriction(), KineticFriction(), ViscousDamping()]
    layout = unknowns([experiment], effects)
    given, _ = problem([experiment], layout)
    taken = {"steps": STEPS_OF_FIT, "taken": jnp.asarray(float(STEPS_OF_FIT))}
    given = replace(given, blocks=tuple(replace(block, **taken) for block in given.blocks))
    names = ("textile_friction.f_s", "textile_friction.beta", "kinetic_friction.ratio", "kinetic_friction.v_s", "tip.k",
             "viscous_damping.B", "muscle.radius")  # fmt: skip
    subset = subset_of(layout, layout.start, names)
    at = np.asarray(subset.free)
    return given, replace(
        subset, lower=subset.lower.at[at].set(lower), upper=subset.upper.at[at].set(upper),
        logarithmic=jnp.zeros_like(subset.logarithmic),
    )  # fmt: skip


def _run(name, mass, contraction):
    zero, count = np.zeros(len(TIMES)), np.arange(len(TIMES))
    return Run(name=name, time=TIMES, pressure=zero + PRESSURE, contraction=contraction, rate=zero, pressure_rate=zero,
               measured=contraction * LENGTH, weight=zero + 1, branch=zero.astype(int), loop=zero.astype(int),
               half=zero.astype(int), row=count, load=zero + mass * G)  # fmt: skip


def test_a_fit_of_six_releases_in_seven_parameters(benchmark, numba_rates):
    """The library's search, plain and begun by multiple shooting, and scipy's trf, all from the same eight starts.

    trf runs twice: with the library's rows and slopes, so that only what these cost is compared, and, from four of the
    starts, with the rows of scipy's motions and differences of them.
    """
    scatter = np.random.default_rng(0)
    data = np.stack([release(HIDDEN, m, TIMES) for m in LOADS]) + scatter.normal(0, SCATTER, (6, 201)) / LENGTH
    lower, upper = np.array(list(FIT.values())).T
    places = scatter.uniform(0.05, 0.95, (8, 7))
    given, subset = of_the_library(data, lower, upper)

    def plain(begin):
        return joined(solve(given, subset, place) for place in np.asarray(begin))

    def shot(begin):
        return plain(begin_by_shooting(given, subset, begin, 8))

    ends, seconds = {}, {}
    for name, search in (("library", plain), ("library_shooting", shot)):
        search(places)  # compiles
        begin = time.process_time()
        ends[name] = 2 * np.asarray(search(places).ends.cost)
        seconds[name] = (time.process_time() - begin) / len(places)

    how = {"method": "LSODA", "rtol": 1e-7, "atol": 1e-10}
    last = {}

    def mine(place):
        if last.get("at") != place.tobytes():
            last.update(at=place.tobytes(), both=[np.asarray(x) for x in rows_and_slopes(given, subset, place)])
        return last["both"]

    def scipys(place):
        values = Values(*(lower + place * (upper - lower)))
        runs = np.stack([release(values, m, TIMES, numba_rates, **how) for m in LOADS])
        return ((runs - data) * LENGTH / SCATTER).ravel()

    def searched(residual, jac, places=places):
        begin = time.process_time()
        found = [2 * least_squares(residual, start, jac, bounds=(0, 1), max_nfev=60).cost for start in places]
        return np.array(found), (time.process_time() - begin) / len(places)

    benchmark.group = "fit of six releases"
    trf = lambda: searched(lambda at: mine(at)[0], lambda at: mine(at)[1])  # noqa: E731
    ends["trf_on_library"], seconds["trf_on_library"] = benchmark.pedantic(trf, rounds=1, warmup_rounds=1)
    ends["scipy"], seconds["scipy"] = searched(scipys, "2-point", places[:4])
    floor = 1.05 * min(each.min() for each in ends.values())
    benchmark.extra_info.update(
        {name: {"seconds_per_start": seconds[name], "reached": int(np.sum(found < floor)), "of": len(found),
                "ratio": seconds["scipy"] / seconds[name], "chi2": sorted(found.round(1).tolist())}
         for name, found in ends.items()}
    )  # fmt: skip
    assert np.sum(ends["library_shooting"] < floor) >= 1
    print(benchmark.extra_info)


MILLION = """
import sys, time
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
def peak():  # KiB; getrusage would count the parent that this process was forked from
    return int(next(line for line in open("/proc/self/status") if line.startswith("VmHWM")).split()[1])
base = peak()
f = jax.jit(both).lower(v, run).compile()
jax.block_until_ready(f(v, run))
begin = time.process_time(); jax.block_until_ready(f(v, run)); took = time.process_time() - begin
print(took, base / 1024, peak() / 1024)
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
