"""Stated sizes of the muscle that a model file keeps to what was stated.

Where a free fit denies a stated size, a discovery confines all of them (`fitting.diagnosis.stated_sizes`) and its model
file holds them fixed. Later commands on the same data keep to that, or each would fit another muscle: the error that
`diagnose` prints would not be the one that `discover` ended with.
"""

from collections.abc import Sequence
from dataclasses import replace

from fitting import full_names
from fitting.diagnosis.step_rules import RULES
from fitting.least_squares.record import Fit
from fitting.model_files.model_file import ModelFile
from fitting.problem.estimate import ParameterState
from fitting.problem.unknowns import BELIEVED
from fitting.recordings.records import Experiment

ROUNDED = 1e-4  # standard errors by which a fit stops short of a limit, or a file rounds a value


def held_sizes(stored: ModelFile | None, experiments: Sequence[Experiment], free: Sequence[str]) -> tuple[str, ...]:
    """The stated sizes that a model of these very data holds at the limit of what a fit may make of them.

    None of them where all are named as `free`; none either where a size of the model lies outside what was stated:
    then somebody wanted it there.
    """
    found = tuple(name for name, place in _fixed_inside(stored, experiments).items() if _is_at_limit(place))
    return () if {full_names.common(name) for name in found} <= set(free) else found


def fixed_sizes(stored: ModelFile | None, experiments: Sequence[Experiment]) -> tuple[str, ...]:
    """The stated sizes that somebody held fixed, inside what was stated, in a model of this very data set.

    None where there are several: whose size was fixed, a file does not say.
    """
    if len(experiments) > 1:
        return ()
    return tuple(name for name, place in _fixed_inside(stored, experiments).items() if not _is_at_limit(place))


def _fixed_inside(stored: ModelFile | None, experiments: Sequence[Experiment]) -> dict[str, float]:
    """How far from what was stated each size lies that a model of these very data holds fixed, in stated errors.

    Nothing where any size lies outside.
    """
    if stored is None or not stored.fitted_to(experiments):
        return {}
    places = dict[str, float]()
    for experiment in experiments:
        for name, (mean, error) in experiment.priors.items():
            full = name if experiment is experiments[0] else full_names.of_set(name, experiment.name)
            places[full] = abs(stored.values.get(full, mean) - mean) / error
    if any(place > BELIEVED + ROUNDED for place in places.values()):
        return {}
    return {name: place for name, place in places.items() if stored.states.get(name) is ParameterState.FIXED}


def _is_at_limit(place: float) -> bool:
    return abs(place - BELIEVED) <= ROUNDED


def confined(experiments: Sequence[Experiment]) -> tuple[Experiment, ...]:
    """The same data sets where a fit may not deny the stated sizes."""
    return tuple(replace(experiment, is_confined=True) for experiment in experiments)


def denied_sizes(fit: Fit, free: Sequence[str]) -> tuple[str, ...]:
    """The stated sizes that vary, if a fit denies any of them, and nobody has asked for one of them to be `free`."""
    entries = [fit.layout.entry(name) for name in fit.free]
    stated = {entry.name: entry.prior for entry in entries if entry.prior is not None and not entry.is_confined}
    away = [abs(fit.values[name] - mean) / error for name, (mean, error) in stated.items()]
    asked = {*stated, *map(full_names.common, stated)} & {*free}
    return tuple(stated) if not asked and max(away, default=0.0) > RULES.denied else ()
