"""Optima in a box under inequality constraints, and whether they are: the Karush-Kuhn-Tucker conditions, checked.

Sequential quadratic programming (scipy's SLSQP) with exact derivatives, over the unit box. Whether its answer is an
optimum is not left to its own flag: at 1e-12 it fails "successfully", and the other way round.
"""

import copy
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from scipy.optimize import Bounds, minimize, nnls
from scipy.stats import qmc

ACTIVE = 1e-6  # of a limit, or of a range: so close is at it
CLOSE, NEAR = 1e-12, 1e-8  # of the cost: an optimum, and as near to one as it takes to know which it is
LOOKS = 9  # log2 of the places that are looked at before a search
NOWHERE = 1e3  # cost, and relative violation, where the laws give no number


class Side:
    """One side of one limit: sign (value - limit) / scale must not be negative."""

    def __init__(self, row: int, limit: float, sign: float, typical: float):
        self.row, self.limit, self.sign = row, limit, sign
        self.scale = abs(limit) or typical


Limits = list[tuple[int, float, float]]  # row, limit, and +1 where it is a lower one, -1 where it is an upper one


class Search:
    """An objective (row 0 of `law`) and limits on the other rows, over ranges that are mapped to the unit box.

    `sign` is +1 to maximise. A first look, in one compiled call, at places all over the box says what sizes are typical
    and where to start: at the best of them, none near another.
    """

    def __init__(
        self, law: Callable[[Any], jax.Array], low: Any, high: Any, limits: Limits, sign: float = 1.0, starts: int = 16,
        seed: int = 0,
    ):  # fmt: skip
        self.low, self.high = np.asarray(low, float), np.asarray(high, float)
        self.span = self.high - self.low
        place = lambda x: law(self.low + x * self.span)  # noqa: E731
        self._both = jax.jit(lambda x: _with_slopes(place, x))
        self._last: tuple[bytes, np.ndarray, np.ndarray] | None = None
        self.calls = 0  # of values with slopes
        self.looked = np.vstack([np.full((1, len(self.low)), 0.5), _sobol(len(self.low), seed)])
        self.seen = np.asarray(jax.jit(jax.vmap(place))(jnp.asarray(self.looked)))
        self.typical = _typical(self.seen)
        self._aim(0, sign, limits, starts)

    def _aim(self, goal: int, sign: float, limits: Limits, starts: int) -> None:
        self.goal, self.sign = goal, sign
        self.sides = [Side(row, limit, way, self.typical[row]) for row, limit, way in limits]
        self._rows = np.array([side.row for side in self.sides], int)
        self._limits = np.array([side.limit for side in self.sides])
        self._ways = np.array([side.sign / side.scale for side in self.sides])
        self.starts = self._spread(max(starts, 1))

    def aimed(self, goal: int, sign: float, limits: Limits, starts: int) -> "Search":
        """The same laws, compiled once, with another row as objective and other limits."""
        other = copy.copy(self)
        other._aim(goal, sign, limits, starts)
        return other

    def _spread(self, count: int) -> np.ndarray:
        """The best places seen, none within a distance of another that leaves room for so many, the middle first."""
        costs = -self.sign * self.seen[:, self.goal] / self.typical[self.goal]
        misses = -self._gaps(self.seen).min(axis=1, initial=0.0)
        order = np.lexsort((np.nan_to_num(costs, nan=NOWHERE), misses))
        apart = 0.5 / count ** (1 / len(self.low))
        chosen = [self.looked[0]]
        for x in self.looked[order]:
            if len(chosen) < count and min(np.linalg.norm(x - other) for other in chosen) > apart:
                chosen.append(x)
        return np.array(chosen)

    def at(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Values and slopes; where the laws give no number, no slope."""
        key = np.asarray(x, float).tobytes()
        if self._last is None or self._last[0] != key:
            both = np.asarray(self._both(np.asarray(x, float)))
            self.calls += 1
            self._last = (key, both[:, 0], both[:, 1:])
        return self._last[1], self._last[2]

    def cost(self, x: np.ndarray) -> float:
        """What is minimised: the objective over its typical size, its sign turned where it is maximised."""
        cost = float(-self.sign * self.at(x)[0][self.goal] / self.typical[self.goal])
        return cost if np.isfinite(cost) else NOWHERE

    def cost_slope(self, x: np.ndarray) -> np.ndarray:
        """Its slope."""
        return -self.sign * self.at(x)[1][self.goal] / self.typical[self.goal]

    def gaps(self, x: np.ndarray) -> np.ndarray:
        """Distances from all limits, relative to them; negative beyond, and where the laws give no number."""
        return self._gaps(self.at(x)[0])

    def _gaps(self, values: np.ndarray) -> np.ndarray:
        gaps = self._ways * (values[..., self._rows] - self._limits)
        return np.where(np.isfinite(gaps), gaps, -NOWHERE)

    def gap_slopes(self, x: np.ndarray) -> np.ndarray:
        """Their slopes."""
        return self._ways[:, None] * self.at(x)[1][self._rows]

    def violation(self, x: np.ndarray) -> float:
        """The largest share by which a limit is missed."""
        return float(max(0.0, -self.gaps(x).min(initial=0.0)))


def _with_slopes(law: Callable[[Any], jax.Array], x: jax.Array) -> jax.Array:
    """Values in the first column, slopes in the others; where the laws give no number, no slope."""
    slopes = jnp.nan_to_num(jax.jacfwd(law)(x), posinf=0.0, neginf=0.0)
    return jnp.hstack([law(x)[:, None], slopes])


def _sobol(count: int, seed: int) -> np.ndarray:
    return qmc.Sobol(count, seed=seed).random_base2(LOOKS)  # type: ignore[call-arg]  # scipy's decorator hides the name


def _typical(values: np.ndarray) -> np.ndarray:
    known = np.where(np.isfinite(values), np.abs(values), 0.0)
    middle = np.median(known, axis=0)
    return np.where(middle > 0, middle, 1.0)


def climb(search: Search, x: np.ndarray, close: float = CLOSE) -> np.ndarray:
    """The best place that can be reached from x, until a step changes the cost by less than `close`."""
    limits = {"type": "ineq", "fun": search.gaps, "jac": search.gap_slopes}
    found = minimize(
        search.cost, x, jac=search.cost_slope, bounds=Bounds(0.0, 1.0), method="SLSQP",
        constraints=[limits] if search.sides else [], options={"ftol": close, "maxiter": 200},
    )  # fmt: skip
    return np.clip(found.x, 0.0, 1.0)


def nearest(search: Search) -> np.ndarray:
    """Where the largest violation is least: min t with every gap >= -t."""
    limits = {
        "type": "ineq",
        "fun": lambda z: search.gaps(z[:-1]) + z[-1],
        "jac": lambda z: np.hstack([search.gap_slopes(z[:-1]), np.ones((len(search.sides), 1))]),
    }
    count = len(search.low)
    slope = np.append(np.zeros(count), 1.0)
    box = Bounds(np.zeros(count + 1), np.append(np.ones(count), np.inf))  # type: ignore[arg-type]
    ends = []
    for x in search.starts:
        found = minimize(
            lambda z: z[-1], np.append(x, search.violation(x)), jac=lambda z: slope, bounds=box, method="SLSQP",
            constraints=[limits], options={"ftol": 1e-12, "maxiter": 200},
        )  # fmt: skip
        ends.append(np.clip(found.x[:-1], 0.0, 1.0))
    return min(ends, key=search.violation)


def multipliers(search: Search, x: np.ndarray, violated: float = 0.0) -> tuple[np.ndarray, float]:
    """Multipliers of all sides, then of the lower and upper ends of the ranges; and the share of slope left over.

    They are the non-negative ones that balance the slope of the cost best. With `violated`, those that hold up the
    least violation: they balance each other, those of the sides adding up to 1.
    """
    count, gaps = len(x), search.gaps(x)
    columns = np.vstack([search.gap_slopes(x), np.eye(count), -np.eye(count)])
    near = np.concatenate([gaps <= ACTIVE - violated, x <= ACTIVE, x >= 1 - ACTIVE])
    slope = search.cost_slope(x)
    if violated:
        columns = np.hstack([columns, np.r_[np.ones(len(gaps)), np.zeros(2 * count)][:, None]])
        slope = np.append(np.zeros(count), 1.0)
    found, left = np.zeros(len(near)), float(np.linalg.norm(slope))
    if near.any():
        found[near], left = nnls(columns[near].T, slope)
    return found, float(left / max(np.linalg.norm(slope), 1e-12))
