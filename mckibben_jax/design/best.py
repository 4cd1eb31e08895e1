"""The best muscle for a task: the largest objective within constraints, by gradients, and how far it can be trusted.

Several starts of sequential quadratic programming (scipy's SLSQP) with exact derivatives. What it says of itself does
not count: a design is optimal when the Karush-Kuhn-Tucker conditions hold there, and their multipliers are what each
limit costs. Where no design meets all constraints, the least possible violation is sought, and the constraints that
hold it up are named. Optima are local; starts are spread over the ranges.
"""

import dataclasses
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import jax
import numpy as np

from mckibben_jax.design import merit
from mckibben_jax.design.merit import QUANTITIES, At, built
from mckibben_jax.design.optimum import ACTIVE, NEAR, Search, climb, multipliers, nearest
from mckibben_jax.effect import Effect
from mckibben_jax.effects import BladderNeoHookean, IdealCylinder
from mckibben_jax.muscle import Muscle
from mckibben_jax.muscle import quantities as muscle_quantities

DESIGN_BASELINE: tuple[type[Effect], ...] = (IdealCylinder, BladderNeoHookean)
SAME = 1e-5  # of the objective: so far apart may be what different starts call the same best
STATIONARY = 1e-4  # of the objective's slope: what may be left of it


@dataclass(frozen=True)
class Limit:
    """A constraint on a quantity, SI; None where it has no lower or no upper limit."""

    quantity: str
    at: At = field(default_factory=dict)
    min: float | None = None
    max: float | None = None


@dataclass(frozen=True)
class Task:
    """What is wanted: the objective over ranges of the muscle's dimensions, within constraints. SI throughout."""

    muscle: Muscle
    variables: dict[str, tuple[float, float]]
    objective: str
    at: At = field(default_factory=dict)
    constraints: tuple[Limit, ...] = ()
    effects: tuple[Effect, ...] = field(default_factory=lambda: tuple(kind() for kind in DESIGN_BASELINE))
    maximise: bool = True
    starts: int = 16
    seed: int = 0


@dataclass(frozen=True)
class Met:
    """How a limit, or the range of a variable, is met. `multiplier`: what the objective gains per unit of relaxation.

    `relative` is the same as percent of the objective per percent of the limit.
    """

    quantity: str
    at: At
    value: float
    min: float | None
    max: float | None
    unit: str
    active: bool
    multiplier: float
    relative: float


@dataclass(frozen=True)
class Design:
    """A design and its warrant. `outcome` is optimal, infeasible or not converged."""

    muscle: Muscle
    objective: str
    at: At
    value: float
    unit: str
    constraints: tuple[Met, ...]
    variables: tuple[Met, ...]
    outcome: str
    fighting: tuple[str, ...]  # constraints and ranges that cannot be met together
    miss: float  # largest relative violation
    stationarity: float  # share of the objective's slope that no active limit accounts for
    starts: str
    sensitivity: dict[str, dict[str, float]]  # per cent of a quantity per per cent of a variable


# The task as a function --------------------------------------------------------------------------------------------


def with_values(task: Task, values: Any) -> Muscle:
    """The task's muscle with these values of the variables, in their order."""
    return dataclasses.replace(task.muscle, **dict(zip(task.variables, values, strict=True)))


def wanted_of(task: Task) -> list[tuple[str, At]]:
    """Objective, then the constrained quantities, each with its conditions."""
    return [(task.objective, task.at), *((c.quantity, c.at) for c in task.constraints)]


def quantities_of(task: Task) -> Callable[[Any], jax.Array]:
    """The quantities of `wanted_of` as a differentiable function of the variables in SI."""
    wanted = wanted_of(task)
    return lambda values: merit.evaluate(built(with_values(task, values), task.effects), wanted)


# Searching -----------------------------------------------------------------------------------------------------------


def design(task: Task) -> Design:
    """The best design within the constraints, or why there is none. Works in 64 bits whatever the setting."""
    with jax.enable_x64(True):
        return settle(task, search_of(task, quantities_of(task)))


def settle(task: Task, search: Search, more: Sequence[np.ndarray] = ()) -> Design:
    """The best design that the search's starts, and `more` of them, lead to."""
    ends = [climb(search, x, NEAR) for x in (*more, *search.starts)]
    good = [x for x in ends if search.violation(x) <= ACTIVE]
    if not good:
        closest = nearest(search)
        if search.violation(closest) > ACTIVE:
            return _conclude(task, search, closest, "infeasible", f"{len(ends)} starts: none met all constraints")
        good = [x for x in (climb(search, closest), closest) if search.violation(x) <= ACTIVE]
    best = min(good, key=search.cost)
    same = sum(search.cost(x) - search.cost(best) <= SAME * abs(search.cost(best)) for x in good)
    best = _sharper(search, best)
    sure = multipliers(search, best)[1] <= STATIONARY
    told = f"{len(ends)} starts: {same} reached the same best design"
    return _conclude(task, search, best, "optimal" if sure else "not converged", told)


def _sharper(search: Search, x: np.ndarray) -> np.ndarray:
    """The optimum that x is near to; x itself where the conditions of an optimum hold better there."""
    ends = [end for end in (climb(search, x), x) if search.violation(end) <= ACTIVE]
    return min(ends, key=lambda end: multipliers(search, end)[1])


