"""What may vary in a fit: every parameter of a set of effects and of each data set's muscle, as one flat vector."""

import dataclasses
from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from fitting import full_names
from fitting.recordings.hoses import hoses_of, is_of_hose, with_hose_sizes
from fitting.recordings.records import Experiment
from mckibben_jax.effect import Effect, name_of
from mckibben_jax.model import Model, model
from mckibben_jax.muscle import quantities as muscle_quantities
from mckibben_jax.parameter import parameters

LOG_RATIO = 50.0  # a positive range wider than this is searched in the logarithm
PRIOR_WIDTH = 25.0  # standard deviations that a stated value may move: far enough for a wrong model to show itself
BELIEVED = 2.0  # the same where a fit may not deny it: 95 of 100 honest measurements lie within


@dataclasses.dataclass(frozen=True)
class Unknown:
    """One number that may vary: its full name, unit and range, where a search starts, and its normal prior if any.

    `is_confined`: a stated size that a fit may not deny. `is_level`: 0 is a value like any other, as of the reading of
    a slack muscle; of other parameters of effects it means that the effect is not there.
    """

    name: str
    unit: str
    lower: float
    upper: float
    start: float
    starts: tuple[float, ...]
    prior: tuple[float, float] | None = None
    is_confined: bool = False
    is_level: bool = False

    def size_of(self, value: float) -> float:
        """How far a value is from saying nothing: from 0 or, of a level, from the nearer end of its range."""
        return min(value - self.lower, self.upper - value) if self.is_level else abs(value)

    @property
    def logarithmic(self) -> bool:
        """Whether the search goes in the logarithm."""
        return self.lower > 0 and self.upper / self.lower > LOG_RATIO

    def slope(self, value: float) -> float:
        """d(value)/d(place in the range, which counts from 0 to 1)."""
        return value * float(np.log(self.upper / self.lower)) if self.logarithmic else self.upper - self.lower

    def within(self, errors: float) -> "Unknown":
        """The same where a stated value may move by so many of its standard errors at most."""
        if self.prior is None:
            return self
        mean, error = self.prior
        ends = {"lower": max(self.lower, mean - errors * error), "upper": min(self.upper, mean + errors * error)}
        return dataclasses.replace(self, **ends)

    def confined(self, errors: float) -> "Unknown":
        """The same where a fit may not deny a stated value: it stays within so many of its standard errors."""
        return dataclasses.replace(self.within(errors), is_confined=self.prior is not None)


@dataclasses.dataclass(frozen=True)
class Unknowns:
    """The flat vector of everything that may vary, and how each data set's model takes its values from it.

    Effects' parameters are shared by all data sets, sizes of a hose by all that are cut from it; those of the muscle
    are else each data set's own, as is every name listed as `own`.
    """

    entries: tuple[Unknown, ...]
    templates: tuple[Model, ...]
    places: tuple[np.ndarray, ...]  # for each data set: where in the vector each leaf of its model stands

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Full names, in the order of the vector."""
        return tuple(entry.name for entry in self.entries)

    @property
    def datasets(self) -> tuple[str, ...]:
        """The name of each data set, in their order; empty of a single one, whose names are those of all."""
        first = (self.names[int(places[0])] for places in self.places)  # a size of its muscle, which is its own
        return tuple(map(full_names.set_of, first))

    def names_of(self, dataset: int) -> dict[str, str]:
        """The full name of every unknown of one data set's model by its common name: 'tip.k' -> 'tip.k@second set'."""
        mine = (self.names[int(at)] for at in self.places[dataset])
        return {full_names.common(name): name for name in mine}

    def confined(self, errors: float) -> "Unknowns":
        """The same where a fit may deny no stated value by more than so many standard errors."""
        return dataclasses.replace(self, entries=tuple(entry.confined(errors) for entry in self.entries))

    @property
    def lower(self) -> np.ndarray:
        """Lower ends of the ranges."""
        return np.array([entry.lower for entry in self.entries])

    @property
    def upper(self) -> np.ndarray:
        """Upper ends of the ranges."""
        return np.array([entry.upper for entry in self.entries])

    @property
    def logarithmic(self) -> np.ndarray:
        """Which entries are searched in the logarithm."""
        return np.array([entry.logarithmic for entry in self.entries])

    @property
    def start(self) -> np.ndarray:
        """Where a search starts."""
        return np.array([entry.start for entry in self.entries])

    def vector_of(self, values: Mapping[str, float]) -> np.ndarray:
        """The vector with these values, by full name (those of other models are passed over), and starts elsewhere."""
        return np.array([values.get(entry.name, entry.start) for entry in self.entries], float)

    @cached_property
    def _positions(self) -> dict[str, int]:
        return {name: position for position, name in enumerate(self.names)}

    @cached_property
    def _by_effect(self) -> dict[str, tuple[str, ...]]:
        found: dict[str, tuple[str, ...]] = {}
        for name in self.names:
            owner = full_names.owner_of(name)
            found[owner] = (*found.get(owner, ()), name)
        return found

    def entry(self, name: str) -> Unknown:
        """The unknown of this full name."""
        return self.entries[self._positions[name]]

    def at(self, names: Iterable[str]) -> np.ndarray:
        """Positions of these names in the vector."""
        return np.array([self._positions[name] for name in names], dtype=int)

    def of_effect(self, effect: str) -> tuple[str, ...]:
        """The names that belong to an effect."""
        return self._by_effect.get(effect, ())

    def model(self, vector: jax.Array, dataset: int = 0, switches: Any = None, live: Any = None) -> Model:
        """The model of one data set with these values."""
        template = self.templates[dataset]
        switches = template.switches if switches is None else switches
        return filled(template, jnp.asarray(vector)[self.places[dataset]], switches, live)


