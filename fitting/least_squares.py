"""Fit what may vary to what was measured: optimistix, in a box, from several starts in one compiled call."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import optimistix as optx
from jaxtyping import ArrayLike
from scipy.stats import qmc

from fitting.precision import require_x64
from fitting.residuals import Problem, Samples, problem
from fitting.solving.box import BoxLevenbergMarquardt
from fitting.solving.uncertainty import at_bound, clusters, covariances, ties
from fitting.solving.unknowns import Unknowns, unknowns

BLIND = 1e-7  # of the strongest column: a parameter whose whole range moves the rows by less cannot be seen
MAX_STEPS = 150


class Subset(eqx.Module):
    """One fit among many that share a compiled function: which effects are there, which numbers are free.

    Where `turned` is not 0, that many switches stand behind the unknowns in `full` and may be free like them: the
    slopes along them are the signatures of missing effects.
    """

    full: jax.Array  # every unknown
    free: jax.Array  # positions of those that vary
    switches: jax.Array
    live: jax.Array
    lower: jax.Array  # of every unknown
    upper: jax.Array
    logarithmic: jax.Array
    turned: int = eqx.field(static=True, default=0)

    def vector(self, place: jax.Array) -> jax.Array:
        """All unknowns, from the free ones' places in the unit box."""
        lower, upper, log = self.lower[self.free], self.upper[self.free], self.logarithmic[self.free]
        low, high = jnp.where(log, lower, 1.0), jnp.where(log, upper, 1.0)
        straight = lower + place * (upper - lower)
        return self.full.at[self.free].set(jnp.where(log, low * (high / low) ** place, straight))

    def point(self, place: jax.Array) -> tuple[jax.Array, jax.Array]:
        """All unknowns, and all switches."""
        whole = self.vector(place)
        return (whole[: -self.turned], whole[-self.turned :]) if self.turned else (whole, self.switches)

    def place(self, vector: jax.Array) -> jax.Array:
        """The inverse of `vector`."""
        x, lower, upper = vector[self.free], self.lower[self.free], self.upper[self.free]
        log = self.logarithmic[self.free]
        low, high, at = jnp.where(log, lower, 1.0), jnp.where(log, upper, 2.0), jnp.where(log, x, 1.0)
        straight = (x - lower) / (upper - lower)
        return jnp.clip(jnp.where(log, jnp.log(at / low) / jnp.log(high / low), straight), 0.0, 1.0)

    def slope(self, place: jax.Array) -> jax.Array:
        """d(free unknowns)/d(place)."""
        return jax.jvp(self.vector, (place,), (jnp.ones_like(place),))[1][self.free]


@jax.jit
def rows_and_slopes(given: Problem, subset: Subset, place: jax.Array) -> tuple[jax.Array, jax.Array]:
    """All rows and their Jacobian (rows, free) with respect to the free unknowns' places in the unit box.

    Tangents are pushed forward together, once; `jax.linearize` would store every step of every scan.
    """

    def rows(at: jax.Array) -> jax.Array:
        return given.rows(*subset.point(at), subset.live)

    one = lambda tangent: jax.jvp(rows, (place,), (tangent,))  # noqa: E731
    return jax.vmap(one, out_axes=(None, 1))(jnp.eye(place.size))


def _with_slopes(evaluate: Callable) -> Callable:
    """The rows as a function of (problem, subset, place) whose derivative is the slopes that came with them."""

    @jax.custom_jvp
    def rows(given: Problem, subset: Subset, place: jax.Array) -> jax.Array:
        return evaluate(given, subset, place)[0]

    @rows.defjvp
    def _(primals, tangents):  # type: ignore[no-untyped-def]
        value, slopes = evaluate(*primals)
        return value, slopes @ tangents[2]

    return rows


class Ended(eqx.Module):
    """Where one search ended: place in the unit box, half the sum of squares, and whether it converged."""

    place: jax.Array
    cost: jax.Array
    converged: jax.Array
    steps: jax.Array


