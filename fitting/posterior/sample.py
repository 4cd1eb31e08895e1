"""What the data leave open: the posterior of a fitted model, sampled by emcee on the rows that the fit minimised.

Likelihood: every reading errs normally, with the noise that the residual of its recording speaks for (`noise`): white,
fading from reading to reading, shared by a run. Instruments err as far as their accuracy goes (`instruments`). Leaving
readings out (`thinned`) costs little where errors are alike, and widens the posterior where they are independent.

Prior: as stated in model.toml, normal for values with `+/-` in muscle.toml, else uniform within the range of each
parameter (in the parameter, also where a search goes in its logarithm).

What no sampler can see is a wrong model: a stable chain around a wrong value. So the spread that is robust to whatever
a loop or a run shares stands beside, and the test that nothing is missing decides whether intervals are called
calibrated.
"""

import hashlib
import json
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import emcee
import numpy as np

from fitting.least_squares.record import Fit
from fitting.posterior.evaluation import log_probs
from fitting.posterior.moves import MOVES, Snooker
from fitting.posterior.noise import PARTS
from fitting.posterior.record import Posterior, describe, effective_samples, is_settled, save, to_json
from fitting.posterior.settings import SAMPLER
from fitting.posterior.setup import set_up
from fitting.posterior.store import Arrays, Store
from fitting.posterior.summary import summarise
from fitting.posterior.target import PosteriorProblem
from fitting.problem.priors import Prior
from fitting.recordings.records import Experiment
from fitting.threads import at_once

ChainProgress = Callable[[int, float], None]  # steps done, and the draws that they are worth
__all__ = ["Posterior", "Snooker", "describe", "sample", "save", "store_for", "to_json"]


