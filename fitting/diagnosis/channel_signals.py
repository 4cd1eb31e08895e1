"""How errors of each channel are felt in the rows of a model: the slopes along its readings."""

from collections.abc import Callable, Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fitting.diagnosis.instrument_errors import InstrumentErrors, Signal, instrument_errors
from fitting.diagnosis.settings import INSTRUMENTS, InstrumentSettings
from fitting.least_squares.record import Fit
from fitting.problem.residuals import Problem, Samples
from fitting.recordings.accuracy import Accuracy, Channel
from fitting.recordings.presumed import allowed
from fitting.recordings.records import Experiment

RowsAt = Callable[[Problem, Sequence[str]], np.ndarray]


def errors_felt(
    problem: Problem,
    samples: Samples,
    rows_at: RowsAt,
    lost: Sequence[str],
    lengths: np.ndarray,
    accuracies: Sequence[Accuracy],
    settings: InstrumentSettings = INSTRUMENTS,
    every: bool = False,
) -> InstrumentErrors:
    """What instruments within their accuracy can do to the rows of a model; with `every` whatever they could do.

    `rows_at` gives the rows on a problem of the same shape without some effects, `lost` names the model's effects that
    take force from its motion, `lengths` (m) are the muscles' at rest by data set, `accuracies` by recording.
    """
    rows = rows_at(problem, ())
    signals = channel_signals(problem, samples, rows, rows_at, lengths, settings)
    friction = [rows - rows_at(problem, (name,)) for name in lost]
    columns = np.column_stack(friction) if friction else np.zeros((len(samples), 0))
    return instrument_errors(samples, accuracies, signals, np.nan_to_num(columns), settings, every)


def errors_of_fit(fit: Fit, experiments: Sequence[Experiment]) -> InstrumentErrors:
    """What instruments within their accuracy can do to the rows of a fit to these data sets; nothing without them."""
    if not experiments:
        return InstrumentErrors.none(fit.samples.run)
    model, vector = fit.layout.templates[0], jnp.asarray(fit.vector)
    on = dict(zip(model.names, fit.switches, strict=True))

    def rows_at(problem: Problem, without: Sequence[str]) -> np.ndarray:
        switches = jnp.asarray([0.0 if name in without else on[name] for name in model.names])
        return np.asarray(data_rows(problem, vector, switches))

    lost = [
        name for name, effect in zip(model.names, model.effects, strict=True) if effect.stage == "lost" and on[name]
    ]
    lengths = np.array([float(experiment.muscle.length) for experiment in experiments])
    accuracies = [allowed(recording) for experiment in experiments for recording in experiment.recordings]
    return errors_felt(fit.problem, fit.samples, rows_at, lost, lengths, accuracies)


@eqx.filter_jit
def data_rows(problem: Problem, vector: jax.Array, switches: jax.Array) -> jax.Array:
    """The rows of the measurements, compiled."""
    return problem.data_rows(vector, switches)


def channel_signals(
    problem: Problem,
    samples: Samples,
    rows: np.ndarray,
    rows_at: RowsAt,
    lengths: np.ndarray,
    settings: InstrumentSettings = INSTRUMENTS,
) -> dict[Channel, Signal]:
    """The channels as the model's rows feel them: pressure (Pa), position (m of shortening), force (N)."""

    def slope(pressure: float, contraction: float) -> np.ndarray:
        there, back = (rows_at(problem.shifted(sign * pressure, sign * contraction), ()) for sign in (1.0, -1.0))
        return np.nan_to_num((there - back) / (2 * (pressure + contraction)), posinf=0.0, neginf=0.0)

    length = lengths[samples.dataset]
    by_pressure = slope(settings.step * _largest(samples.pressure), 0.0)
    by_contraction = slope(0.0, settings.step)
    position = length * samples.contraction
    force = samples.measured + rows * samples.sigma  # as predicted: no error of the reading
    rate = (by_pressure * samples.pressure_rate + by_contraction * samples.rate) * samples.sigma
    return {
        Channel.PRESSURE: Signal(by_pressure, samples.pressure, samples.pressure_rate, _largest(samples.pressure)),
        Channel.POSITION: Signal(by_contraction / length, position, length * samples.rate, _largest(position)),
        Channel.FORCE: Signal(1 / samples.sigma, force, rate, _largest(samples.measured)),
    }


def _largest(values: np.ndarray) -> float:
    return max(float(np.max(np.abs(values))), 1e-300)
