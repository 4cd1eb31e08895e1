"""What is held to be likely before the data speak: priors by name, their density, spread and end points.

In a model file, beside the value of a parameter (the unit must be that of the parameter):

    f_s  = { value = "0.02", prior = { kind = "normal", mean = "0.015", sd = "0.005" } }
    G    = { value = "300 kPa", prior = { kind = "log-normal", median = "350 kPa", factor = "1.5" } }
    beta = { value = "0.7", prior = { kind = "uniform", from = "0.5", to = "0.9" } }
    F_c  = { value = "5 N", prior = { kind = "half-normal", sd = "20 N" } }

All are cut off at the ends of the parameter's range; one that lies beyond them is refused. A parameter without one is
uniform over its range, or normal where muscle.toml gives it `+/-`.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fitting import full_names, showing, units
from fitting.errors import InputError, unknown_name
from fitting.recordings.muscle_file import line_of
from mckibben_jax.effect import Effect, name_of
from mckibben_jax.muscle import quantities
from mckibben_jax.parameter import parameters

KEYS = {"normal": ("mean", "sd"), "log-normal": ("median", "factor"), "uniform": ("from", "to"), "half-normal": ("sd",)}
KINDS = tuple(KEYS)
ENTRY = ("value", "error", "state", "prior")  # what may stand beside a parameter in a model file
BEYOND = 5.0  # standard deviations from where a prior lies to the nearest place that its range allows: too far
GRID = 20_001  # points of the quadrature over a range: the spread of a prior that its range cuts off


@dataclass(frozen=True)
class Prior:
    """One prior, SI: mean and sd; median and factor (standard deviation of the logarithm: log factor); ends; 0, sd."""

    kind: str
    first: float
    second: float

    def told(self, unit: str) -> str:
        """In words."""
        first = showing.show(self.first, unit)
        if self.kind == "normal":
            return f"normal {showing.show(self.first, unit, self.second)}"
        if self.kind == "log-normal":
            return f"log-normal {first}, factor {self.second:.3g}"
        second = showing.show(self.second, unit)
        return f"half-normal {second}" if self.kind == "half-normal" else f"uniform {first} to {second}"

    def log_density(self, values: np.ndarray) -> np.ndarray:
        """Log-density of plain numbers (SI) inside the range, up to a constant; the same for every uniform one."""
        shape = np.shape(values)
        return np.asarray(jax.vmap(together([self]).log_density)(jnp.asarray(values).reshape(-1, 1))).reshape(shape)

    def ends(self, lower: float, upper: float) -> tuple[float, float]:
        """The part of a range in which this prior is not zero."""
        if self.kind == "uniform":
            return max(lower, self.first), min(upper, self.second)
        return (lower if self.kind == "normal" else max(lower, 0.0)), upper

    def reach(self, times: float) -> tuple[float, float]:
        """Ends of where this prior has its weight: so many standard deviations, or all of a uniform one."""
        if self.kind == "uniform":
            return self.first, self.second
        if self.kind == "log-normal":
            return self.first * self.second**-times, self.first * self.second**times
        return self.first - (times * self.second if self.kind == "normal" else 0.0), self.first + times * self.second

    def away(self, value: float) -> float:
        """By how many standard deviations a value lies off where this prior is centred; 0 for a uniform one."""
        if self.kind == "uniform":
            return 0.0
        if self.kind == "log-normal":
            return abs(math.log(max(value, 1e-300) / self.first)) / math.log(self.second)
        return abs(value - self.first) / self.second


def uniform(lower: float, upper: float) -> Prior:
    """The prior of a parameter of which only the range is known."""
    return Prior("uniform", lower, upper)


def read_prior(given: Any, unit: str, name: str) -> Prior:
    """A prior as it is written in a file; InputError if it cannot be understood."""
    if not isinstance(given, dict) or "kind" not in given:
        cure = f'write prior = {{ kind = "normal", mean = "{units.example(unit)}", sd = "{units.example(unit)}" }}'
        raise InputError(f"the prior of {name} has no kind", value=given, cure=cure)
    kind = str(given["kind"])
    if kind not in KEYS:
        raise unknown_name(f"prior of {name}:", kind, KINDS)
    for key in given:
        if key not in ("kind", *KEYS[kind]):
            raise unknown_name(f"key in the {kind} prior of {name}:", key, KEYS[kind])
    for key in KEYS[kind]:
        if key not in given:
            raise InputError(f"the {kind} prior of {name} lacks {key}", cure=f"it needs {' and '.join(KEYS[kind])}")
    values = [
        units.to_si(given[key], "1" if key == "factor" else unit, f"{key} of the prior of {name}") for key in KEYS[kind]
    ]
    return _checked(Prior(kind, *(values if len(values) == 2 else (0.0, values[0]))), name)


def check_overlap(prior: Prior, name: str, unit: str, lower: float, upper: float) -> None:
    """Refuse a prior that leaves nothing of a parameter's range (SI)."""
    below, above = prior.reach(BEYOND)
    if max(below, lower) >= min(above, upper):
        allowed = f"{showing.show(lower, unit)} to {showing.show(upper, unit)}"
        problem = f"the prior of {name} ({prior.told(unit)}) lies outside the range of {name}"
        raise InputError(problem, cure=f"{allowed} is allowed")


