"""What instruments that err can make of the rows of a fit."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fitting.full_names import owner_of
from fitting.instruments.errors import InstrumentErrors
from fitting.instruments.felt import errors_felt
from fitting.least_squares.searches import Searches
from fitting.least_squares.subset import Array, Subset
from fitting.problem.residuals import Problem, Samples
from fitting.problem.unknowns import Unknowns
from fitting.recordings.accuracy import Accuracy
from fitting.recordings.presumed import allowed
from fitting.recordings.records import Experiment


def accuracies_of(experiments: Sequence[Experiment]) -> tuple[Accuracy, ...]:
    """How far the instruments of each recording may err, through all data sets."""
    return tuple(allowed(recording) for experiment in experiments for recording in experiment.recordings)


def errors_in(
    searches: Searches,
    layout: Unknowns,
    subset: Subset,
    vector: Array,
    samples: Samples,
    accuracies: Sequence[Accuracy],
) -> InstrumentErrors:
    """What instruments within their accuracy can do to the rows of a model in which something varies.

    An error that an effect of the model stands for, if it varies, is that effect's: beside a delay of the force a skew
    between the channels is the same once more, and neither would be known. Not where recordings were read by different
    instruments: the one effect is not the error of each.
    `vector` holds all unknowns. In `subset` what was asked to vary may vary, also what the data do not constrain: then
    the program that found out which these are is all that it takes.
    """
    if not accuracies:
        return InstrumentErrors.none(samples.run)
    template, standard, place = searches.template, searches.standard, subset.place(np.asarray(vector))

    def rows_at(problem: Problem, without: Sequence[str]) -> np.ndarray:
        off = [name in without for name in template.names]
        some = replace(subset, switches=np.where(off, 0.0, subset.switches))
        return np.asarray(searches.at(some, place, problem).rows)[standard.rows[: len(samples)]]

    there = zip(template.names, template.effects, subset.switches, strict=True)
    effects = {name: effect for name, effect, on in there if on}
    lost = [name for name, effect in effects.items() if effect.stage == "lost"]
    varying = {owner_of(layout.names[at]) for at in np.asarray(subset.free) if at < len(layout.names)}
    known = [effect.misreads for name, effect in effects.items() if effect.misreads and name in varying]
    others = [accuracy.without(known) for accuracy in accuracies] if len({*accuracies}) == 1 else accuracies
    return errors_felt(standard.problem, samples, rows_at, lost, _lengths(standard.problem), others)


def _lengths(given: Problem) -> np.ndarray:
    """The muscles' lengths at rest (m) by data set."""
    found = {block.dataset: float(block.stated_length) for block in given.blocks}
    return np.array([found[dataset] for dataset in range(len(given.templates))])
