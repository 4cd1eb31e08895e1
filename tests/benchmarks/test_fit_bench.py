"""Fits and screening: the library against scipy on the same model in numpy, and a box against a sine transform.

Run with `python -m pytest tests/benchmarks --benchmark-only`. Every side must reach the same optimum, which is
asserted; nothing is asserted about time. Times are processor times of the process, all its threads counted. Ratios are
printed at the end and stand in the saved `extra_info`.
"""

import time
from typing import NamedTuple

import jax
import jax.numpy as jnp
import lineax as lx
import numpy as np
import optimistix as optx
import pytest
from hidden.simulator import Muscle, Noise, Truth, dataset, loops, write
from rivals import Data, Rival
from scipy.stats import qmc
from telling import tell

from fitting.diagnosis.examine import Examiner
from fitting.diagnosis.lay_out import universe
from fitting.diagnosis.missing_effect import MissingEffectTest, missing_effect_test
from fitting.diagnosis.nuisance import Nuisance
from fitting.diagnosis.signatures import signatures
from fitting.least_squares.fit import fit
from fitting.least_squares.search import joined, solve
from fitting.least_squares.starts import starting_places
from fitting.least_squares.subset import Subset, subset_of
from fitting.problem.residuals import Problem, Samples, problem
from fitting.problem.unknowns import Unknowns, unknowns
from fitting.problem.varying import Varying
from fitting.recordings.experiment import read_experiment
from fitting.recordings.records import Experiment
from mckibben_jax import effects as library
from mckibben_jax.effect import name_of

SAME = 1e-6  # relative difference of costs between sides that reached the same optimum
NEAR = 1e-4  # as near as a sine comes to an optimum where it has no slope
STARTS = 64
OFF_EDGE = 1e-3  # a sine has no slope at the ends of the range
HIDDEN = {
    "inside": {"tip": {"k": 1.15}, "textile_friction": {"f_s": 0.016, "beta": 0.7}, "force_offset": {"F_off": 5.0}},
    "at its bound": {
        "tip": {"k": 1.15},
        "textile_friction": {"f_s": 0.02, "beta": 0.7},
        "constant_friction": {"F_c": -4.0},  # no muscle gives work away: the best that a fit may say is 0
        "viscous_damping": {"B": -100.0},
    },
    "screened": {"coulomb_friction": {"f_s": 0.012}, "tip": {"k": 1.1}},
}
MODELS = {
    "inside": ("tip", "textile_friction", "force_offset"),
    "at its bound": ("tip", "textile_friction", "constant_friction", "viscous_damping", "force_offset"),
}
FREE = {"inside": ("muscle.radius", "muscle.braid_angle"), "at its bound": ()}
STATED = {"inside": {}, "at its bound": {}, "screened": {"radius": 5e-5, "braid_angle": 3e-3}}  # errors of the ruler
DOZEN = (
    "pressure_offset", "pressure_gain", "contraction_offset", "dead_band", "tip", "end_stop", "linear_spring",
    "constant_friction", "kinetic_friction", "viscous_damping", "hill", "force_offset",
)  # fmt: skip
pytestmark = pytest.mark.benchmark(timer=time.process_time)
BEST: dict[tuple[str, str], float] = {}  # (group, side) to seconds of the best round: others disturb it least
TOLD: list[str] = []


class Case(NamedTuple):
    """One fit, laid out for both sides."""

    experiment: Experiment
    effects: tuple
    layout: Unknowns
    given: Problem
    subset: Subset
    names: tuple[str, ...]
    rival: Rival


# What is measured, and what is told of it ----------------------------------------------------------------------------


@pytest.fixture(scope="module", autouse=True)
def summary(request):
    """The ratios, told once all is measured."""
    yield
    tell(request.config, [*ratios(), *TOLD])


def ratios() -> list[str]:
    """Each group's best rounds over the library's."""
    lines = []
    for group, side in BEST:
        if side == "library":
            mine = BEST[group, side]
            rest = {s: t / mine for (g, s), t in BEST.items() if g == group and s != side}
            words = ", ".join(f"{s} {ratio:.3g} times as long" for s, ratio in rest.items())
            lines.append(f"{group}: library {1e3 * mine:.3g} ms; {words}")
    return lines


def measure(benchmark, group: str, side: str, run, rounds: int, **told):
    """First call apart, then warm ones; the library's side of a group runs first."""
    began = time.process_time()
    run()
    benchmark.group = group
    benchmark.extra_info.update(first_call_s=time.process_time() - began, **told)
    found = benchmark.pedantic(run, rounds=rounds)
    if benchmark.stats is not None:
        BEST[group, side] = benchmark.stats.stats.min
        benchmark.extra_info["times_the_library"] = BEST[group, side] / BEST.get((group, "library"), np.nan)
    return found


# The problems --------------------------------------------------------------------------------------------------------


