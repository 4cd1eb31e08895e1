"""Stated sizes of the muscle that a model file keeps to what was stated.

Where a free fit denies a stated size, a discovery confines all of them (`fitting.diagnosis.stated_sizes`) and its model
file holds them fixed. Later commands on the same data keep to that, or each would fit another muscle: the error that
`diagnose` prints would not be the one that `discover` ended with.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

from fitting import full_names
from fitting.model_files.model_file import ModelFile
from fitting.problem.estimate import ParameterState
from fitting.problem.unknowns import BELIEVED
from fitting.recordings.records import Experiment

ROUNDED = 1e-6  # standard errors by which a file may round a value


def held_sizes(stored: ModelFile | None, experiments: Sequence[Experiment], free: Sequence[str]) -> tuple[str, ...]:
    """The stated sizes that a model of these very data holds fixed; none of them where all are named as `free`.

    None either where none of them stands at the limit of what a fit may make of it (then somebody held them there:
    `fixed_sizes`), or where a size of the model lies outside what was stated: then somebody wanted it there.
    """
    places = _places(stored, experiments)
    found = _fixed_of(stored, places)
    if not any(_is_at_limit(places[name]) for name in found) or any(map(_is_outside, places.values())):
        return ()
    return () if {full_names.common(name) for name in found} <= set(free) else found


def fixed_sizes(stored: ModelFile | None, experiments: Sequence[Experiment]) -> tuple[str, ...]:
    """The stated sizes that somebody held fixed in a model of these very data, at a value of their own choice."""
    places = _places(stored, experiments)
    found = _fixed_of(stored, places)
    return () if any(_is_at_limit(places[name]) for name in found) else found


def _places(stored: ModelFile | None, experiments: Sequence[Experiment]) -> dict[str, float]:
    """How far from what was stated each size lies in a model of these very data, in errors of what was stated."""
    found = dict[str, float]()
    if stored is None or not stored.fitted_to(experiments):
        return found
    for experiment in experiments:
        for name, (mean, error) in experiment.priors.items():
            full = name if experiment is experiments[0] else full_names.of_set(name, experiment.name)
            found[full] = abs(stored.values.get(full, mean) - mean) / error
    return found


def _fixed_of(stored: ModelFile | None, places: Mapping[str, float]) -> tuple[str, ...]:
    return tuple(name for name in places if stored and stored.states.get(name) is ParameterState.FIXED)


def _is_at_limit(place: float) -> bool:
    return abs(place - BELIEVED) <= ROUNDED


def _is_outside(place: float) -> bool:
    return place > BELIEVED + ROUNDED


def confined(experiments: Sequence[Experiment]) -> tuple[Experiment, ...]:
    """The same data sets where a fit may not deny the stated sizes."""
    return tuple(replace(experiment, is_confined=True) for experiment in experiments)