class Solved(eqx.Module):
    """Every search's end (leading axis: starts), and rows and slopes at the best of them."""

    ends: Ended
    place: jax.Array
    cost: jax.Array
    rows: jax.Array
    slopes: jax.Array


@eqx.filter_jit
def solve(
    given: Problem, subset: Subset, starts: jax.Array, steps: int = MAX_STEPS, look: ArrayLike = False
) -> Solved:
    """Search from each start (starts, free) in turn; a loop over starts, for on a CPU it beats a batch of solvers.

    `look`, which may be traced, ends each search at its start: rows and slopes there, without another compilation. Only
    the best point's rows and slopes are kept, so that memory does not grow with the number of starts.
    """

    def one(best: tuple, start: jax.Array) -> tuple[tuple, Ended]:
        solver = BoxLevenbergMarquardt(jnp.zeros_like(start), jnp.ones_like(start), look=look)
        fn = lambda at, args: rows(*args, at)  # noqa: E731
        found = optx.least_squares(fn, solver, start, args=(given, subset), max_steps=steps, throw=False)
        info = found.state.f_info  # type: ignore[attr-defined]
        cost = 0.5 * jnp.sum(info.residual**2)
        cost = jnp.where(jnp.isfinite(cost), cost, jnp.inf)
        end = Ended(found.value, cost, found.result == optx.RESULTS.successful, found.stats["num_steps"])
        mine = (found.value, cost, info.residual, info.jac.as_matrix())
        return jax.tree.map(lambda a, b: jnp.where(cost < best[1], b, a), best, mine), end

    # python runs through the model once, however often the solver looks at its derivatives
    rows = _with_slopes(eqx.filter_closure_convert(rows_and_slopes, given, subset, starts[0]))
    count = sum(block.keep.size for block in given.blocks) + given.prior_at.size
    free = starts.shape[1]
    nowhere = (starts[0], jnp.asarray(jnp.inf), jnp.full(count, jnp.nan), jnp.full((count, free), jnp.nan))
    best, ends = jax.lax.scan(one, nowhere, starts)
    return Solved(ends, *best)


@dataclass(frozen=True)
class Fit:
    """A fitted model with all that is known of how well it is known. Arrays over `free` are in that order."""

    layout: Unknowns
    problem: Problem
    samples: Samples
    free: tuple[str, ...]
    held: tuple[str, ...]  # asked to vary, but these data cannot see them
    vector: np.ndarray
    switches: np.ndarray
    residual: np.ndarray  # model minus measurement in the recording's unit, as `samples`
    slopes: np.ndarray  # rows over free, in standard deviations per unit of the parameter
    covariance: np.ndarray
    robust: np.ndarray
    at_bound: tuple[str, ...]
    tied: dict[str, tuple[str, ...]]
    converged: bool
    starts: str
    failures: tuple[str, ...]

    @property
    def rmse(self) -> float:
        """Root mean square of the residual over the samples that carry weight."""
        return float(np.sqrt(np.mean(self.residual**2)))

    @property
    def values(self) -> dict[str, float]:
        """Every unknown by its full name, SI."""
        return dict(zip(self.layout.names, map(float, self.vector), strict=True))

    def model(self, dataset: int = 0):
        """The fitted model of one data set."""
        return self.layout.model(jnp.asarray(self.vector), dataset)

    def error(self, name: str, robust: bool = True) -> float:
        """Standard error of a free parameter, SI; NaN for one that did not vary."""
        if name not in self.free:
            return float("nan")
        i = self.free.index(name)
        return float(np.sqrt((self.robust if robust else self.covariance)[i, i]))


def free_names(layout: Unknowns, fix: Sequence[str] = (), free: Sequence[str] = ()) -> tuple[str, ...]:
    """What varies unless told otherwise: the effects' parameters, and whatever has a prior."""
    chosen = [
        entry.name
        for entry in layout.entries
        if not entry.name.startswith("muscle.") or entry.prior is not None or _listed(entry.name, free)
    ]
    return tuple(name for name in chosen if not _listed(name, fix))


