"""Searches on a shipped muscle: how the unknowns are damped, and what that saves.

Run with `python -m pytest tests/benchmarks/test_search_bench.py --benchmark-only`. Every effect of the library is added
to a model with a rubber wall after Ogden, whose modulus and exponent stand in for each other along a curved valley, and
all sides search from the same places. What is asserted is that each side searched them all; how many steps it takes and
how low it ends is told. Times are processor times of the process with all its threads.
"""

import time
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import optimistix as optx
import pytest
from telling import tell

from fitting import example_data, read_experiment
from fitting.diagnosis.diagnose import library_candidates
from fitting.diagnosis.lay_out import universe
from fitting.least_squares.box import SETTINGS, BoxLevenbergMarquardt
from fitting.least_squares.search import rows_and_slopes
from mckibben_jax import CoulombFriction, IdealCylinder

pytestmark = pytest.mark.benchmark(timer=time.process_time)
STEPS = 60  # as in a diagnosis
NEAR = 1.01  # times the lowest cost that any side found: as good as that
SIDES = {"as it is": SETTINGS.own, "its own curvature (Marquardt)": 1.0, "all alike (Levenberg)": 0.0}


class Ended(NamedTuple):
    """The ends of all searches of one side, and the processor time that they took."""

    costs: np.ndarray
    steps: np.ndarray
    seconds: float


FOUND: dict[str, Ended] = {}


@pytest.fixture(scope="module", autouse=True)
def summary(request):
    """Steps, searches that hit the limit, and those that ended as low as any side did."""
    yield
    if not FOUND:
        return
    best = np.min([side.costs for side in FOUND.values()], axis=0)
    tell(request.config, [
        f"{name}: {side.steps.sum()} steps of {len(best)} searches, {np.sum(side.steps >= STEPS)} at the limit of "
        f"{STEPS}, {np.sum(side.costs <= NEAR * best)} as low as any; {side.seconds:.3g} s"
        for name, side in FOUND.items()
    ])  # fmt: skip


@pytest.fixture(scope="module")
def world():
    """A static map of a muscle whose rubber is seen clearly, with the whole library, as a diagnosis lays it out."""
    experiment = read_experiment(example_data("martens2017_dmsp20"))
    return universe([experiment], [IdealCylinder(), CoulombFriction()], library_candidates())


@pytest.fixture(scope="module")
def places(world):
    """Every model of rubber and one effect more, and the places from which it is searched."""
    found = []
    for name in world.candidates:
        effects = world.with_added(["bladder_ogden", name])
        if "bladder_ogden" not in effects or not world.possible(effects, ["bladder_ogden", name]):
            continue
        names = world.free(effects)
        subset = world.subset(effects, world.layout.at(names), world.start)
        found += [(subset, place) for place in world._starts(subset, names, world.start, ["bladder_ogden", name])]
    return found


def searching(world, own):
    """One compiled search: its cost, and its steps."""

    @eqx.filter_custom_jvp
    def rows(place, subset):
        return rows_and_slopes(world.problem, subset, place)[0]

    @rows.def_jvp
    def _(primals, tangents):
        value, slopes = rows_and_slopes(world.problem, primals[1], primals[0])
        return value, slopes @ tangents[0]

    @eqx.filter_jit
    def search(subset, place):
        solver = BoxLevenbergMarquardt(jnp.zeros_like(place), jnp.ones_like(place))
        solver = eqx.tree_at(lambda it: it.descent.own, solver, own)
        found = optx.least_squares(rows, solver, place, args=subset, max_steps=STEPS, throw=False)
        return found.state.f_info.as_min(), found.stats["num_steps"]

    return search


@pytest.mark.parametrize("side", SIDES)
def test_searches_beside_a_rubber_wall(benchmark, world, places, side):
    """The same searches by each way of damping, after one that compiles."""
    search = searching(world, SIDES[side])
    jax.block_until_ready(search(*places[0]))

    def all_of_them():
        return [search(subset, place) for subset, place in places]

    begin = time.process_time()
    ends = jax.device_get(benchmark.pedantic(all_of_them, rounds=1))
    costs, steps = np.array(ends).T
    FOUND[side] = Ended(costs, steps.astype(int), time.process_time() - begin)
    assert len(places) > 20
    assert np.all(np.isfinite(costs))