def sample(
    fit: Fit,
    experiments: Sequence[Experiment] = (),
    *,
    seed: int = 0,
    walkers: int | None = None,
    ensembles: int = SAMPLER.ensembles,
    max_steps: int = 20_000,
    limit_s: float = 600.0,
    rows: int = SAMPLER.rows,
    priors: dict[str, Prior] | None = None,
    noise: Sequence[tuple[str, ...]] | None = None,
    chains: str | None = None,
    again: bool = False,
    progress: ChainProgress | None = None,
) -> Posterior:
    """Sample what a fit leaves open, from independent ensembles of walkers that start around its mode.

    Goes on until the chain is longer than 50 autocorrelation times and R-hat is below 1.01, or until `max_steps`, or
    `limit_s` seconds. `experiments`, those of the fit, allow thinning to about `rows` readings. `priors` by full name
    take the place of those of muscle.toml; `noise` gives the components of each recording's noise, which are chosen
    otherwise. `chains` names the file that keeps the chains as they grow: the same call goes on where it was, unless
    `again`. `progress` is told the steps taken and the effective samples so far. The same seed gives the same
    posterior, unless time ran out.
    """
    deadline = time.monotonic() + limit_s
    setup = set_up(fit, experiments, rows, priors, noise)
    count = walkers or max(SAMPLER.fewest_walkers, 2 * (2 * len(setup.names) // 2 + 1))
    plan = _Plan(seed, count, max(ensembles, 2), max_steps, deadline, progress)
    store = None if chains is None else store_for(chains, setup, experiments, plan.rules)
    if store and again:
        store.forget()
    setup, warm = _frame(setup, store, plan)
    z, steps, late = _grow(
        setup, plan, store and store.at("main"), warm, (min(SAMPLER.first_check, max_steps), max_steps)
    )
    timed = late and limit_s > 0  # without any time nothing is sampled: the chains are read as they are
    ended = f"after {limit_s:g} s ({steps} steps)" if timed else f"after {steps} steps"
    return summarise(fit, experiments, setup, _without_burn_in(z), ended, "emcee", seed)


def store_for(path: str, setup: PosteriorProblem, experiments: Sequence[Experiment], rules: Sequence[int]) -> Store:
    """The place of just this run in a file of chains."""
    subset, noise = setup.target.subset, setup.target.noise
    fixed = np.delete(np.asarray(subset.full), np.asarray(subset.free))
    known = {
        "rules": [SAMPLER.rules, emcee.__version__, *map(int, rules)],
        "data": sorted(e.sha256 for e in experiments),
        "rows": len(setup.samples),
        "names": setup.names,
        "effects": [f"{type(e)} {getattr(e, 'line', '')}" for e in setup.target.problem.templates[0].effects],
        "fixed": [f"{value:.9g}" for value in fixed],
        "ends": [f"{value:.9g}" for end in (subset.lower, subset.upper) for value in np.asarray(end)[subset.free]],
        "priors": {name: [p.kind, f"{p.first:.9g}", f"{p.second:.9g}"] for name, p in setup.priors.items()},
        "noise": [len(noise.lower), *PARTS],
        "instruments": [f"{s.channel}.{s.kind} {s.width:.9g}" for s in setup.errors.sources],
        "steps": [block.steps for block in setup.target.problem.blocks],
    }
    return Store(Path(path), hashlib.sha256(json.dumps(known, sort_keys=True).encode()).hexdigest()[:32])


# Growing chains -------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Plan:
    """How much is to be sampled, and until when."""

    seed: int
    walkers: int
    ensembles: int
    max_steps: int
    deadline: float
    progress: ChainProgress | None

    @property
    def rules(self) -> tuple[int, int, int]:
        """What the chains depend on."""
        return self.seed, self.walkers, self.ensembles


def _frame(setup: PosteriorProblem, store: Store | None, plan: _Plan) -> tuple[PosteriorProblem, np.ndarray]:
    """The problem in coordinates that a warm-up has whitened, and where its walkers ended."""
    kept = store and store.frame()
    if kept:
        return setup.in_coordinates(kept["centre"], kept["axes"]), kept["walkers"]
    random = np.random.default_rng((plan.seed, 0))
    start = SAMPLER.spread * random.standard_normal((plan.ensembles, plan.walkers, len(setup.names)))
    steps = min(SAMPLER.warm_up, plan.max_steps)
    z, _, late = _grow(setup, plan, store and store.at("warm-up"), start, (steps, steps), 1)
    whitened, walkers = _whiten(setup, z)
    if store and not late:
        target = whitened.target
        store.begin({"centre": np.asarray(target.centre), "axes": np.asarray(target.axes), "walkers": walkers})
    return whitened, walkers


def _whiten(setup: PosteriorProblem, z: np.ndarray) -> tuple[PosteriorProblem, np.ndarray]:
    """Coordinates in which the second half of a warm-up has mean 0 and unit spread, and its last walkers in these."""
    late = z[:, z.shape[1] // 2 :].reshape(-1, z.shape[-1])
    centre, factor = late.mean(axis=0), np.linalg.cholesky(np.cov(late.T) + 1e-9 * np.eye(z.shape[-1]))
    axes = np.asarray(setup.target.axes)
    whitened = setup.in_coordinates(np.asarray(setup.target.centre) + axes @ centre, axes @ factor)
    return whitened, np.linalg.solve(factor, (z[:, -1].reshape(-1, z.shape[-1]) - centre).T).T.reshape(z[:, -1].shape)


def _grow(
    setup: PosteriorProblem, plan: _Plan, store: Store | None, start: np.ndarray, checks: tuple[int, int], salt: int = 2
) -> tuple[np.ndarray, int, bool]:
    """Chains z (ensemble, step, walker, coordinate), their steps, and whether time ran out before they were enough."""
    blocks = store.blocks() if store else []
    parts = [block["chain"] for block in blocks]
    walkers = [
        _sampler(setup, plan, (number, salt), blocks[-1] if blocks else None) for number in range(plan.ensembles)
    ]
    at = [emcee.State(place) for place in (parts[-1][:, -1] if parts else start)]
    steps, (check, most) = sum(part.shape[1] for part in parts), checks
    stride = SAMPLER.first_stride
    while True:
        late = time.monotonic() > plan.deadline and steps > 0
        while check < steps and check < most:
            check = min(int(SAMPLER.check_growth * check) + 1, most)
        if late or steps >= check:
            z = np.concatenate(parts, axis=1)
            natural = setup.target.natural(_without_burn_in(z))
            if plan.progress:
                plan.progress(steps, effective_samples(natural))
            if late or steps >= most or is_settled(natural):
                return z, steps, late and steps < most
            check = min(int(SAMPLER.check_growth * steps) + 1, most)
        started, taken = time.monotonic(), min(stride, check - steps)
        for sampler in walkers:
            sampler.reset()
        at = _run(walkers, at, taken)
        parts.append(np.stack([np.asarray(sampler.get_chain()) for sampler in walkers]))
        steps += taken
        if store:
            store.append(len(parts), {"chain": parts[-1], **_states(walkers)})
        wanted = SAMPLER.patience * taken / (time.monotonic() - started)
        stride = int(np.clip(wanted, SAMPLER.first_stride, SAMPLER.stride))


def _run(walkers: Sequence[emcee.EnsembleSampler], at: Sequence[emcee.State], steps: int) -> list[emcee.State]:
    """Each ensemble some steps further, in threads of their own: compiled code leaves the interpreter alone."""
    one = lambda sampler, place: sampler.run_mcmc(place, steps, skip_initial_state_check=True)  # noqa: E731
    return at_once(len(walkers), one, walkers, at)


def _sampler(
    setup: PosteriorProblem, plan: _Plan, which: tuple[int, int], block: Arrays | None
) -> emcee.EnsembleSampler:
    log_prob = log_probs(setup.target, -(-plan.walkers // 2))
    sampler = emcee.EnsembleSampler(plan.walkers, len(setup.names), log_prob, moves=MOVES(), vectorize=True)
    # emcee's own wrapper prints every walker and a traceback when somebody types Ctrl-C
    sampler.log_prob_fn = log_prob  # pyright: ignore[reportAttributeAccessIssue]
    number = which[0]
    if block is None:
        seed = np.random.SeedSequence((plan.seed, *which))
        sampler.random_state = np.random.RandomState(np.random.MT19937(seed)).get_state()
    else:
        word, rest = block[f"random_{number}"], block[f"left_{number}"]
        sampler.random_state = ("MT19937", word, int(rest[0]), int(rest[1]), float(rest[2]))
    return sampler


def _states(walkers: Sequence[emcee.EnsembleSampler]) -> Arrays:
    """The random numbers' states, which a resumed chain goes on from."""
    found: Arrays = {}
    for number, sampler in enumerate(walkers):
        _, word, *rest = sampler.random_state
        found |= {f"random_{number}": np.asarray(word), f"left_{number}": np.asarray(rest, float)}
    return found


def _without_burn_in(chain: np.ndarray) -> np.ndarray:
    """What is kept of chains (ensemble, step, ...): all but the first quarter."""
    return chain[:, chain.shape[1] // SAMPLER.burn_in :]
