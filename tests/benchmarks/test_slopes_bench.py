"""Slopes of a diagnosis: two at a time, each beside what it needs, against all together through the whole library.

Run with `python -m pytest tests/benchmarks/test_slopes_bench.py --benchmark-only`. Both sides give the same slopes,
which is asserted; nothing is asserted about time. Times are processor times of the process with all its threads.
"""

import time
from dataclasses import replace

import numpy as np
import pytest
from telling import tell

from fitting import example_data, read_experiment
from fitting.diagnosis.diagnose import library_candidates
from fitting.diagnosis.lay_out import universe
from fitting.least_squares.search import rows_and_slopes
from mckibben_jax import CoulombFriction, IdealCylinder

pytestmark = pytest.mark.benchmark(timer=time.process_time)
ADDED = {
    "nothing": (),
    "rubber": ("bladder_neo_hookean",),
    "memory": ("creep",),
    "spring": ("series_compliance",),
    "rubber behind a spring": ("bladder_neo_hookean", "series_compliance"),
}
SHOWN = 14  # signatures at once, of effects without memory and with
BEST: dict[tuple[str, str], float] = {}


@pytest.fixture(scope="module", autouse=True)
def summary(request):
    """How many times as long all together take, told once all is measured."""
    yield
    groups = [group for group, side in BEST if side == "two at a time" and (group, "together") in BEST]
    tell(request.config, [
        f"{group}: two at a time {1e3 * BEST[group, 'two at a time']:.3g} ms, together "
        f"{BEST[group, 'together'] / BEST[group, 'two at a time']:.3g} times as long" for group in groups
    ])  # fmt: skip


@pytest.fixture(scope="module")
def world():
    """A shipped recording with the whole library, as a diagnosis lays it out."""
    experiment = read_experiment(example_data("muscle_a"))
    return universe([experiment], [IdealCylinder(), CoulombFriction()], library_candidates())


def subset_of(world, which: str):
    """The free parameters of a larger model, or the switches of many effects beside the model as it is."""
    if which in ADDED:
        effects = world.with_added(ADDED[which])
        return world.subset(effects, world.layout.at(world.free(effects)), world.start)
    names = [name for name in world.candidates if world.possible(world.with_added([name]), [name])][:SHOWN]
    at = [len(world.start) + 1 + list(world.effects).index(name) for name in names]
    return world.subset(frozenset(world.base), at, world.start, beside=names)


@pytest.mark.parametrize("side", ["two at a time", "together"])
@pytest.mark.parametrize("which", [*ADDED, "signatures"])
def test_slopes(benchmark, world, which, side):
    own = subset_of(world, which)
    alike = replace(own, varying=None, beside=None, live=own.live | own.beside.any(axis=0))
    given = own if side == "two at a time" else alike
    run = lambda: np.asarray(rows_and_slopes(world.problem, given, given.place(given.full))[1])  # noqa: E731
    found = run()  # compiled
    benchmark.group = which
    benchmark.pedantic(run, rounds=5)
    BEST[which, side] = benchmark.stats.stats.min
    count = int(own.varying)
    wanted = np.asarray(rows_and_slopes(world.problem, alike, alike.place(alike.full))[1])[:, :count]
    np.testing.assert_allclose(found[:, :count], wanted, rtol=1e-6, atol=1e-6 * np.abs(wanted).max())
