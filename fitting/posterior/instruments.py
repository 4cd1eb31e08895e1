"""What instruments can do to the rows of a fit."""

from collections.abc import Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fitting.instruments.errors import InstrumentErrors
from fitting.instruments.felt import errors_felt
from fitting.least_squares.record import Fit
from fitting.problem.residuals import Problem
from fitting.recordings.presumed import allowed
from fitting.recordings.records import Experiment


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
