"""Muscles cut from one hose: they share every size but their length, as `hose = "..."` in each muscle.toml states."""

import dataclasses
from collections.abc import Mapping, Sequence
from math import sqrt

from fitting import showing
from fitting.errors import InputError
from fitting.recordings.records import Experiment
from mckibben_jax.muscle import Muscle, quantities

OWN_SIZES = ("length", "moving_mass")  # of each muscle; all others are of its hose
DIGITS = 9  # of a statement that count: the factor of a unit rounds the sixteenth
DISAGREEING = 5.0  # standard errors by which one statement of a size may lie off the mean of all
PRESUMED = {f.name: f.default for f in dataclasses.fields(Muscle)}  # what a size is that nobody stated
Size = tuple[float, float | None]  # value and standard error, SI; None: exact


def hoses_of(experiments: Sequence[Experiment]) -> dict[str, tuple[Experiment, ...]]:
    """The data sets of each hose that several are cut from, by the name of the hose."""
    named = dict.fromkeys(each.hose for each in experiments if each.hose)
    members = {hose: tuple(each for each in experiments if each.hose == hose) for hose in named}
    return {hose: of_it for hose, of_it in members.items() if len(of_it) > 1}


def perhaps_of_one_hose(experiments: Sequence[Experiment]) -> tuple[Experiment, ...]:
    """Data sets that state no hose but the same radius and braid angle, as muscles that were cut from one do."""
    stated = lambda each: (_statement(each, "radius"), _statement(each, "braid_angle"))  # noqa: E731
    bare = [each for each in experiments if not each.hose]
    sizes = [stated(each) for each in bare]
    return tuple(each for each in bare if sizes.count(stated(each)) > 1)


def is_of_hose(name: str) -> bool:
    """Whether all muscles of a hose share the unknown of this name: 'muscle.radius', but not 'muscle.length'."""
    owner, _, key = name.partition(".")
    return owner == "muscle" and key not in OWN_SIZES


def with_hose_sizes(experiments: Sequence[Experiment]) -> tuple[Experiment, ...]:
    """The same data sets where all muscles of a hose have its sizes: what any of them states holds for all.

    Different statements of one size are independent measurements and are averaged by their weights; the same statement
    in several files counts once. InputError where two contradict each other, or a hose has the name of another's data.
    """
    hoses = hoses_of(experiments)
    for each in experiments:
        if each.name in hoses and each.hose != each.name:
            cure = "give the data set or the hose another name in its muscle.toml"
            raise InputError("a data set has the name of a hose that it is not cut from", value=each.name, cure=cure)
    sizes = {hose: _sizes(hose, members) for hose, members in hoses.items()}
    return tuple(_with_sizes(each, sizes[each.hose]) if each.hose in sizes else each for each in experiments)


def _sizes(hose: str, members: Sequence[Experiment]) -> dict[str, Size]:
    """Every size that a muscle of this hose states."""
    stated = {key: _statements(members, key) for key in quantities() if key not in OWN_SIZES}
    return {key: _common(hose, key, given) for key, given in stated.items() if given}


def _statements(members: Sequence[Experiment], key: str) -> dict[Size, Experiment]:
    """The different statements of one size, each with a muscle that makes it; what is presumed is none."""
    found = dict[Size, Experiment]()
    for each in members:
        value = getattr(each.muscle, key)
        if f"muscle.{key}" in each.priors or (value is not None and float(value) != PRESUMED[key]):
            found.setdefault(_statement(each, key), each)
    return found


def _statement(experiment: Experiment, key: str) -> Size:
    """Value and error as stated, without the rounding of a unit: 9 mm is 0.009 m."""
    value, error = experiment.priors.get(f"muscle.{key}", (getattr(experiment.muscle, key), None))
    return _to_digits(float(value)), None if error is None else _to_digits(float(error))


def _to_digits(value: float) -> float:
    return float(f"{value:.{DIGITS}g}")


def _common(hose: str, key: str, given: Mapping[Size, Experiment]) -> Size:
    """One size out of its different statements; an exact one stands. InputError where one lies far off."""
    exact = [size for size in given if size[1] is None]
    weights = [error**-2 for _, error in given if error is not None]
    mean = sum(value * error**-2 for value, error in given if error is not None) / sum(weights) if weights else 0.0
    common = exact[0] if exact else (mean, sqrt(1 / sum(weights)))
    for (value, error), each in given.items():
        if abs(value - common[0]) > DISAGREEING * (error or 0.0):
            raise _contradiction(hose, key, given, each)
    return common


def _contradiction(hose: str, key: str, given: Mapping[Size, Experiment], off: Experiment) -> InputError:
    unit = quantities()[key][0]
    told = "; ".join(f"{each.name}: {showing.show(value, unit, error)}" for (value, error), each in given.items())
    problem = f"muscles of the hose '{hose}' state {key} too differently to be of one hose"
    cure = "correct one of them, state their uncertainty with +/-, or give one of the muscles another hose"
    return InputError(problem, off.folder / "muscle.toml", value=told, cure=cure)


def _with_sizes(experiment: Experiment, sizes: Mapping[str, Size]) -> Experiment:
    values = {key: value for key, (value, _) in sizes.items()}
    own = {name: prior for name, prior in experiment.priors.items() if not is_of_hose(name)}
    shared = {f"muscle.{key}": (value, error) for key, (value, error) in sizes.items() if error is not None}
    return dataclasses.replace(
        experiment, muscle=dataclasses.replace(experiment.muscle, **values), priors={**own, **shared}
    )