def measured(folder, which: str) -> Experiment:
    """2,000 samples at five pressures and two speeds, with white noise."""
    noise = Noise(sd=0.6)
    truth = Truth(Muscle(), {"ideal_cylinder": {}, **HIDDEN[which]})
    recording = loops(truth, samples=200, turns=(0.0, 0.26, 0.0), noise=noise, seed=5)
    return read_experiment(write(dataset(truth, [recording], noise=noise, **STATED[which]), folder))


def kinds(*names: str) -> tuple:
    """Effects by name, the gas among them."""
    known = {name_of(kind): kind for kind in library.LIBRARY}
    return tuple(known[name]() for name in ("ideal_cylinder", *names))


def as_data(experiment: Experiment, samples: Samples) -> Data:
    muscle = experiment.muscle
    return Data(
        samples.contraction,
        samples.rate,
        samples.pressure,
        samples.measured,
        float(samples.sigma[0]),
        float(muscle.length),
        float(muscle.radius),
        float(muscle.braid_angle),
    )


def as_rival(layout: Unknowns, names: tuple[str, ...], data: Data, start: np.ndarray) -> Rival:
    at = layout.at(names)
    priors = {name: prior for name, i in zip(names, at, strict=True) if (prior := layout.entries[i].prior)}
    return Rival(names, layout.lower[at], layout.upper[at], start[at], data, priors)


def case(folder, which: str) -> Case:
    experiment, chosen = measured(folder, which), kinds(*MODELS[which])
    layout = unknowns([experiment], chosen)
    given, samples = problem([experiment], layout)
    names = Varying(free=FREE[which]).names(layout)
    subset = subset_of(layout, layout.start, names)
    data = as_data(experiment, samples)
    return Case(experiment, chosen, layout, given, subset, names, as_rival(layout, names, data, layout.start))


@pytest.fixture(scope="module", params=["inside", "at its bound"])
def fitted(request, tmp_path_factory) -> tuple[str, Case]:
    """Six parameters, 2,000 points; the optimum inside the ranges or two of it at the ends."""
    return request.param, case(tmp_path_factory.mktemp("muscle"), request.param)


def places(c: Case, count: int) -> np.ndarray:
    """Starts in the unit box: the declared ones, then spread over all of it but the muscle's own measurements."""
    declared = starting_places(c.layout, c.subset, c.names, 1, 0)
    spread = 0.02 + 0.96 * qmc.Sobol(len(c.names), rng=1).random(STARTS)
    own = np.array([name.startswith("muscle.") for name in c.names])
    return np.concatenate([declared, np.where(own, declared, spread)])[:count]


def unit_to_si(c: Case, begin: np.ndarray) -> np.ndarray:
    at = c.layout.at(c.names)
    return np.array([np.asarray(c.subset.vector(jnp.asarray(place)))[at] for place in begin])


# The sides: each returns the costs at which its searches ended --------------------------------------------------------


def by_library(c: Case, begin: np.ndarray) -> np.ndarray:
    return joined(solve(c.given, c.subset, place) for place in begin).ends.cost


@jax.jit
def _through_a_sine(given: Problem, subset: Subset, begin: jax.Array) -> jax.Array:
    solver = optx.LevenbergMarquardt(1e-6, 1e-5, linear_solver=lx.Normal(lx.Cholesky()))

    def rows(bent, args):
        given, subset = args
        return given.rows(subset.vector((1 + jnp.sin(bent)) / 2), subset.switches, subset.live)

    def one(place):
        bent = jnp.arcsin(2 * jnp.clip(place, OFF_EDGE, 1 - OFF_EDGE) - 1)
        found = optx.least_squares(rows, solver, bent, args=(given, subset), max_steps=200, throw=False)
        return 0.5 * jnp.sum(rows(found.value, (given, subset)) ** 2)

    return jax.lax.map(one, begin)


def by_sine(c: Case, begin: np.ndarray) -> np.ndarray:
    return np.asarray(_through_a_sine(c.given, c.subset, jnp.asarray(begin)))


def by_scipy(c: Case, begin: np.ndarray, method: str = "trf") -> np.ndarray:
    return np.array([c.rival.solved(method, x).cost for x in unit_to_si(c, begin)])


SIDES = {
    "library": by_library,
    "optimistix with a sine": by_sine,
    "scipy trf": by_scipy,
    "scipy lm": lambda c, begin: by_scipy(c, begin, "lm"),
}


def sides(which: str) -> list[str]:
    """MINPACK knows no ranges: it takes no part where the optimum is at one's end."""
    return [side for side in SIDES if not (which == "at its bound" and side == "scipy lm")]


def close(which: str, side: str) -> float:
    """How close a side must come to the best cost."""
    return NEAR if which == "at its bound" and side == "optimistix with a sine" else SAME


# (a) and (b) ---------------------------------------------------------------------------------------------------------