def limits_of(task: Task) -> list[tuple[int, float, float]]:
    """Both sides of every constraint: row of `quantities_of`, limit, +1 for a lower and -1 for an upper one."""
    return [
        (row, limit, sign)
        for row, c in enumerate(task.constraints, 1)
        for limit, sign in ((c.min, 1.0), (c.max, -1.0))
        if limit is not None
    ]


def search_of(task: Task, law: Callable[[Any], jax.Array]) -> Search:
    """The task as a search over the unit box; `law` gives its quantities, as `quantities_of` or otherwise."""
    low, high = np.array(list(task.variables.values()), float).T
    return Search(law, low, high, limits_of(task), 1.0 if task.maximise else -1.0, task.starts, task.seed)


def _conclude(task: Task, search: Search, x: np.ndarray, outcome: str, starts: str) -> Design:
    infeasible, miss = outcome == "infeasible", search.violation(x)
    prices, left = multipliers(search, x, miss if infeasible else 0.0)
    limits, ranges = _limits(task, search, x, prices), _ranges(task, search, x, prices)
    fighting = tuple(m.quantity for m in (*limits, *ranges) if m.multiplier > 0) if infeasible else ()
    if infeasible:  # nothing was optimised, so that nothing has a price
        limits, ranges = ([dataclasses.replace(m, multiplier=0.0, relative=0.0) for m in ms] for ms in (limits, ranges))
    return Design(
        muscle=with_values(task, search.low + x * search.span),
        objective=task.objective,
        at=task.at,
        value=float(search.at(x)[0][0]),
        unit=QUANTITIES[task.objective].unit,
        constraints=tuple(limits),
        variables=tuple(ranges),
        outcome=outcome,
        fighting=fighting,
        miss=miss,
        stationarity=left,
        starts=starts,
        sensitivity=_sensitivity(task, search, x),
    )


def _sensitivity(task: Task, search: Search, x: np.ndarray) -> dict[str, dict[str, float]]:
    """Per cent by which each quantity grows for one per cent more of each variable, by variable and quantity."""
    values, slopes = search.at(x)
    place = search.low + x * search.span
    names = [task.objective, *(c.quantity for c in task.constraints)]
    with np.errstate(divide="ignore", invalid="ignore"):
        shares = slopes / search.span * place / values[:, None]
    rows = {name: names.index(name) for name in names}  # of a quantity at several places the first
    return {v: {name: float(shares[row, i]) for name, row in rows.items()} for i, v in enumerate(task.variables)}


def _limits(task: Task, search: Search, x: np.ndarray, prices: np.ndarray) -> list[Met]:
    values, gaps = search.at(x)[0], search.gaps(x)
    told = []
    for row, c in enumerate(task.constraints, 1):
        mine = [i for i, side in enumerate(search.sides) if side.row == row]
        gain = sum(prices[i] / search.sides[i].scale for i in mine) * search.typical[0]
        limit = max((abs(search.sides[i].limit) for i in mine if prices[i] > 0), default=0.0)
        told.append(
            Met(c.quantity, c.at, float(values[row]), c.min, c.max, QUANTITIES[c.quantity].unit,
                bool(np.any(gaps[mine] <= ACTIVE)), float(gain), _relative(gain, limit, values[0]))
        )  # fmt: skip
    return told


def _ranges(task: Task, search: Search, x: np.ndarray, prices: np.ndarray) -> list[Met]:
    count, known = len(x), muscle_quantities()
    lower, upper = prices[-2 * count : -count], prices[-count:]
    told = []
    for i, (name, (low, high)) in enumerate(task.variables.items()):
        gain = (lower[i] + upper[i]) / search.span[i] * search.typical[0]
        at_end = bool(x[i] <= ACTIVE or x[i] >= 1 - ACTIVE)
        limit = low if lower[i] > 0 else high
        value = float(low + x[i] * search.span[i])
        share = _relative(gain, limit, search.at(x)[0][0])
        told.append(Met(name, {}, value, low, high, known[name][0], at_end, float(gain), share))
    return told


def _relative(gain: float, limit: float, objective: float) -> float:
    return float(gain * abs(limit) / abs(objective)) if objective else 0.0


# For machines --------------------------------------------------------------------------------------------------------


def to_json(found: Design) -> dict[str, Any]:
    """The design for machines: SI, units in keys or beside."""
    muscle = {
        name if unit == "1" else f"{name}_{unit}": float(value)
        for name, (unit, _) in muscle_quantities().items()
        if (value := getattr(found.muscle, name)) is not None
    }
    return {
        "muscle": muscle,
        "objective": {"quantity": found.objective, "at": found.at, "value": found.value, "unit": found.unit},
        "constraints": [dataclasses.asdict(m) for m in found.constraints],
        "variables": [dataclasses.asdict(m) for m in found.variables],
        "outcome": found.outcome,
        "fighting": list(found.fighting),
        "largest_relative_violation": found.miss,
        "stationarity": found.stationarity,
        "starts": found.starts,
        "sensitivity": found.sensitivity,
    }
