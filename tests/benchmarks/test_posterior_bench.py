"""Effective samples per second, against emcee as it is usually run: numpy, one walker at a time, stretch moves.

Every line of the table changes one thing. Both sides sample the same density: that is asserted, not assumed. Effective
samples are those of the parameter that has the fewest, by emcee's autocorrelation time, after a quarter as burn-in.
"""

import dataclasses
import time
from pathlib import Path

import emcee
import numpy as np
import pytest

from fitting.least_squares.fit import fit
from fitting.posterior.evaluation import log_probs
from fitting.posterior.moves import MOVES
from fitting.posterior.nuts import sample_nuts
from fitting.posterior.quick import quick_look
from fitting.posterior.sample import sample
from fitting.posterior.setup import set_up
from fitting.recordings.records import Experiment, Recording, Run
from mckibben_jax.effects import (
    BladderNeoHookean,
    ConstantFriction,
    CoulombFriction,
    ForceOffset,
    IdealCylinder,
    KineticFriction,
    TextileFriction,
    Tip,
)
from tests.stick_slip import G, Truth, constant, moved
from tests.test_posterior import MUSCLE, loops

EFFECTS = (IdealCylinder(), Tip(k=1.1), CoulombFriction(f_s=0.015), ForceOffset(F_off=3.0))
WALKERS, STEPS = 32, 1000
BASE = "numpy, one walker at a time, default moves"
WHITE = [("size",)]


@pytest.fixture(scope="module")
def static():
    """A fit of three parameters to 2000 readings, and its posterior: white noise, whose size is the fourth."""
    found = fit([loops(*EFFECTS, count=250, repeats=4)], EFFECTS, starts=2)
    assert found.free == ("tip.k", "coulomb_friction.f_s", "force_offset.F_off")
    return found, set_up(found, noise=WHITE)


def in_numpy(found):
    """The density in numpy, over k, f_s, F_off and the noise: flat in the parameters and in the logarithm of it.

    For one point, or for many (points, 4) at once.
    """
    s, r0, l0 = found.samples, float(MUSCLE.radius), float(MUSCLE.length)
    tan2, sin2 = np.tan(float(MUSCLE.braid_angle)) ** 2, np.sin(float(MUSCLE.braid_angle)) ** 2
    lower, upper = (ends[found.layout.at(found.free)] for ends in (found.layout.lower, found.layout.upper))

    def log_prob(at):
        k, f_s, offset, size = (at[..., i, None] for i in range(4))
        eps = k * s.contraction
        pull = np.pi * r0**2 * s.pressure * (3 / tan2 * (1 - eps) ** 2 - 1 / sin2)
        surface = 2 * np.pi * r0 * l0 / (np.sqrt(1 + eps * (2 - eps) / tan2) * (1 - eps))
        force = pull - f_s * surface * s.pressure * np.sign(s.rate) + offset
        likely = -0.5 * np.sum(((force - s.measured) / s.sigma / size) ** 2, axis=-1)
        inside = np.all((at[..., :3] >= lower) & (at[..., :3] <= upper), axis=-1) & (at[..., 3] > 0)
        return np.where(inside, likely - (len(s) + 1) * np.log(np.abs(at[..., 3])), -np.inf)

    return log_prob


def whitened(density, what):
    """A density over parameters as one over the coordinates that the library samples in, with the Jacobian.

    Plain numpy, everything that does not change beforehand: it is called for one walker at a time.
    """
    target = what.target
    ends, noise, which = target.subset, target.noise, np.asarray(target.subset.free)
    centre, axes = np.asarray(target.centre), np.asarray(target.axes).T
    log = np.append(np.asarray(ends.logarithmic)[which], np.asarray(noise.logarithmic))
    below, above = (
        np.append(np.asarray(own)[which], np.asarray(of_noise))
        for own, of_noise in ((ends.lower, noise.lower), (ends.upper, noise.upper))
    )
    searched = log[: len(which)]  # in the logarithm; the noise's ends are logarithms already
    below[: len(which)][searched] = np.log(below[: len(which)][searched])
    above[: len(which)][searched] = np.log(above[: len(which)][searched])
    width = above - below

    def log_prob(z):
        place = 0.5 * (1 + np.tanh(0.5 * (centre + z @ axes)))
        straight = below + place * width
        jacobian = np.log(place * (1 - place)) + np.where(log, straight, 0.0)
        return density(np.where(log, np.exp(np.where(log, straight, 0.0)), straight)) + np.sum(jacobian, axis=-1)

    return log_prob


