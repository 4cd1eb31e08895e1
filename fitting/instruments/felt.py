"""How errors of each channel are felt in the rows of a model: the slopes along its readings."""

from collections.abc import Sequence

import numpy as np

from fitting.instruments.columns import instrument_errors
from fitting.instruments.errors import InstrumentErrors
from fitting.instruments.settings import INSTRUMENTS, InstrumentSettings
from fitting.instruments.signals import RowsAt, channel_signals
from fitting.problem.residuals import Problem, Samples
from fitting.recordings.accuracy import Accuracy


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
