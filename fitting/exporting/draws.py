"""Parameter sets that the data leave open, drawn for domain randomisation; and a model with given parameters."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fitting import full_names
from fitting.errors import InputError
from fitting.exporting.settings import EXPORT
from fitting.least_squares.record import Fit
from fitting.posterior.record import Posterior
from mckibben_jax.model import Model

LENGTH = "muscle.length"  # of which a simulator needs to know which one a draw has


@dataclass(frozen=True)
class Draws:
    """Sets of parameters, SI: `values` is (draw, parameter). `origin` says in words from where they are drawn."""

    names: tuple[str, ...]  # full names, as 'muscle.radius' and 'coulomb_friction.f_s'
    units: tuple[str, ...]
    values: np.ndarray
    origin: str

    def of(self, whole: Model) -> "Draws":
        """The same without the parameters of effects that a model does not have."""
        kept = [at for at, name in enumerate(self.names) if name.split(".")[0] in ("muscle", *whole.names)]
        names, units = (tuple(some[at] for at in kept) for some in (self.names, self.units))
        return Draws(names, units, self.values[:, kept], self.origin)

    def of_set(self, mine: Collection[str]) -> "Draws":
        """Those of one data set's full names: 'muscle.radius@a' is called 'muscle.radius' then."""
        own = {at: full_names.common(name) for at, name in enumerate(self.names) if name in mine}
        return Draws(tuple(own.values()), tuple(self.units[at] for at in own), self.values[:, [*own]], self.origin)


def posterior_draws(fit: Fit, found: Posterior, count: int, seed: int) -> Draws:
    """Draws out of the chains of a posterior; the same one twice only where there are fewer."""
    at = [found.draws.names.index(name) for name in fit.free]
    flat = found.draws.values.reshape(-1, found.draws.values.shape[-1])[:, at]
    picked = np.random.default_rng(seed).choice(len(flat), count, replace=len(flat) < count)
    trust = "" if found.trusted else "; the posterior itself warns that it must not be trusted"
    return Draws(fit.free, _units(fit), flat[picked], f"the posterior sampled by {found.method}{trust}")


def normal_draws(fit: Fit, count: int, seed: int) -> Draws:
    """Draws from the normal distribution around the fit (Laplace), within the parameters' ranges."""
    at = [fit.layout.names.index(name) for name in fit.free]
    middle, low, high = (np.asarray(some)[at] for some in (fit.vector, fit.layout.lower, fit.layout.upper))
    random, kept = np.random.default_rng(seed), np.zeros((0, len(at)))
    for _ in range(EXPORT.tries):
        drawn = random.multivariate_normal(middle, fit.robust, size=count, method="svd")
        kept = np.concatenate([kept, drawn[((drawn >= low) & (drawn <= high)).all(axis=1)]])
        if len(kept) >= count:
            origin = "a normal distribution with the robust covariance of the fit, within the ranges of the parameters"
            return Draws(fit.free, _units(fit), kept[:count], origin)
    problem = "hardly any draw from the fit's covariance lies within the ranges of the parameters"
    raise InputError(problem, cure="sample the posterior first with 'mckibben posterior'; it keeps to the ranges")


def _units(fit: Fit) -> tuple[str, ...]:
    return tuple(fit.layout.entry(name).unit for name in fit.free)


def with_parameters(whole: Model, names: Sequence[str], values: Sequence[jax.Array | float]) -> Model:
    """A model in which parameters, by full name, have these values (SI)."""
    for name, value in zip(names, values, strict=True):
        owner, key = name.split(".")
        whole = eqx.tree_at(lambda m, o=owner, k=key: getattr(_owner(m, o), k), whole, jnp.asarray(value))
    return whole


def _owner(whole: Model, owner: str):
    return whole.muscle if owner == "muscle" else whole.effects[whole.names.index(owner)]


def parameters_of(whole: Model, names: Sequence[str]) -> list[float]:
    """The values that parameters have in a model, SI."""
    return [float(getattr(_owner(whole, owner), key)) for owner, key in (name.split(".") for name in names)]
