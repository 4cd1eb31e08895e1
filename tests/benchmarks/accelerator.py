"""Work that comes by the thousand, on whatever device JAX has: releases and designs, against the same on processors.

    python tests/benchmarks/accelerator.py [OUT.json]

A GPU is not needed: without one the figures are those of the processors, as they are with JAX_PLATFORMS=cpu. Times are
on the wall, since a process that waits for a GPU does no work of its own; each is the least of five after a first
call that compiles. Errors are the largest of fifteen releases against references of 1e-11 by `motion_rivals`.
"""

import importlib.util
import json
import sys
import time
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
from motion_rivals import release
from test_motion_bench import FACTORS, MASSES, MUSCLES, SAMPLE, TIMES, changed, largest, moved, tried_by_scipy

GOAL = 1e-5  # m
STEP = {"rayon": 1e-3, "iron": 5e-4}  # s: the coarsest that keep the goal, as `test_motion_bench` finds them
SIDE = "numba" if importlib.util.find_spec("numba") else "numpy"


def least(run, rounds=5) -> tuple[float, float]:
    """Seconds of the first call, and the least of the later ones."""
    seconds = []
    for _ in range(rounds + 1):
        begin = time.perf_counter()
        jax.block_until_ready(run())
        seconds.append(time.perf_counter() - begin)
    return seconds[0], min(seconds[1:])


def releases(name: str, copies: int) -> dict:
    """A thousand releases `copies` times in one call, each copy with a friction a little larger than the last."""
    many = jax.vmap(jax.vmap(lambda v, m: moved(v, m, STEP[name]), (None, 0)), (0, None))
    run = jax.jit(many)
    factors = (FACTORS + np.linspace(0, 1e-3, copies)[:, None]).ravel()
    vectors = jnp.array([changed(MUSCLES[name], factor) for factor in factors])
    masses = jnp.asarray(MASSES)
    first, later = least(lambda: run(vectors, masses))
    found = np.asarray(run(vectors[: len(FACTORS)], masses))
    ours = [found[list(FACTORS).index(f), list(MASSES).index(m)] for m, f in SAMPLE]
    references = [release(changed(MUSCLES[name], f), m, TIMES) for m, f in SAMPLE]
    count = len(factors) * len(MASSES)
    return {"what": f"{count:,} releases, {name}", "count": count, "first_s": first, "s": later,
            "error_m": largest(ours, references)}  # fmt: skip


def slopes_of_releases(name: str) -> dict:
    """Motions of a thousand releases with their slopes in the seven numbers of the muscle, by forward derivatives."""
    one = jax.jacfwd(lambda v, m: moved(v, m, STEP[name]))
    run = jax.jit(jax.vmap(jax.vmap(one, (None, 0)), (0, None)))
    vectors = jnp.array([changed(MUSCLES[name], factor) for factor in FACTORS])
    first, later = least(lambda: run(vectors, jnp.asarray(MASSES)), rounds=3)
    return {"what": f"1,000 releases with 7 slopes, {name}", "count": 1000, "first_s": first, "s": later}


def by_scipy(name: str) -> dict:
    """A thousand releases by solve_ivp, on one processor: its fastest method and coarsest tolerance within the goal."""
    took, error, how = min(entry for entry in tried_by_scipy(name, SIDE) if entry[1] <= GOAL)
    what = f"1,000 releases, {name}, solve_ivp ({SIDE}, {how}), one processor"
    return {"what": what, "count": 1000, "s": 1e3 * took, "error_m": error}


def designs(count: int) -> dict:
    """The hundred best designs, a histogram and the feasible count of a sample of `count`."""
    from test_sweep_bench import PIECE, Engine, batch, joined, nothing

    engine = Engine(batch(count, best=100), min(PIECE, count))

    def run():
        found = nothing(engine.batch)
        for piece in range(engine.pieces):
            floor = found.scores[-1] if len(found.scores) == 100 else -np.inf
            found = joined(found, engine.tally(piece, floor), engine.batch)
        return found.scores

    first, later = least(run, rounds=2)
    return {"what": f"{count:,} designs", "count": count, "first_s": first, "s": later}


def main(out: str | None) -> None:
    jax.config.update("jax_enable_x64", True)
    device = jax.devices()[0]
    print(f"{device.platform} ({device.device_kind}), jax {jax.__version__}", flush=True)
    told = []
    for name in MUSCLES:
        jobs = [lambda name=name: by_scipy(name), lambda name=name: slopes_of_releases(name)]
        jobs += [lambda name=name, n=n: releases(name, n) for n in (1, 10, 100)]
        told += [_told(job) for job in jobs]
    told += [_told(lambda n=n: designs(n)) for n in (10**6, 10**7)]
    if out:
        Path(out).write_text(json.dumps({"device": device.device_kind, "jax": jax.__version__, "told": told}, indent=1))


def _told(job) -> dict:
    row = job()
    remark = f", error {row['error_m']:.1e} m" if "error_m" in row else ""
    remark += f", first call {row['first_s']:.1f} s" if "first_s" in row else ""
    each = row["s"] / row["count"] * 1e6
    print(f"{row['what']:80} {row['s']:9.4f} s, {each:8.2f} us each{remark}", flush=True)
    return row


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else None)