def test_both_sides_have_the_same_rows(fitted, benchmark):
    which, c = fitted
    begin = places(c, 8)
    mine = [np.asarray(c.given.rows(c.subset.vector(jnp.asarray(p)), c.subset.switches)) for p in begin]
    np.testing.assert_allclose(mine, [c.rival.rows(x) for x in unit_to_si(c, begin)], rtol=1e-9, atol=1e-8)
    assert len(c.names) == 6
    measure(benchmark, f"rows alone, {which}", "scipy", lambda: c.rival.rows(c.rival.start), 20)


@pytest.mark.parametrize("side", SIDES)
def test_one_fit(fitted, benchmark, side):
    which, c = fitted
    if side not in sides(which):
        pytest.skip("no ranges")
    begin = places(c, 1)
    cost = measure(benchmark, f"one fit, optimum {which}", side, lambda: SIDES[side](c, begin), 30)[0]
    best = by_library(c, begin)[0]
    benchmark.extra_info.update(cost=cost, samples=len(c.rival.data.force))
    assert cost == pytest.approx(best, rel=close(which, side))


def test_one_fit_with_all_that_is_told_of_it(fitted, benchmark):
    """Covariances, ties and bounds too, and everything laid out anew."""
    which, c = fitted
    run = lambda: fit([c.experiment], c.effects, free=FREE[which], starts=1)  # noqa: E731
    found = measure(benchmark, f"one fit, optimum {which}", "library from data to errors", run, 5)
    assert 0.5 * np.sum((found.residual / found.samples.sigma) ** 2) == pytest.approx(
        by_library(c, places(c, 1))[0], rel=SAME
    )
    if which == "at its bound":
        assert set(found.at_bound) == {"constant_friction.F_c", "viscous_damping.B"}


@pytest.mark.parametrize("side", SIDES)
def test_many_starts(fitted, benchmark, side):
    which, c = fitted
    rounds = 3 if which == "inside" or side == "library" else 1
    if side not in sides(which):
        pytest.skip("no ranges")
    begin = places(c, STARTS)
    costs = measure(benchmark, f"{STARTS} starts, optimum {which}", side, lambda: SIDES[side](c, begin), rounds)
    best = by_library(c, begin).min()
    reached = int(np.sum(costs <= best * (1 + SAME)))
    benchmark.extra_info["reached"] = reached
    TOLD.append(f"{STARTS} starts, optimum {which}: {side} reached it from {reached}")
    assert costs.min() == pytest.approx(best, rel=close(which, side))


# (c) -----------------------------------------------------------------------------------------------------------------


class Screening:
    """Which of a dozen effects is missing: by signatures and the test, or by refitting with each of them."""

    def __init__(self, experiment: Experiment):
        self.world = universe([experiment], kinds("coulomb_friction"), kinds(*DOZEN)[1:])
        self.base_fit = self.world.fit(frozenset(self.world.base), self.world.start)
        self.examiner = Examiner(self.world, self.base_fit, 0)
        self.data = as_data(experiment, self.world.samples)

    def signatures(self) -> np.ndarray:
        return signatures(self.world, self.base_fit, [(name, {}) for name in DOZEN])

    def by_signatures(self) -> MissingEffectTest:
        return self.tested(self.signatures())

    def tested(self, columns: np.ndarray) -> MissingEffectTest:
        t, examiner = self.base_fit, self.examiner
        return missing_effect_test(t.rows, Nuisance.of(t), columns, examiner.ground(t))

    def by_refits(self) -> np.ndarray:
        jobs = [(self.world.with_added([name]), self.base_fit.vector, [name]) for name in DOZEN]
        return np.array([trial.cost for trial in self.world.fit_all(jobs)])

    def rival(self, effects) -> Rival:
        return as_rival(self.world.layout, self.world.free(effects), self.data, self.base_fit.vector)

    def by_scipy(self) -> np.ndarray:
        return np.array([2 * self.rival(self.world.with_added([name])).solved().cost for name in DOZEN])


@pytest.fixture(scope="module")
def screening(tmp_path_factory) -> Screening:
    return Screening(measured(tmp_path_factory.mktemp("muscle"), "screened"))


def test_signatures_alone(screening, benchmark):
    """The part of screening that is compiled; the rest is the test by flips."""
    found = measure(benchmark, "screening a dozen effects", "signatures alone", screening.signatures, 9)
    assert np.all(np.isfinite(found))
    assert np.all(np.any(found, axis=0))


@pytest.mark.parametrize("side", ["library", "refits by the library", "scipy trf"])
def test_screening(screening, benchmark, side):
    runs = {"library": screening.by_signatures, "refits by the library": screening.by_refits}
    found = measure(benchmark, "screening a dozen effects", side, runs.get(side, screening.by_scipy), 9)
    base, trial = screening.rival(screening.base_fit.effects), screening.base_fit
    both = np.concatenate([trial.rows, trial.prior_rows])
    np.testing.assert_allclose(both, base.rows(base.start), rtol=1e-9, atol=1e-8)
    if side == "library":
        assert found.rejected
        assert found.p_effects[DOZEN.index("tip")] < found.level
    else:
        np.testing.assert_allclose(found, screening.by_refits(), rtol=SAME)