def _listed(name: str, listed: Sequence[str]) -> bool:
    return name in listed or name.split("@")[0] in listed


def subset_of(layout: Unknowns, vector: np.ndarray, free: Sequence[str], switches=None, live=None) -> Subset:
    """The subset in which just these names vary, around a vector of all unknowns."""
    count = len(layout.templates[0].effects)
    return Subset(
        jnp.asarray(vector),
        jnp.asarray(layout.at(free), int),
        jnp.ones(count) if switches is None else jnp.asarray(switches, float),
        jnp.ones(count, bool) if live is None else jnp.asarray(live, bool),
        jnp.asarray(layout.lower),
        jnp.asarray(layout.upper),
        jnp.asarray(layout.logarithmic),
    )


def seen(given: Problem, subset: Subset, names: Sequence[str]) -> tuple[str, ...]:
    """Those of the free names that move the measured rows at all."""
    count = sum(int(block.keep.size) for block in given.blocks)
    _, slopes = rows_and_slopes(given, subset, jnp.clip(subset.place(subset.full), 0.01, 0.99))
    moves = np.linalg.norm(np.asarray(slopes)[:count], axis=0)
    return tuple(name for name, move in zip(names, moves, strict=True) if move > BLIND * max(moves.max(), 1e-300))


def starting_places(layout: Unknowns, subset: Subset, names: Sequence[str], count: int, seed: int) -> np.ndarray:
    """Where to begin: at the declared starts, then spread over the effects' ranges; the muscle as it was measured."""
    at = layout.at(names)
    first = np.asarray(subset.full).copy()
    for i in at:
        first[i] = layout.entries[i].starts[0]
    declared = [first]
    for i in at:
        for other in layout.entries[i].starts[1:]:
            declared.append(first.copy())
            declared[-1][i] = other
    places = [np.asarray(subset.place(jnp.asarray(vector))) for vector in [np.asarray(subset.full), *declared]]
    spread = qmc.Sobol(max(len(at), 1), rng=seed).random_base2(6) if len(at) else np.zeros((0, 0))
    own = np.array([layout.entries[i].name.startswith("muscle.") for i in at], bool)
    more = [np.where(own, places[0], 0.02 + 0.6 * row) for row in spread]
    return np.array([*places, *more][: max(count, 1)])


def fit(
    experiments: Sequence,
    effects: Sequence,
    *,
    fix: Sequence[str] = (),
    free: Sequence[str] = (),
    own: Sequence[str] = (),
    start: dict[str, float] | None = None,
    starts: int = 8,
    seed: int = 0,
) -> Fit:
    """Fit a set of effects to data sets.

    `experiments` from `read_experiment`, `effects` as instances whose values are where the search starts. `fix` and
    `free` name parameters; `own` those that each data set has for itself; `start` gives other starting values (SI).
    """
    require_x64()
    layout = unknowns(experiments, effects, own)
    given, samples = problem(experiments, layout)
    vector = layout.start.copy()
    for name, value in (start or {}).items():
        if name in layout.names:
            vector[layout.names.index(name)] = value
    return fit_problem(layout, given, samples, vector, free_names(layout, fix, free), starts=starts, seed=seed)


def fit_problem(
    layout: Unknowns,
    given: Problem,
    samples: Samples,
    vector: np.ndarray,
    names: Sequence[str],
    *,
    starts: int = 8,
    seed: int = 0,
) -> Fit:
    """Fit the named unknowns of a problem that is laid out already."""
    asked = tuple(names)
    if not asked:
        return _evaluated(layout, given, samples, vector)
    names = seen(given, subset_of(layout, vector, asked), asked) if asked else ()
    held = tuple(name for name in asked if name not in names)
    subset = subset_of(layout, vector, names)
    begin = starting_places(layout, subset, names, starts, seed)
    found = jax.tree.map(np.asarray, solve(given, subset, jnp.asarray(begin)))
    return _conclude(layout, given, samples, subset, names, held, found, begin)