def unknowns(
    experiments: Sequence[Experiment],
    effects: Sequence[Effect],
    own: Sequence[str] = (),
    among: Sequence[Experiment] | None = None,
) -> Unknowns:
    """Lay out the unknowns of a set of effects on one or more data sets.

    They bear the names that they have `among` all these data sets, if these are only some of them.
    """
    whole = with_hose_sizes(experiments if among is None else among)
    sized = {each.name: each for each in whole}
    entries: dict[str, Unknown] = {}
    templates, places = [], []
    for experiment in experiments:
        muscle = sized[experiment.name]
        template = model(muscle.muscle, *effects)
        named = [*_of_muscle(muscle), *_of_effects(template)]
        labelled = [_labelled(entry, _owner(entry.name, muscle, whole, own)) for entry in named]
        for entry in labelled:
            entries.setdefault(entry.name, entry)
        order = list(entries)
        templates.append(template)
        places.append(np.array([order.index(entry.name) for entry in labelled]))
    return Unknowns(tuple(entries.values()), tuple(templates), tuple(places))


def _owner(name: str, experiment: Experiment, experiments: Sequence[Experiment], own: Sequence[str]) -> str:
    """The data set or the hose whose own an unknown is; empty where all share it."""
    if len(experiments) == 1 or not (name.startswith("muscle.") or name in own):
        return ""
    members = hoses_of(experiments).get(experiment.hose, ())
    if name in own or not members or not is_of_hose(name):
        return experiment.name
    return experiment.hose if len(members) < len(experiments) else ""


def _labelled(entry: Unknown, owner: str) -> Unknown:
    return dataclasses.replace(entry, name=full_names.of_set(entry.name, owner)) if owner else entry


def _of_muscle(experiment: Experiment) -> list[Unknown]:
    return [
        _measured(f"muscle.{name}", unit, float(value), experiment)
        for name, (unit, _) in muscle_quantities().items()
        if (value := getattr(experiment.muscle, name)) is not None
    ]


def _measured(name: str, unit: str, value: float, experiment: Experiment) -> Unknown:
    prior = experiment.priors.get(name)
    lower, upper = (value / 5, value * 5) if value > 0 else (0.0, float(experiment.muscle.radius))
    if name == "muscle.braid_angle":
        lower, upper = np.radians(3.0), np.radians(54.0)
    entry = Unknown(name, unit, lower, upper, value, (value,), prior)
    return entry.confined(BELIEVED) if experiment.is_confined else entry.within(PRIOR_WIDTH)


def _of_effects(template: Model) -> list[Unknown]:
    return [
        Unknown(
            f"{name_of(effect)}.{p.name}",
            p.unit,
            p.lower,
            p.upper,
            float(getattr(effect, p.name)),
            p.starts,
            is_level=p.is_level,
        )
        for effect in template.effects
        for p in parameters(effect)
    ]


def filled(template: Model, values: jax.Array, switches: jax.Array, live: jax.Array | None = None) -> Model:
    """The template with these values: those of the muscle, then those of the effects, as they are declared."""
    leaves, structure = jax.tree.flatten((template.muscle, template.effects))
    muscle, effects = jax.tree.unflatten(structure, [values[i] for i in range(len(leaves))])
    return Model(muscle, effects, switches, live)
