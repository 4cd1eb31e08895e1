"""A quick look: importance sampling from Student's t around the mode, which says itself whether it may be believed.

Where the posterior is nearly normal this gives in a second what chains give in minutes. The check is Pareto's: the
weights' tail must be light, k-hat < 0.7 (Vehtari, Simpson, Gelman, Yao & Gabry 2024).
"""

from collections.abc import Sequence

import numpy as np

from fitting.least_squares.record import Fit
from fitting.posterior.evaluation import log_probs
from fitting.posterior.moves import around_mode, log_around_mode
from fitting.posterior.record import Posterior, arviz, khat_text
from fitting.posterior.settings import MOVE, QUICK
from fitting.posterior.setup import set_up
from fitting.posterior.summary import summarise
from fitting.problem.priors import Prior
from fitting.recordings.records import Experiment


def quick_look(
    fit: Fit,
    experiments: Sequence[Experiment] = (),
    *,
    seed: int = 0,
    draws: int = QUICK.draws,
    rows: int = QUICK.rows,
    priors: dict[str, Prior] | None = None,
    noise: Sequence[tuple[str, ...]] | None = None,
) -> Posterior:
    """The posterior of a fit's free parameters from weighted draws around its mode; arguments as in `sample`."""
    setup = set_up(fit, experiments, rows, priors, noise)
    random = np.random.default_rng(seed)
    z = around_mode(random.standard_normal((draws, len(setup.names))), random.chisquare(MOVE.tails, draws))
    log_weight = log_probs(setup.target, QUICK.batch)(z) - log_around_mode(z)
    log_weight = np.where(np.isfinite(log_weight), log_weight, -1e10)
    smoothed, khat = arviz().psislw(log_weight)
    weight = np.exp(np.asarray(smoothed))
    weight /= weight.sum()
    effective = 1 / np.sum(weight**2)
    messages = _warnings_of(float(khat), effective, draws)
    picked = z[random.choice(draws, draws, p=weight)]
    found = summarise(fit, experiments, setup, picked[None, :, None], "", "quick look", seed, unreliable=messages)
    return found.of_independent(effective, float(khat))


def _warnings_of(khat: float, effective: float, draws: int) -> tuple[str, ...]:
    """What speaks against the weights."""
    if khat < QUICK.khat and effective > QUICK.effective:
        return ()
    return (
        f"the quick look fails its own check: its {draws} draws are worth {effective:.0f} independent ones (wanted: "
        f"{QUICK.effective:.0f}), {khat_text(khat)}; leave --quick out",
    )
