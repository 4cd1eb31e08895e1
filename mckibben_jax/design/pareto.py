"""Trade-offs: the designs none of which can be better in one quantity without being worse in another.

The best of the first quantity, with the second held at least at one of several levels between the two ends
(epsilon-constraint method; Haimes, Lasdon & Wismer 1971). All laws are compiled once.
"""

import dataclasses
from dataclasses import dataclass

import jax
import numpy as np

from mckibben_jax.design.best import Design, Limit, Task, limits_of, quantities_of, search_of, settle
from mckibben_jax.design.merit import At
from mckibben_jax.design.optimum import Search, climb

STARTS = 2  # of each point, besides the end of the point before


@dataclass(frozen=True)
class Second:
    """The other quantity of a trade-off."""

    quantity: str
    at: At
    maximise: bool = True
    points: int = 12


def front(task: Task, second: Second) -> list[Design]:
    """Designs from the best of the objective to the best of the second quantity, which is their last constraint.

    A task that cannot be met gives one design, which says so.
    """
    sign = 1.0 if second.maximise else -1.0
    open_end = Limit(second.quantity, second.at)
    whole = dataclasses.replace(task, constraints=(*task.constraints, open_end))
    row = len(whole.constraints)
    with jax.enable_x64(True):
        search = search_of(whole, quantities_of(whole))
        first = settle(whole, search)
        if first.outcome == "infeasible":
            return [first]
        other = search.aimed(row, sign, limits_of(task), task.starts)
        last = _best(other)
        low, high = first.constraints[-1].value, float(other.at(last)[0][row])
        if not sign * (high - low) > 1e-9 * abs(high):
            return [first]  # the same design is the best of both
        found = [first]
        for level in np.linspace(low, high, second.points)[1:]:
            held = Limit(second.quantity, second.at, **{"min" if second.maximise else "max": float(level)})
            point = dataclasses.replace(task, constraints=(*task.constraints, held))
            aimed = search.aimed(0, search.sign, limits_of(point), STARTS)
            found.append(settle(point, aimed, [_place(search, task, found[-1]), last]))
    return found


def _best(search: Search) -> np.ndarray:
    ends = [climb(search, x) for x in search.starts]
    return min(ends, key=lambda x: (search.violation(x) > 1e-6, search.cost(x)))


def _place(search: Search, task: Task, found: Design) -> np.ndarray:
    values = np.array([float(getattr(found.muscle, name)) for name in task.variables])
    return np.clip((values - search.low) / search.span, 0.0, 1.0)