def stated_priors(table: dict[str, Any], effects: Sequence[Effect], path: Path, raw: bytes) -> dict[str, Prior]:
    """The priors that a model file states, by full name."""
    of_muscle = {name: (unit, -math.inf, math.inf) for name, (unit, _) in quantities().items()}  # range: the data set's
    owners = [("muscle", "", table.get("muscle", {}), of_muscle)]
    owners += [("muscle", f"@{data}", entries, of_muscle) for data, entries in table.get("muscle_of", {}).items()]
    for effect, entries in zip(effects, table.get("effect", []), strict=True):
        declared = {p.name: (p.unit, p.lower, p.upper) for p in parameters(effect)}
        owners.append((name_of(effect), "", entries, declared))
    found = {}
    for owner, data, entries, known in owners:
        for key, entry in entries.items():
            if isinstance(entry, dict):
                name, row = f"{owner}.{key}{data}", line_of(raw, key)
                _check_entry(entry, name, path, row)
                if "prior" in entry:
                    found[name] = _at(entry["prior"], known[full_names.common(key)], name, path, row)
    return found


def _check_entry(entry: dict[str, Any], name: str, path: Path, row: int | None) -> None:
    for key in entry:
        if key not in ENTRY:
            raise unknown_name(f"key of {name}:", key, ENTRY, path, row=row)


def _at(given: Any, known: tuple[str, float, float], name: str, path: Path, row: int | None) -> Prior:
    unit, lower, upper = known
    try:
        prior = read_prior(given, unit, name)
        check_overlap(prior, name, unit, lower, upper)
    except InputError as error:
        raise error.located(path, row) from None
    return prior


def _checked(prior: Prior, name: str) -> Prior:
    wrong = {
        "normal": prior.second <= 0 and "sd must be positive",
        "half-normal": prior.second <= 0 and "sd must be positive",
        "log-normal": (prior.first <= 0 or prior.second <= 1) and "median must be positive and factor above 1",
        "uniform": prior.second <= prior.first and "'to' must lie above 'from'",
    }[prior.kind]
    if wrong:
        raise InputError(f"the {prior.kind} prior of {name} cannot be: {wrong}", cure="correct it in the model file")
    return prior


class Priors(eqx.Module):
    """The priors of the free parameters, in their order."""

    kind: jax.Array  # position in `KINDS`
    first: jax.Array
    second: jax.Array

    def log_density(self, values: jax.Array) -> jax.Array:
        """Log-density of each value (SI) inside its range, up to a constant."""
        normal = -0.5 * ((values - self.first) / self.second) ** 2
        positive = jnp.maximum(values, 1e-300)
        median, factor = jnp.where(self.kind == 1, self.first, 1.0), jnp.where(self.kind == 1, self.second, 2.0)
        log_normal = -0.5 * (jnp.log(positive / median) / jnp.log(factor)) ** 2 - jnp.log(positive)
        return jnp.select([self.kind == 1, self.kind == 2], [log_normal, jnp.zeros_like(values)], normal)


def together(priors: Sequence[Prior]) -> Priors:
    """Priors side by side."""
    kind = jnp.asarray([KINDS.index(prior.kind) for prior in priors], int)
    first, second = (np.array([getattr(p, name) for p in priors], float) for name in ("first", "second"))
    return Priors(kind, jnp.asarray(first), jnp.asarray(second))


def spread(prior: Prior, lower: float, upper: float) -> float:
    """Standard deviation of a prior that is cut off at the ends of a range."""
    lower, upper = prior.ends(lower, upper)
    if prior.kind == "uniform":
        return (upper - lower) / np.sqrt(12)
    x = _grid(prior, lower, upper)
    log = prior.log_density(x)
    weight = np.exp(log - log.max()) * np.gradient(x)
    mean = np.average(x, weights=weight)
    return float(np.sqrt(np.average((x - mean) ** 2, weights=weight)))


def _grid(prior: Prior, lower: float, upper: float) -> np.ndarray:
    """Points that are dense where the prior is."""
    below, above = prior.reach(8.0)
    if prior.kind == "log-normal":
        return np.geomspace(max(lower, below, 1e-300), min(upper, above), GRID)
    return np.linspace(max(lower, below), min(upper, above), GRID)
