"""Designs by the million and by gradient, against numpy, numba and scipy doing the same arithmetic.

Times are of one process's processor time per design (`cpu`) and on the wall; where other work goes on, the first is the
one to compare. The share is of the bandwidth of a STREAM triad in numba on the same cores, 8 B for each number written.
"""

import dataclasses
import functools
import json
import os
import subprocess
import sys
import time

import jax
import numpy as np
import pytest
from scipy.optimize import Bounds, minimize

from mckibben_jax.design.batch import Batch, Engine, Histogram, Space, joined, nothing
from mckibben_jax.design.best import Limit, Task, limits_of, quantities_of, search_of, settle
from mckibben_jax.design.optimum import NEAR, Search, climb
from mckibben_jax.effects import IdealCylinder
from mckibben_jax.muscle import Muscle

numba = pytest.importorskip("numba")

MUSCLE = Muscle(length=0.3, radius=8e-3, braid_angle=np.radians(25.0), wall_thickness=1e-3, shear_modulus=0.54e6,
                breaking_stress=28e6)  # fmt: skip
RANGES = {
    "braid_angle": (np.radians(12.0), np.radians(40.0)), "radius": (4e-3, 12e-3), "wall_thickness": (0.3e-3, 3e-3),
}  # fmt: skip
BAR, EPS, P, G, SIGMA, L0 = 1e5, 0.1, 5e5, 0.54e6, 28e6, 0.3
OUTPUTS = (("force", {"contraction": EPS, "pressure": P}), ("minimum_pressure_thin", {}), ("burst_pressure", {}),
           ("gas_volume", {"contraction": EPS}), ("strand_length", {}))  # fmt: skip
LIMITS = (Limit("minimum_pressure_thin", max=BAR), Limit("burst_pressure", min=5 * BAR))
COUNT = int(os.environ.get("DESIGNS", "2000000"))
BINS, HIGH = 100, 1e4
COLUMNS = len(RANGES) + len(OUTPUTS)
PIECE = 2**18


def batch(count, best=0, limits=LIMITS):
    """Designs of a sample."""
    histogram = Histogram(0, 0.0, HIGH, BINS)
    return Batch(MUSCLE, (IdealCylinder(),), Space(RANGES, count), OUTPUTS, limits, 0, True, best, histogram)


@functools.cache
def steps():
    """What makes the sample: shifts and steps of the sequence, and the ranges, for the rivals."""
    from mckibben_jax.design.batch import turns

    shift = np.random.default_rng(0).integers(2**64, size=3, dtype=np.uint64)
    low, high = np.array(list(RANGES.values())).T
    return shift, np.array(turns(3), np.uint64), low, high - low


# The rivals ----------------------------------------------------------------------------------------------------------


def in_numpy(start, count):
    """Variables and outputs of a range of designs, a column each."""
    shift, turn, low, span = steps()
    number = np.arange(start, start + count, dtype=np.uint64)
    a, r, t = (low[j] + span[j] * ((number * turn[j] + shift[j] >> np.uint64(11)) * 2.0**-53) for j in range(3))
    cosine, sine = np.cos(a), np.sin(a)
    tan2 = (sine / cosine) ** 2
    force = np.pi * r * r * P * (3 / tan2 * (1 - EPS) ** 2 - 1 / sine**2)
    volume = np.pi * r * r * (1 + EPS * (2 - EPS) / tan2) * L0 * (1 - EPS) - np.pi * (r * r - (r - t) ** 2) * L0
    h0, end = t / r, 1 - 1 / (np.sqrt(3) * cosine)
    axial = 1 - end
    ratio = np.sqrt(1 + end * (2 - end) / tan2)
    hoop = thin(ratio, axial, h0)
    minimum = G * h0 / (1 - h0) / axial * (1 - 1 / (hoop**4 * axial**2))
    burst = SIGMA * h0 / ((1 - h0) * hoop**2 * axial)
    return a, r, t, force, minimum, burst, volume, L0 / cosine


def thin(ratio, axial, h0):
    """Hoop stretch of the bore of a thin wall: the positive root of (1 - h0) x^2 - (r/r0) x + h0/axial = 0."""
    return (ratio + np.sqrt(ratio * ratio - 4 * h0 * (1 - h0) / axial)) / (2 * (1 - h0))


