"""A posterior that was sampled before, out of its file of chains: nothing is sampled, and the file stays as it is."""

import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path

from fitting.least_squares.record import Fit
from fitting.posterior.record import Posterior
from fitting.posterior.sample import sample
from fitting.posterior.settings import SAMPLER
from fitting.posterior.store import copy_store
from fitting.problem.priors import Prior
from fitting.recordings.records import Experiment


def stored_posterior(
    kept: Path, fit: Fit, experiments: Sequence[Experiment], *, seed: int, priors: Mapping[str, Prior]
) -> Posterior | None:
    """The posterior of this model and these data that a file of chains holds; None where it holds none of them.

    InputError, OSError or sqlite3.Error where the file cannot be read.
    """
    steps = [0]
    with tempfile.TemporaryDirectory() as folder:
        copy = copy_store(kept, Path(folder))
        found = sample(
            fit, experiments, seed=seed, priors=dict(priors), limit_s=0.0, chains=str(copy),
            progress=lambda done, _: steps.append(done),
        )  # fmt: skip
    return found if steps[-1] >= SAMPLER.fewest_steps else None
