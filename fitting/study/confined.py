"""Stated sizes of the muscle that a model file keeps to what was stated.

Where a free fit denies a stated size, a discovery confines all of them (`fitting.diagnosis.stated_sizes`) and its model
file holds them fixed. Later commands on the same data keep to that, or each would fit another muscle: the error that
`diagnose` prints would not be the one that `discover` ended with.
"""

from collections.abc import Sequence
from dataclasses import replace

from fitting import full_names
from fitting.model_files.model_file import ModelFile
from fitting.problem.estimate import ParameterState
from fitting.problem.unknowns import BELIEVED
from fitting.recordings.records import Experiment

ROUNDED = 1e-6  # standard errors by which a file may round a value


def held_sizes(stored: ModelFile | None, experiments: Sequence[Experiment], free: Sequence[str]) -> tuple[str, ...]:
    """The stated sizes that a model of these very data holds fixed; none of them where all are named as `free`.

    None either where a size of the model lies outside what was stated: then somebody wanted it there.
    """
    if stored is None or not stored.fitted_to(experiments):
        return ()
    found = []
    for experiment in experiments:
        for name, (mean, error) in experiment.priors.items():
            full = name if experiment is experiments[0] else full_names.of_set(name, experiment.name)
            if abs(stored.values.get(full, mean) - mean) > (BELIEVED + ROUNDED) * error:
                return ()
            if stored.states.get(full) is ParameterState.FIXED:
                found.append(full)
    return () if {full_names.common(name) for name in found} <= set(free) else tuple(found)


def confined(experiments: Sequence[Experiment]) -> tuple[Experiment, ...]:
    """The same data sets where a fit may not deny the stated sizes."""
    return tuple(replace(experiment, is_confined=True) for experiment in experiments)