def _evaluated(layout: Unknowns, given: Problem, samples: Samples, vector: np.ndarray) -> Fit:
    rows = np.asarray(given.rows(jnp.asarray(vector), layout.templates[0].switches))[: len(samples)]
    none = np.zeros((0, 0))
    slopes = np.zeros((len(samples), 0))
    residual, switches = rows * samples.sigma, np.asarray(layout.templates[0].switches)
    return Fit(
        layout, given, samples, (), (), vector, switches, residual, slopes, none, none, (), {}, True, "not fitted", ()
    )


def _conclude(
    layout: Unknowns,
    given: Problem,
    samples: Samples,
    subset: Subset,
    names: tuple[str, ...],
    held: tuple[str, ...],
    found: Solved,
    begin: np.ndarray,
) -> Fit:
    place = jnp.asarray(found.place)
    rows, slopes = np.asarray(found.rows), np.asarray(found.slopes)
    per_unit = slopes / np.asarray(subset.slope(place))
    data, priors = per_unit[: len(samples)], per_unit[len(samples) :]
    covariance, robust = covariances(data, rows[: len(samples)], priors, clusters(samples))
    return Fit(
        layout=layout,
        problem=given,
        samples=samples,
        free=tuple(names),
        held=held,
        vector=np.asarray(subset.vector(place)),
        switches=np.asarray(subset.switches),
        residual=rows[: len(samples)] * samples.sigma,
        slopes=per_unit,
        covariance=covariance,
        robust=robust,
        at_bound=at_bound(names, np.asarray(place)),
        tied=ties(names, slopes),
        converged=bool(np.any(found.ends.converged & _best(found.ends)) or _flat(rows, slopes, np.asarray(place))),
        starts=_told(found.ends),
        failures=_failures(given, subset, samples, found.ends, begin),
    )


def _flat(rows: np.ndarray, slopes: np.ndarray, place: np.ndarray) -> bool:
    """Whether no direction into the box leads down: the angle between rows and slopes is right."""
    gradient = slopes.T @ rows
    inward = np.where((place < 1e-9) & (gradient > 0) | (place > 1 - 1e-9) & (gradient < 0), 0.0, gradient)
    scale = np.linalg.norm(slopes, axis=0) * np.linalg.norm(rows) + 1e-300
    return bool(np.all(np.abs(inward) < 1e-5 * scale))


def _told(found: Ended) -> str:
    best = np.min(found.cost)
    if not np.isfinite(best):
        return f"none of {len(found.cost)} starts gave finite numbers"
    return f"{len(found.cost)} starts: {int(np.sum(_best(found)))} reached the same best point"


def _best(found: Ended) -> np.ndarray:
    """Which searches ended as low as the best."""
    return np.asarray(found.cost <= np.min(found.cost) * (1 + 1e-4) + 1e-6)


def _failures(given: Problem, subset: Subset, samples: Samples, found: Ended, begin: np.ndarray) -> tuple[str, ...]:
    told = []
    for i in np.flatnonzero(~np.isfinite(found.cost)):
        rows, _ = rows_and_slopes(given, subset, jnp.asarray(begin[i]))
        bad = np.flatnonzero(~np.isfinite(np.asarray(rows)[: len(samples)]))
        if len(bad):
            s = samples
            told.append(
                f"start {i + 1}: the model gives no finite number at row {s.row[bad[0]]} "
                f"(contraction {s.contraction[bad[0]]:.4f}, {s.pressure[bad[0]] / 1e3:.1f} kPa, {s.rate[bad[0]]:.4g}/s)"
            )
        else:
            told.append(f"start {i + 1}: the search met a state without finite numbers and stopped")
    return tuple(told)
