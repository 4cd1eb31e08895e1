"""A fit becomes a posterior to be sampled: which readings, which noise, which priors, and where its mode is."""

import dataclasses
from collections.abc import Iterator, Sequence

import jax.numpy as jnp
import numpy as np

from fitting import full_names
from fitting.errors import InputError
from fitting.instruments.errors import InstrumentErrors
from fitting.least_squares.record import Fit
from fitting.least_squares.search import Evaluated
from fitting.least_squares.subset import Subset, subset_of
from fitting.least_squares.unbent import left_beyond
from fitting.posterior.beginning import beginnings
from fitting.posterior.evaluation import at_mode, log_probs
from fitting.posterior.instruments import Instruments
from fitting.posterior.noise import PARTS, Noise, RecordingNoise, choose_noise, noise_of_rows
from fitting.posterior.settings import DENSITY, SAMPLER
from fitting.posterior.target import PosteriorProblem, Target
from fitting.precision import require_x64
from fitting.problem.positions import steps_of
from fitting.problem.priors import Prior, check_overlap, spread, together, uniform
from fitting.problem.residuals import Problem, Samples, problem
from fitting.problem.thinning import thinned_runs
from fitting.recordings.records import Experiment, Recording


def set_up(
    fit: Fit,
    experiments: Sequence[Experiment] = (),
    rows: int = SAMPLER.rows,
    stated: dict[str, Prior] | None = None,
    noise: Sequence[tuple[str, ...]] | None = None,
) -> PosteriorProblem:
    """The posterior of a fit's free parameters, in coordinates whitened by the curvature at its mode.

    `stated` are priors by full name; `noise` gives the components of each recording's noise, else chosen from the
    residual. InputError where no parameter varies.
    """
    require_x64()
    if not fit.free:
        raise InputError("nothing varies in this model", cure="free a parameter, for example --free muscle.radius")
    given, samples = thin_readings(fit, experiments, rows)
    priors = {name: _prior(fit, name, stated or {}) for name in fit.free}
    subset = _narrow(subset_of(fit.layout, fit.vector, fit.free), fit, priors)
    at = positions_in(fit.samples, samples)
    errors = fit.errors.at(at)
    place = subset.place(subset.full)
    begun = Evaluated(place, (fit.residual / fit.samples.sigma)[at], fit.slopes[at] * np.asarray(subset.slope(place)))
    known = _Given(fit, experiments, given, samples, subset, errors, priors, stated or {}, noise)
    return max((known.at_mode(place) for place in beginnings(begun, given, subset, fit, errors)), key=_likely)[0]


def _likely(found: tuple[PosteriorProblem, float]) -> float:
    return found[1]


@dataclasses.dataclass(frozen=True)
class _Given:
    """What a posterior is made of, wherever the search for its mode begins."""

    fit: Fit
    experiments: Sequence[Experiment]
    given: Problem
    samples: Samples
    subset: Subset
    errors: InstrumentErrors
    priors: dict[str, Prior]
    stated: dict[str, Prior]
    noise: Sequence[tuple[str, ...]] | None

    def at_mode(self, begun: Evaluated) -> tuple[PosteriorProblem, float]:
        """The posterior in coordinates whitened at the mode that is found from there, and how likely that mode is.

        The noise is what the residual there speaks for; each of its parameters costs what BIC takes for it.
        """
        fit, samples = self.fit, self.samples
        place, residual, slopes = map(np.asarray, begun)
        found = choose_noise(left_beyond(residual, slopes, self.errors), samples, self.noise)
        components = noise_of_rows(samples, [one.parts for one in found], [one.values[0] for one in found])
        begin = _logits(place, slopes, found, components, samples, self.errors)
        of_noise = 1 / (1 + np.exp(-begin[0][len(fit.free) :]))
        instruments = Instruments.of(self.errors, samples, components, of_noise)
        priors = together(list(self.priors.values()))
        target = Target(self.given, self.subset, components, instruments, priors, *map(jnp.asarray, begin))
        whole = self._told(target, found)
        done = _with_longest_steps(whole) if target.moves else whole.in_coordinates(*at_mode(target))
        value = float(log_probs(done.target, DENSITY.batch)(np.zeros((1, len(done.names))))[0])
        return done, value - 0.5 * len(components.lower) * np.log(len(samples))

    def _told(self, target: Target, found: tuple[RecordingNoise, ...]) -> PosteriorProblem:
        """The density with all that readers want to know of it."""
        fit, samples, experiments = self.fit, self.samples, self.experiments
        every, numbers = _labels(self.given, experiments), np.unique(samples.recording)
        labels = tuple(every[number] for number in numbers)
        names = (*fit.free, *(f"noise.{part}@{label}" for one, label in zip(found, labels, strict=True)
                              for part in PARTS if part in one.parts))  # fmt: skip
        idle = tuple(n for n in self.stated if not any(n in (f, full_names.common(f)) for f in fit.free))
        known = [rec.noise is not None for experiment in experiments for rec in experiment.recordings]
        good_to = tuple(len(known) == len(every) and known[number] for number in numbers)
        spreads = {name: _spread(fit, name, prior) for name, prior in self.priors.items()}
        return PosteriorProblem(
            target, samples, self.errors, found, labels, names, self.priors, spreads, idle, stated=good_to
        )