def effective(chains):
    """Independent samples in chains (step, walker, parameter), after the first quarter."""
    chains = chains[len(chains) // 4 :]
    return chains.shape[0] * chains.shape[1] / emcee.autocorr.integrated_time(chains, tol=0).max()


def rate(log_prob, start, moves=None, vectorize=False, steps=STEPS):
    """Effective samples of one ensemble for each second of processor time, which other work does not change."""
    sampler = emcee.EnsembleSampler(*start.shape, log_prob, moves=moves, vectorize=vectorize)
    sampler.random_state = np.random.RandomState(1).get_state()
    log_prob(start) if vectorize else log_prob(start[0])  # compiled before the clock starts
    begin = time.process_time()
    sampler.run_mcmc(start, steps, skip_initial_state_check=True)
    return float(effective(sampler.get_chain()) / (time.process_time() - begin))


def worth(log_prob, start, moves, steps=400):
    """Effective samples for each evaluation of the density."""
    sampler = emcee.EnsembleSampler(*start.shape, log_prob, moves=moves, vectorize=True)
    sampler.random_state = np.random.RandomState(1).get_state()
    sampler.run_mcmc(start, steps, skip_initial_state_check=True)
    return float(effective(sampler.get_chain())) / (steps * len(start))


@pytest.mark.timeout(3600)
def test_a_static_model(benchmark, static):
    found, what = static
    plain, z = in_numpy(found), np.random.RandomState(0).randn(WALKERS, 4)
    ours, theirs = log_probs(what.target, WALKERS // 2), whitened(plain, what)
    values = ours(z) - np.array([theirs(point) for point in z])
    np.testing.assert_allclose(values, values[0], atol=1e-6)  # the same density
    np.testing.assert_allclose(ours(z) - theirs(z), values[0], atol=1e-6)  # of many points at once, too
    wide = np.random.RandomState(0).randn(4 * WALKERS, 4)
    many = log_probs(what.target, 2 * WALKERS)
    rates = {
        BASE: rate(plain, what.target.natural(z)),
        "numpy, whitened": rate(theirs, z),
        "numpy, whitened, our moves": rate(theirs, z, MOVES()),
        "numpy, whitened, our moves, 128 walkers": rate(theirs, wide, MOVES()),
        "numpy over all walkers at once": rate(plain, what.target.natural(z), vectorize=True),
        "numpy over all walkers at once, whitened, our moves": rate(theirs, z, MOVES(), vectorize=True),
        "numpy over all walkers at once, whitened, our moves, 128": rate(theirs, wide, MOVES(), vectorize=True),
        "compiled": rate(ours, z, vectorize=True),
        "compiled, DE moves": rate(ours, z, emcee.moves.DEMove(), vectorize=True),
        "compiled, our moves, 128 walkers": rate(many, wide, MOVES(), vectorize=True),
    }
    told = {}
    benchmark.pedantic(lambda: told.update(all=rate(ours, z, MOVES(), vectorize=True)), rounds=2)
    rates["compiled, our moves"] = told["all"]
    report(benchmark, rates, BASE)


def few():
    """Four coordinates, nearly normal: 2000 readings."""
    return fit([loops(*EFFECTS, count=250, repeats=4)], EFFECTS, starts=2), [("size",)]


def many():
    """Fifteen: four muscles share rubber and friction, each has its own radius, braid angle and noise."""
    effects = (IdealCylinder(), BladderNeoHookean(G=3e5), TextileFriction(f_s=0.02, beta=0.75))
    stated = {"muscle.radius": (7e-3, 1e-4), "muscle.braid_angle": (float(np.radians(20.0)), float(np.radians(0.5)))}
    experiments = []
    for number, length in enumerate((0.2, 0.25, 0.3, 0.35)):
        muscle = dataclasses.replace(MUSCLE, length=length, radius=7e-3 + 5e-5 * number)
        one = loops(*effects, muscle=muscle, priors=stated, pressure=4e5, count=80, repeats=1, seed=number)
        experiments.append(dataclasses.replace(one, name=f"Braid {number}", sha256=str(number)))
    return fit(experiments, effects, starts=2), [("size",)] * 4


def cut_off():
    """Three, of which two frictions that are not there lie at the end of their range; 60 readings."""
    found = fit([loops(IdealCylinder(), count=30, repeats=1, seed=4)],
                (IdealCylinder(), CoulombFriction(), ConstantFriction()), starts=2)  # fmt: skip
    return found, [("size",)]


@pytest.mark.timeout(3600)
@pytest.mark.parametrize("case", [few, many, cut_off])
def test_against_nuts_and_the_quick_look(benchmark, case):
    """Whole calls, compiled before: choice of the noise, mode, warm-up, and what is said about the chains."""
    found, white = case()
    calls = {
        "emcee": lambda: sample(found, seed=1, noise=white, limit_s=1e4),
        "nuts": lambda: sample_nuts(found, seed=1, noise=white, limit_s=1e4),
        "quick look": lambda: quick_look(found, seed=1, noise=white),
    }
    rates = {}
    for name, call in calls.items():
        call()
        begin = time.process_time()
        posterior = call()
        taken = time.process_time() - begin
        worth = min(q.ess_bulk for q in (*posterior.parameters.values(), *posterior.noise.values()))
        print(f"{name}: {taken:.1f} s, {worth:.0f} effective samples, settled: {posterior.settled}")
        rates[name] = worth / taken
    benchmark.pedantic(calls["quick look"], rounds=1)
    report(benchmark, rates, "nuts")


def releases(loads, truth, times):
    """Quick releases of a rayon muscle, simulated by scipy with events, noise 0.05 mm."""
    random, muscle = np.random.default_rng(0), dataclasses.replace(MUSCLE, wall_thickness=None)
    runs = []
    for number, load in enumerate(loads):
        clean = 0.3 * moved(truth, times, load, constant(5e5), method="RK45", rtol=1e-8, atol=1e-10)
        measured = clean + 5e-5 * random.standard_normal(times.size)
        still, count = np.zeros(times.size), np.zeros(times.size, int)
        runs.append(Run(name=str(number), time=times, pressure=still + 5e5, contraction=still, rate=still,
                        pressure_rate=still, measured=measured, weight=still + 1, branch=still, loop=count, half=count,
                        row=np.arange(times.size) + 2, load=still + load))  # fmt: skip
    return Experiment("Rayon", Path("."), muscle, (Recording("r.csv", "quick release", tuple(runs), 5e-5),), {}, "0")


@pytest.mark.timeout(3600)
def test_a_quick_release(benchmark):
    """Time of one log-density, which is the ratio of rates where steps, moves and walkers are the same on both sides.

    What the moves buy is measured on the compiled density alone: a chain of the other would take an hour.
    """
    truth, times, loads = Truth(f_s=0.02, ratio=7.0), np.linspace(0, 0.5, 101), np.array([15, 25, 35, 45, 60, 75]) * G
    experiment = releases(loads, truth, times)
    effects = (IdealCylinder(), CoulombFriction(f_s=0.02), KineticFriction(ratio=7.0, v_s=truth.v_s))
    found = fit([experiment], effects, starts=1)
    what = set_up(found, noise=WHITE)
    z = 0.5 * np.random.RandomState(0).randn(WALKERS, len(what.names))
    ours = log_probs(what.target, WALKERS // 2)
    ours(z)
    order = [found.free.index(f"{name}") for name in FREE]

    def theirs(at):
        values = at[order]
        now = dataclasses.replace(truth, **dict(zip(("f_s", "ratio", "v_s"), values, strict=True)))
        rows = [
            (0.3 * moved(now, times, load, constant(5e5), method="RK45", rtol=1e-6, atol=1e-9) - run.measured) / 5e-5
            for load, run in zip(loads, experiment.recordings[0].runs, strict=True)
        ]
        return -0.5 * np.sum((np.concatenate(rows) / at[-1]) ** 2) - (len(found.samples) + 1) * np.log(at[-1])

    density = whitened(theirs, what)
    begin = time.process_time()
    reference = np.array([density(point) for point in z[:8]])
    slow = (time.process_time() - begin) / 8
    difference = ours(z[:8]) - reference
    assert np.ptp(difference) < 0.5  # the same density, as far as both integrate it
    begin = time.process_time()
    benchmark.pedantic(lambda: ours(z), rounds=5)
    fast = (time.process_time() - begin) / 5 / WALKERS
    moves = {name: worth(ours, z, how) for name, how in (("default", None), ("our", MOVES()))}
    benchmark.extra_info.update(
        ms=1e3 * fast, solve_ivp_ms=1e3 * slow, ratio=slow / fast, moves=moves["our"] / moves["default"],
        ratio_with_moves=slow / fast * moves["our"] / moves["default"],
    )  # fmt: skip
    print({key: float(f"{value:.3g}") for key, value in benchmark.extra_info.items()})


FREE = ("coulomb_friction.f_s", "kinetic_friction.ratio", "kinetic_friction.v_s")


def report(benchmark, rates, against):
    """Rates and their ratios, printed and kept."""
    ratios = {f"{name} / {against}": value / rates[against] for name, value in rates.items()}
    benchmark.extra_info.update(rates | ratios)
    for name, value in rates.items():
        print(f"{name:50} {value:8.0f} effective samples/s of processor time  {value / rates[against]:7.2f}")
