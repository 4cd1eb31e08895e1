"""From chains to what they say: quantiles, how far to trust them, what the prior has to do with it."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fitting.diagnosis import omnibus
from fitting.diagnosis.flip_groups import flip_groups, rests_on_in_words
from fitting.diagnosis.missing_effect import Ground, missing_effect_test
from fitting.diagnosis.nuisance import Nuisance
from fitting.least_squares.record import Fit
from fitting.least_squares.uncertainty import clusters
from fitting.least_squares.working_noise import noise_from
from fitting.posterior.predict import bands
from fitting.posterior.record import (
    Draws,
    Missing,
    Posterior,
    arviz,
    convergence_warnings,
    correlation_steps,
    quantities,
)
from fitting.posterior.robust import most_asked, robust_share
from fitting.posterior.settings import SUMMARY
from fitting.posterior.setup import positions_in
from fitting.posterior.target import PosteriorProblem
from fitting.posterior.warnings import bent_notes, find_warnings, notes
from fitting.problem.residuals import Samples
from fitting.recordings.records import Experiment


def summarise(
    fit: Fit,
    experiments: Sequence[Experiment],
    setup: PosteriorProblem,
    z: np.ndarray,
    ended: str,
    method: str,
    seed: int,
    unreliable: tuple[str, ...] | None = None,
) -> Posterior:
    """The record of chains z (ensemble, step, walker, coordinate); `unreliable` is what else speaks against them."""
    natural = setup.target.natural(z)
    cluster = clusters(fit.samples, fit.slopes)[positions_in(fit.samples, setup.samples)]
    messages = convergence_warnings(setup.names, natural, ended) if unreliable is None else unreliable
    found = quantities(fit, setup, natural, robust_share(setup, z, cluster))
    missing = anything_missing(fit, seed)
    found_warnings = find_warnings(fit, found, setup, missing, most_asked(setup, z))
    some, time = z.reshape(-1, z.shape[-1]), correlation_steps(natural)
    thin = natural[:, :: max(1, int(time / 2)) if np.isfinite(time) else 1]  # two steps for each correlation time
    sensitivity = prior_sensitivity(setup, thin)
    return Posterior(
        parameters={name: replace(found[name], prior_sensitivity=sensitivity.get(name, 0.0)) for name in fit.free},
        noise={name: found[name] for name in setup.names[len(fit.free) :]},
        held=fit.held,
        draws=Draws(setup.names, thin),
        bands=bands(setup, some, np.random.default_rng(seed), experiments),
        readings=len(setup.samples),
        method=method,
        settled=not messages,
        missing=missing,
        warnings=(*messages, *found_warnings),
        notes=(*bent_notes(fit, found), *notes(fit, setup, cut_off(setup, z), missing, len(np.unique(cluster)))),
        calibrated=not found_warnings,
    )


def anything_missing(fit: Fit, seed: int) -> Missing | None:
    """The test with which a diagnosis begins: is anything at all missing? None where no force was measured."""
    force = np.array([block.of_force for block in fit.problem.blocks])[fit.samples.recording]
    if not force.any():
        return None
    kept = np.flatnonzero(force)[:: max(1, -(-int(force.sum()) // SUMMARY.tested))]
    samples = _renumber(fit.samples.where(kept))
    rows, slopes = (fit.residual / fit.samples.sigma)[kept], fit.slopes[kept]
    basis = omnibus.basis(samples)
    errors = fit.errors.at(kept)
    noise = noise_from(rows, np.hstack([basis.whole, slopes, errors.columns]), samples)
    priors = fit.prior_rows
    none = np.zeros((len(rows), 0))  # no candidate is asked for: the basis that knows no effect decides
    groups = flip_groups(samples, noise.memory)
    by = Nuisance(slopes, priors, fit.slopes[len(fit.samples) :])
    test = missing_effect_test(rows, by, none, Ground(samples, groups, basis, noise, errors, seed))
    return Missing(test.p, test.level, test.rejected, rests_on_in_words(groups.rests_on()))


def _renumber(samples: Samples) -> Samples:
    """Positions counted anew, so that neighbours are one apart."""
    position = np.arange(len(samples))
    for run in np.unique(samples.run):
        mine = samples.run == run
        position[mine] = np.arange(mine.sum())
    return replace(samples, position=position)


def prior_sensitivity(setup: PosteriorProblem, natural: np.ndarray) -> dict[str, float]:
    """How far each parameter moves when its priors are made sharper or wider (Kallioinen et al. 2022).

    0 where all are uniform; above 0.05 the prior has a say.
    """
    log = np.zeros(natural.shape[:-1])
    values = natural[..., : len(setup.priors)]
    for i, prior in enumerate(setup.priors.values()):
        log = log + prior.log_density(values[..., i])
    if not np.ptp(log) > 0:
        return {}
    chains = lambda a: np.moveaxis(a, 1, 2).reshape(-1, a.shape[1])  # noqa: E731
    posterior = {name: chains(natural[..., i]) for i, name in enumerate(setup.priors)}
    az = arviz()
    data = az.from_dict(posterior=posterior)
    data.add_groups(log_prior={"prior": chains(log)})  # `from_dict` drops a group that it does not know
    found = az.psens(data, component="prior")
    return {name: float(found[name]) for name in posterior if np.isfinite(found[name])}


def cut_off(setup: PosteriorProblem, z: np.ndarray) -> tuple[str, ...]:
    """The parameters that an end of their range cuts off."""
    place = setup.target.places(z.reshape(-1, z.shape[-1]))[:, : setup.target.free]
    near = np.mean((place < SUMMARY.near_end) | (place > 1 - SUMMARY.near_end), axis=0)
    middle, spread = np.mean(place, axis=0), np.maximum(np.std(place, axis=0), 1e-300)
    reached = np.minimum(middle, 1 - middle) < SUMMARY.reached * spread  # small in its range is not yet cut off
    return tuple(name for name, cut in zip(setup.priors, (near > SUMMARY.many) & reached, strict=True) if cut)