def positions_in(every: Samples, some: Samples) -> np.ndarray:
    """Where each of some samples stands among all."""
    place = {key: i for i, key in enumerate(zip(every.run.tolist(), every.row.tolist(), strict=True))}
    return np.array([place[key] for key in zip(some.run.tolist(), some.row.tolist(), strict=True)], int)


def _with_longest_steps(setup: PosteriorProblem) -> PosteriorProblem:
    """The same at its mode, motions integrated in steps as long as the density allows."""
    at_its_mode = setup.in_coordinates(*at_mode(with_coarser_steps(setup.target, DENSITY.coarser[0])))
    fine = at_its_mode.target
    z = np.random.default_rng(0).standard_normal((DENSITY.batch, len(setup.names)))
    exact = log_probs(fine, DENSITY.batch)(z)
    for times in DENSITY.coarser:
        coarse = with_coarser_steps(fine, times)
        change = float(np.std(log_probs(coarse, DENSITY.batch)(z) - exact))
        if change < DENSITY.same:  # not so where it is no number
            text = f"motions take steps {times} times as long as in the fit: the log-density moves by {change:.2f}"
            return dataclasses.replace(at_its_mode, target=coarse, integration=text)
    return at_its_mode


def with_coarser_steps(target: Target, times: int) -> Target:
    """With steps that are longer."""
    given = target.problem
    blocks = tuple(dataclasses.replace(b, steps=-(-b.steps // times)) if b.steps else b for b in given.blocks)
    return dataclasses.replace(target, problem=dataclasses.replace(given, blocks=blocks).coarser(times))


def _prior(fit: Fit, name: str, stated: dict[str, Prior]) -> Prior:
    entry = fit.layout.entry(name)
    mine = stated.get(name) or stated.get(full_names.common(name))
    if mine is not None:
        check_overlap(mine, name, entry.unit, entry.lower, entry.upper)
        return mine
    return Prior("normal", *entry.prior) if entry.prior else uniform(entry.lower, entry.upper)


def _spread(fit: Fit, name: str, prior: Prior) -> float:
    entry = fit.layout.entry(name)
    return spread(prior, entry.lower, entry.upper)


def _narrow(subset: Subset, fit: Fit, priors: dict[str, Prior]) -> Subset:
    """Ranges without what a prior excludes."""
    lower, upper = np.array(subset.lower), np.array(subset.upper)
    log = np.array(subset.logarithmic)
    for i, prior in zip(fit.layout.at(priors), priors.values(), strict=True):
        lower[i], upper[i] = prior.ends(float(lower[i]), float(upper[i]))
        log[i] &= lower[i] > 0
    return dataclasses.replace(subset, lower=lower, upper=upper, logarithmic=log)


def thin_readings(fit: Fit, experiments: Sequence[Experiment], rows: int) -> tuple[Problem, Samples]:
    """The fit's data, or every k-th of its readings where there are more than `rows` and `experiments` are given.

    The noise of a reading stays what it was for all of them. Readings of a motion stay unless they are more than half
    of what is wanted: its steps cost the same however few of them are read.
    """
    if len(fit.samples) <= rows or not experiments:
        return fit.problem, fit.samples
    noise = iter(float(block.sigma[0, 0]) for block in fit.problem.blocks)
    stated = [_with(e, tuple(dataclasses.replace(rec, noise=next(noise)) for rec in e.recordings)) for e in experiments]
    moving, other = (sum(_weighted(rec) for e in stated for rec in e.recordings if bool(steps_of(rec)) is m)
                     for m in (True, False))  # fmt: skip
    kept = min(moving, rows / 2)
    shares = {True: kept / max(moving, 1.0), False: (rows - kept) / max(other, 1.0)}
    return problem([thin_to_shares(experiment, shares) for experiment in stated], fit.layout)


def thin_to_shares(experiment: Experiment, shares: dict[bool, float]) -> Experiment:
    """These shares of the readings of recordings in which something moves under a load, and of the others."""
    slim: dict[bool, Iterator[Recording]] = {}
    for moves, share in shares.items():
        mine = tuple(rec for rec in experiment.recordings if bool(steps_of(rec)) is moves)
        about = max(int(share * sum(map(_weighted, mine))), 1)
        slim[moves] = iter(thinned_runs(_with(experiment, mine), about).recordings if share < 1 else mine)
    return _with(experiment, tuple(next(slim[bool(steps_of(rec))]) for rec in experiment.recordings))


def _with(experiment: Experiment, recordings: tuple[Recording, ...]) -> Experiment:
    return dataclasses.replace(experiment, recordings=recordings)


def _weighted(recording: Recording) -> float:
    return sum(float(run.weight.sum()) for run in recording.runs)


def _labels(given: Problem, experiments: Sequence[Experiment]) -> tuple[str, ...]:
    """What the recordings are called: by their file, with the data set where that is not enough."""
    files = [(experiment.name, rec.file) for experiment in experiments for rec in experiment.recordings]
    if len(files) != len(given.blocks):
        return tuple(f"recording {i + 1}" for i in range(len(given.blocks)))
    plain = [file for _, file in files]
    return tuple(file if plain.count(file) == 1 else f"{name}/{file}" for name, file in files)


def _logits(
    place: np.ndarray,
    slopes: np.ndarray,
    found: Sequence[RecordingNoise],
    noise: Noise,
    samples: Samples,
    errors: InstrumentErrors,
) -> tuple[np.ndarray, np.ndarray]:
    """Where the search for the mode begins, and how far it may step, in logits."""
    size = np.array([one.values[0] for one in found])[np.unique(samples.recording, return_inverse=True)[1]]
    of_size = errors.changed(errors.per_run / size[:, None], errors.shared / size[:, None])
    steeper = of_size.whitener()(slopes / size[:, None])
    curvature = steeper.T @ steeper + 12 * np.eye(len(place))  # 1/12: the variance of a place of which nothing is known
    width = np.linalg.inv(curvature)
    inside = np.maximum(DENSITY.inside, np.minimum(0.5 * np.sqrt(np.diag(width)), 0.1))
    place = np.clip(place, inside, 1 - inside)
    values = np.concatenate([one.values for one in found])
    log, lower, upper = (np.asarray(part) for part in (noise.logarithmic, noise.lower, noise.upper))
    of_noise = (np.where(log, np.log(np.where(log, values, 1.0)), values) - lower) / (upper - lower)
    whole = np.clip(np.concatenate([place, of_noise]), DENSITY.inside, 1 - DENSITY.inside)
    axes = np.zeros((len(whole),) * 2)
    free = len(place)
    axes[:free, :free] = np.linalg.cholesky(width) / (place * (1 - place))[:, None]
    names = [part for one in found for part in PARTS if part in one.parts]
    step = {"size": 0.02, "remembered": 0.3, "memory": 0.2, "run": 0.5}
    axes[free:, free:] = np.diag([step[name] for name in names])
    return np.log(whole / (1 - whole)), axes
