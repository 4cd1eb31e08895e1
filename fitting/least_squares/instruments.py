"""What instruments that err can make of the rows of a fit."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fitting.instruments.errors import InstrumentErrors
from fitting.instruments.felt import errors_felt
from fitting.least_squares.search import rows_and_slopes
from fitting.least_squares.subset import Array, Subset
from fitting.problem.residuals import Problem, Samples
from fitting.problem.sizes import Standard
from fitting.recordings.accuracy import Accuracy
from fitting.recordings.presumed import allowed
from fitting.recordings.records import Experiment


def accuracies_of(experiments: Sequence[Experiment]) -> tuple[Accuracy, ...]:
    """How far the instruments of each recording may err, through all data sets."""
    return tuple(allowed(recording) for experiment in experiments for recording in experiment.recordings)


def errors_in(
    usual: Standard, subset: Subset, place: Array, samples: Samples, accuracies: Sequence[Accuracy]
) -> InstrumentErrors:
    """What instruments within their accuracy can do to the rows of a model in which something varies.

    `place` is where in the unit box. The rows are those of the compiled function that a search has used.
    """
    if not accuracies:
        return InstrumentErrors.none(samples.run)
    template = usual.problem.templates[0]
    at = np.asarray(place)

    def rows_at(problem: Problem, without: Sequence[str]) -> np.ndarray:
        off = [name in without for name in template.names]
        some = replace(subset, switches=np.where(off, 0.0, subset.switches))
        return np.asarray(rows_and_slopes(problem, some, at)[0])[usual.rows[: len(samples)]]

    effects = zip(template.names, template.effects, subset.switches, strict=True)
    lost = [name for name, effect, on in effects if effect.stage == "lost" and on]
    return errors_felt(usual.problem, samples, rows_at, lost, _lengths(usual.problem), accuracies)


def _lengths(given: Problem) -> np.ndarray:
    """The muscles' lengths at rest (m) by data set."""
    found = {block.dataset: float(block.stated_length) for block in given.blocks}
    return np.array([found[dataset] for dataset in range(len(given.templates))])