@functools.cache
def in_numba():
    """The same, compiled for all cores: writing out, and keeping the best, a histogram and the feasible count."""
    shift, turn, low, span = steps()
    s3, one_thin = np.sqrt(3.0), numba.njit(inline="always", fastmath=False)(thin)

    @numba.njit(inline="always")
    def design(i):
        number = np.uint64(i)
        a = low[0] + span[0] * ((number * turn[0] + shift[0] >> np.uint64(11)) * 2.0**-53)
        r = low[1] + span[1] * ((number * turn[1] + shift[1] >> np.uint64(11)) * 2.0**-53)
        t = low[2] + span[2] * ((number * turn[2] + shift[2] >> np.uint64(11)) * 2.0**-53)
        cosine, sine = np.cos(a), np.sin(a)
        tan2 = (sine / cosine) ** 2
        force = np.pi * r * r * P * (3 / tan2 * (1 - EPS) ** 2 - 1 / (sine * sine))
        volume = np.pi * r * r * (1 + EPS * (2 - EPS) / tan2) * L0 * (1 - EPS) - np.pi * (r * r - (r - t) ** 2) * L0
        h0, end = t / r, 1 - 1 / (s3 * cosine)
        axial = 1 - end
        hoop = one_thin(np.sqrt(1 + end * (2 - end) / tan2), axial, h0)
        minimum = G * h0 / (1 - h0) / axial * (1 - 1 / (hoop**4 * axial * axial))
        return a, r, t, force, minimum, SIGMA * h0 / ((1 - h0) * hoop * hoop * axial), volume, L0 / cosine

    @numba.njit(parallel=True)
    def write(start, out):
        for i in numba.prange(out.shape[1]):
            (out[0, i], out[1, i], out[2, i], out[3, i], out[4, i], out[5, i], out[6, i], out[7, i]) = design(start + i)

    @numba.njit(parallel=True)
    def keep(count, parts):
        best, feasible = np.full(parts, -np.inf), np.zeros(parts, np.int64)
        counts = np.zeros((parts, BINS + 2), np.int64)
        for part in numba.prange(parts):
            top, met = -np.inf, 0
            mine = np.zeros(BINS + 2, np.int64)
            for i in range(count * part // parts, count * (part + 1) // parts):
                found = design(i)
                ok = found[4] <= BAR and found[5] >= 5 * BAR
                met += ok
                if ok and found[3] > top:
                    top = found[3]
                mine[min(max(int(np.floor(found[3] / HIGH * BINS)) + 1, 0), BINS + 1)] += 1
            best[part], feasible[part] = top, met
            counts[part] = mine
        return best.max(), feasible.sum(), counts.sum(axis=0)

    @numba.njit(parallel=True)
    def triad(a, b, c):
        for i in numba.prange(len(a)):
            a[i] = b[i] + 3.0 * c[i]

    return write, keep, triad


def kept_by_numpy(count, block=8192):
    """The best force, the feasible count and the histogram, in blocks that stay in the cache."""
    top, met, counts = -np.inf, 0, np.zeros(BINS + 2, int)
    for start in range(0, count, block):
        found = in_numpy(start, min(block, count - start))
        ok = (found[4] <= BAR) & (found[5] >= 5 * BAR)
        top, met = max(top, found[3][ok].max(initial=-np.inf)), met + ok.sum()
        place = np.clip(np.floor(found[3] / HIGH * BINS).astype(int) + 1, 0, BINS + 1)
        counts += np.bincount(place, minlength=BINS + 2)
    return top, met, counts


# Measuring -----------------------------------------------------------------------------------------------------------


def timed(run, rounds=3):
    """Least processor and wall time of some rounds, s, after a first call that compiles."""
    run()
    cpu, wall = [], []
    for _ in range(rounds):
        begin = time.process_time(), time.perf_counter()
        run()
        cpu.append(time.process_time() - begin[0])
        wall.append(time.perf_counter() - begin[1])
    return min(cpu), min(wall)


def report(benchmark, **times):
    """Nanoseconds for each design, ratios to the library."""
    for name, (cpu, wall) in times.items():
        benchmark.extra_info[f"{name}_cpu_ns"] = round(cpu / COUNT * 1e9, 1)
        benchmark.extra_info[f"{name}_wall_ns"] = round(wall / COUNT * 1e9, 1)
    ours = times["ours"]
    benchmark.extra_info |= {f"{name}_over_ours_cpu": round(t[0] / ours[0], 2) for name, t in times.items()}
    benchmark.extra_info |= {f"{name}_over_ours_wall": round(t[1] / ours[1], 2) for name, t in times.items()}
    print(benchmark.extra_info)


@functools.cache
def bandwidth():
    """Bytes a second of the triad a = b + 3 c, three arrays counted."""
    a, b, c = (np.ones(2**24) for _ in range(3))
    return 3 * a.nbytes / timed(lambda: in_numba()[2](a, b, c))[1]


def test_writing_every_output(benchmark):
    """Eight columns of each design into memory, in pieces, as a sweep hands them to its writer."""
    engine, out = Engine(batch(COUNT), PIECE), np.empty((COLUMNS, PIECE))
    write = in_numba()[0]

    def ours():
        for piece in range(engine.pieces):
            engine.rows(piece)

    def by_numba():
        for start in range(0, COUNT, PIECE):
            write(start, out[:, : min(PIECE, COUNT - start)])

    def by_numpy():
        for start in range(0, COUNT, 8192):
            found = in_numpy(start, min(8192, COUNT - start))
            for row, column in zip(out, found, strict=True):
                row[: len(column)] = column

    place, values, _ = engine.rows(0)
    mine = np.array([*place, *values])
    np.testing.assert_allclose(mine, np.array(in_numpy(0, mine.shape[1])), rtol=1e-9)
    write(0, out)
    np.testing.assert_allclose(out[:, : mine.shape[1]], mine, rtol=1e-9)
    benchmark.pedantic(ours, rounds=1)
    times = {"ours": timed(ours), "numpy": timed(by_numpy), "numba": timed(by_numba)}
    for name, (_, wall) in times.items():
        benchmark.extra_info[f"{name}_share_of_triad"] = round(8 * COLUMNS * COUNT / wall / bandwidth(), 3)
    report(benchmark, **times)


def test_keeping_the_best(benchmark):
    """The best design, a histogram and the feasible count."""
    engine = Engine(batch(COUNT, best=1), PIECE)

    def ours():
        found = nothing(engine.batch)
        for piece in range(engine.pieces):
            found = joined(found, engine.tally(piece, found.scores[-1] if len(found.scores) else -np.inf), engine.batch)
        return found

    keep = in_numba()[1]
    mine, theirs, plain = ours(), keep(COUNT, 64), kept_by_numpy(COUNT)
    assert mine.scores[0] == pytest.approx(theirs[0], rel=1e-12)
    assert int(mine.feasible) == theirs[1] == plain[1]
    assert np.abs(mine.counts - theirs[2]).sum() <= 4  # a value at the edge of a bin
    benchmark.pedantic(ours, rounds=1)
    report(benchmark, ours=timed(ours), numpy=timed(lambda: kept_by_numpy(COUNT)), numba=timed(lambda: keep(COUNT, 64)))


GROWTH = """
import json, re, sys, time
import jax
jax.config.update("jax_enable_x64", True)
sys.path.insert(0, sys.argv[2])
from test_sweep_bench import PIECE, Engine, batch, joined, nothing

def peak():  # of this process alone: what getrusage tells includes the parent's before the fork
    return int(re.search(r"VmHWM:\\s*(\\d+) kB", open("/proc/self/status").read())[1]) / 1024

count, begun = int(sys.argv[1]), time.perf_counter()
engine = Engine(batch(count, best=100), min(PIECE, count))
engine.tally(0)  # compiles
told = {"first_call_s": time.perf_counter() - begun, "peak_before_MB": peak()}
begun, cpu, found = time.perf_counter(), time.process_time(), nothing(engine.batch)
for piece in range(engine.pieces):
    floor = found.scores[-1] if len(found.scores) == 100 else float("-inf")
    found = joined(found, engine.tally(piece, floor), engine.batch)
told |= {"wall_ns": (time.perf_counter() - begun) / count * 1e9, "cpu_ns": (time.process_time() - cpu) / count * 1e9}
assert int(found.counts.sum()) == count and len(found.scores) == 100
print(json.dumps(told | {"peak_MB": peak(), "feasible": int(found.feasible)}))
"""


@pytest.mark.parametrize("count", [10**3, 10**4, 10**5, 10**6, 10**7, pytest.param(10**8, marks=pytest.mark.slow)])
def test_growth(benchmark, count):
    """Time for each design, and peak memory of a fresh process, as the sweep grows; 100 best and a histogram kept."""
    command = [sys.executable, "-c", GROWTH, str(count), os.path.dirname(__file__)]
    ran = benchmark.pedantic(lambda: subprocess.run(command, capture_output=True, text=True, check=True), rounds=1)
    told = json.loads(ran.stdout.splitlines()[-1])
    benchmark.extra_info |= {key: round(value, 1) for key, value in told.items()}
    print(f"{count:>12,}", benchmark.extra_info)
    assert told["peak_MB"] < told["peak_before_MB"] + 64  # whatever the count


# By gradient ---------------------------------------------------------------------------------------------------------

TASK = Task(MUSCLE, RANGES, "force", OUTPUTS[0][1], LIMITS, (IdealCylinder(),), starts=64)


class Differences(Search):
    """The same search as scipy does it unaided: SLSQP, slopes by differences; every call of the laws is counted."""

    def at(self, x):
        key = x.tobytes()
        if self._last is None or self._last[0] != key:
            self.calls += 1
            self._last = (key, np.array(in_numpy_at(self.low + x * self.span)), None)
        return self._last[1], None


def in_numpy_at(values):
    """Force, minimum and burst pressure of one design."""
    a, r, t = values
    tan2, sine, cosine = np.tan(a) ** 2, np.sin(a), np.cos(a)
    end = 1 - 1 / (np.sqrt(3) * cosine)
    hoop, h0 = thin(np.sqrt(1 + end * (2 - end) / tan2), 1 - end, t / r), t / r
    force = np.pi * r * r * P * (3 / tan2 * (1 - EPS) ** 2 - 1 / sine**2)
    minimum = G * h0 / (1 - h0) / (1 - end) * (1 - 1 / (hoop**4 * (1 - end) ** 2))
    return force, minimum, SIGMA * h0 / ((1 - h0) * hoop**2 * (1 - end))


def by_differences(search, x):
    """One start of scipy, as close to an optimum as ours."""
    found = minimize(
        search.cost, x, bounds=Bounds(0.0, 1.0), method="SLSQP", options={"ftol": NEAR, "maxiter": 200},
        constraints=[{"type": "ineq", "fun": search.gaps}],
    )  # fmt: skip
    return np.clip(found.x, 0.0, 1.0)


def test_sixty_four_starts(benchmark):
    """From the same places: calls of the model, processor time, starts that reach the optimum."""
    with jax.enable_x64(True):
        mine = search_of(TASK, quantities_of(TASK))
        usual = mine.aimed(0, 1.0, limits_of(TASK), 64)
        usual.__class__, usual._last, usual.calls = Differences, None, 0
        starts = mine.looked[:64]
        best = search_best(mine)

        def ours():
            return [climb(mine, x, NEAR) for x in starts]

        def theirs():
            return [by_differences(usual, x) for x in starts]

        counts = {}
        for name, search, run in (("ours", mine, ours), ("scipy", usual, theirs)):
            run()
            search.calls = 0
            ends = run()
            reached = sum(search.violation(x) <= 1e-6 and abs(search.cost(x) - best) < 1e-5 * abs(best) for x in ends)
            counts |= {f"{name}_calls": search.calls, f"{name}_reached": int(reached)}
        benchmark.pedantic(ours, rounds=1)
        one, other = timed(ours), timed(theirs)
        whole = timed(lambda: settle(dataclasses.replace(TASK, starts=8), mine.aimed(0, 1.0, limits_of(TASK), 8)))
    times = {"ours_cpu": one[0], "ours_wall": one[1], "scipy_cpu": other[0], "scipy_wall": other[1],
             "a_design_cpu": whole[0]}  # fmt: skip
    benchmark.extra_info |= counts | {f"{name}_ms": round(1e3 * seconds, 1) for name, seconds in times.items()}
    calls = counts["scipy_calls"] / counts["ours_calls"]
    ratios = {"calls": calls, "cpu": other[0] / one[0], "wall": other[1] / one[1]}
    benchmark.extra_info |= {f"scipy_over_ours_{name}": round(ratio, 2) for name, ratio in ratios.items()}
    print(benchmark.extra_info)
    assert counts["ours_reached"] >= counts["scipy_reached"] - 2


def search_best(search):
    """The least cost that any start reaches."""
    ends = [climb(search, x) for x in search.starts]
    return min(search.cost(x) for x in ends if search.violation(x) <= 1e-6)
