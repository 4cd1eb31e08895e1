"""What is held to be likely before the data speak: priors by name, their density, spread and end points.

In a model file, beside the value of a parameter (the unit must be that of the parameter):

    f_s  = { value = "0.02", prior = { kind = "normal", mean = "0.015", sd = "0.005" } }
    G    = { value = "300 kPa", prior = { kind = "log-normal", median = "350 kPa", factor = "1.5" } }
    beta = { value = "0.7", prior = { kind = "uniform", from = "0.5", to = "0.9" } }
    F_c  = { value = "5 N", prior = { kind = "half-normal", sd = "20 N" } }

All are cut off at the ends of the parameter's range. A parameter without one is uniform over its range, or normal where
muscle.toml gives it `+/-`.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fitting import units
from fitting.errors import InputError, unknown_name
from fitting.reading.muscle_file import line_of
from mckibben_jax.effect import Effect, name_of
from mckibben_jax.muscle import quantities
from mckibben_jax.parameter import parameters

KEYS = {"normal": ("mean", "sd"), "log-normal": ("median", "factor"), "uniform": ("from", "to"), "half-normal": ("sd",)}
KINDS = tuple(KEYS)
GRID = 20_001  # points of the quadrature over a range: the spread of a prior that its range cuts off


@dataclass(frozen=True)
class Prior:
    """One prior, SI: mean and sd; median and factor (standard deviation of the logarithm: log factor); ends; 0, sd."""

    kind: str
    first: float
    second: float

    def told(self, unit: str) -> str:
        """In words."""
        first = units.show(self.first, unit)
        if self.kind == "normal":
            return f"normal {units.show(self.first, unit, self.second)}"
        if self.kind == "log-normal":
            return f"log-normal {first}, factor {self.second:.3g}"
        second = units.show(self.second, unit)
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


def stated_priors(table: dict[str, Any], effects: Sequence[Effect], path: Path, raw: bytes) -> dict[str, Prior]:
    """The priors that a model file states, by full name."""
    of_muscle = {name: unit for name, (unit, _) in quantities().items()}
    owners = [("muscle", table.get("muscle", {}), of_muscle)]
    for effect, entries in zip(effects, table.get("effect", []), strict=True):
        owners.append((name_of(effect), entries, {p.name: p.unit for p in parameters(effect)}))
    found = {}
    for owner, entries, known in owners:
        for key, entry in entries.items():
            if isinstance(entry, dict) and "prior" in entry:
                found[f"{owner}.{key}"] = _at(entry["prior"], known[key.split("@")[0]], f"{owner}.{key}", path, raw)
    return found


def _at(given: Any, unit: str, name: str, path: Path, raw: bytes) -> Prior:
    try:
        return read_prior(given, unit, name)
    except InputError as error:
        row = line_of(raw, name.split(".", 1)[1])
        raise InputError(error.problem, path, row, value=error.value, cure=error.cure) from None


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
    if prior.kind == "log-normal":
        reach = prior.second**8
        return np.geomspace(max(lower, prior.first / reach, 1e-300), min(upper, prior.first * reach), GRID)
    centre = prior.first if prior.kind == "normal" else 0.0
    return np.linspace(max(lower, centre - 8 * prior.second), min(upper, centre + 8 * prior.second), GRID)
