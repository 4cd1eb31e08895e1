"""Effective samples per second, against emcee as it is usually run: numpy, one walker at a time, stretch moves."""

import time

import emcee
import numpy as np
import pytest

from fitting.least_squares import fit
from fitting.posterior import sample
from mckibben_jax.effects import CoulombFriction, ForceOffset, IdealCylinder, Tip
from tests.test_posterior import MUSCLE, loops

EFFECTS = (IdealCylinder(), Tip(k=1.1), CoulombFriction(f_s=0.015), ForceOffset(F_off=3.0))
WALKERS, STEPS = 32, 600


@pytest.fixture(scope="module")
def found():
    """A fit of three parameters to 2000 readings."""
    return fit([loops(*EFFECTS, count=250, repeats=4)], EFFECTS, starts=2)


def usual(found):
    """The same log-probability in numpy, over k, f_s, F_off and log s."""
    s, r0, l0 = found.samples, float(MUSCLE.radius), float(MUSCLE.length)
    tan2, sin2 = np.tan(float(MUSCLE.braid_angle)) ** 2, np.sin(float(MUSCLE.braid_angle)) ** 2
    lower, upper = (ends[found.layout.at(found.free)] for ends in (found.layout.lower, found.layout.upper))

    def log_prob(at):
        (k, f_s, offset), log_s = at[:3], at[3]
        if np.any(at[:3] < lower) or np.any(at[:3] > upper):
            return -np.inf
        eps = k * s.contraction
        pull = np.pi * r0**2 * s.pressure * (3 / tan2 * (1 - eps) ** 2 - 1 / sin2)
        surface = 2 * np.pi * r0 * l0 / (np.sqrt(1 + eps * (2 - eps) / tan2) * (1 - eps))
        force = pull - f_s * surface * s.pressure * np.sign(s.rate) + offset
        return -0.5 * np.sum(((force - s.measured) / s.sigma * np.exp(-log_s)) ** 2) - len(s) * log_s

    return log_prob


def effective(chains):
    """Independent samples in chains (step, walker, parameter), after the first quarter."""
    chains = chains[len(chains) // 4 :]
    return chains.shape[0] * chains.shape[1] / emcee.autocorr.integrated_time(chains, tol=0).max()


def usual_rate(found, moves=None):
    """Effective samples per second of plain emcee, one ensemble."""
    random = np.random.RandomState(0)
    error = np.append(np.sqrt(np.diag(found.covariance)), 1 / np.sqrt(2 * len(found.samples)))
    start = np.append(found.vector[found.layout.at(found.free)], 0.0) + error * random.randn(WALKERS, 4)
    sampler = emcee.EnsembleSampler(WALKERS, 4, usual(found), moves=moves)
    begin = time.perf_counter()
    sampler.run_mcmc(start, STEPS)
    return effective(sampler.get_chain()) / (time.perf_counter() - begin)


def test_effective_samples_per_second(benchmark, found):
    assert found.free == ("tip.k", "coulomb_friction.f_s", "force_offset.F_off")
    told = []

    def ours():
        told.clear()
        sample(found, seed=1, walkers=WALKERS, ensembles=4, max_steps=STEPS, progress=lambda *seen: told.append(seen))

    ours()  # compiled
    benchmark.pedantic(ours, rounds=2)
    rate = told[-1][1] / benchmark.stats.stats.min
    plain, same_moves = usual_rate(found), usual_rate(found, [(emcee.moves.DEMove(), 1.0)])
    benchmark.extra_info.update(
        effective_per_s=rate, numpy_effective_per_s=float(plain), numpy_de_effective_per_s=float(same_moves),
        ratio=float(rate / plain), ratio_same_moves=float(rate / same_moves),
    )  # fmt: skip
    print({key: round(value, 2) for key, value in benchmark.extra_info.items()})
