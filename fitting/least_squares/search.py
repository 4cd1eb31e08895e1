"""One search, and many that share its compiled function: which effects are there and what varies are its arguments."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import optimistix as optx
from jaxtyping import ArrayLike

from fitting.compiled.traced import kept
from fitting.instruments.through import Through
from fitting.least_squares.box import BoxLevenbergMarquardt, OfLower
from fitting.least_squares.subset import Array, Subset

MAX_STEPS = 150  # of one search: chosen
EIGHT = 8  # slopes that are seen through instruments at once: most sets of effects have as many unknowns or fewer


class Residuals(Protocol):
    """What a search makes small: rows in standard deviations, half the sum of whose squares is the cost."""

    @property
    def count(self) -> int:
        """How many rows there are."""
        ...

    def rows(self, vector: jax.Array, switches: jax.Array, live: jax.Array | None = None) -> jax.Array:
        """All rows at these unknowns."""
        ...

    def directions(self, size: int) -> tuple[jax.Array, Callable[[jax.Array], jax.Array]]:
        """Tangents along which rows are differentiated, and all slopes from those along them."""
        ...


HERE: Any = 0  # where an array stands in what a compiled function returns


@kept(like=(HERE, HERE))
def rows_and_slopes(
    given: Residuals, subset: Subset, place: Array, through: Through | None = None, below: ArrayLike = jnp.inf
) -> tuple[jax.Array, jax.Array]:
    """All rows and their Jacobian (rows, free) with respect to the free unknowns' places in the unit box.

    As they are seen `through` instruments, if any are given. The Jacobian may be left undone (0) where half the sum of
    squares is not `below` a cost.
    """
    seen = lambda rows: rows if through is None else through(rows)  # noqa: E731
    wanted = lambda rows: ~(_cost(seen(rows)) >= below)  # noqa: E731
    if subset.varying is None:
        value, slopes = _together(given, subset, place)
        return seen(value), jax.lax.cond(wanted(value), seen, lambda slopes: slopes, slopes)
    value, slopes = _two_by_two(given, subset, place, wanted)
    return seen(value), slopes if through is None else _seen(through, slopes, wanted(value) * subset.varying)


def _seen(through: Through, slopes: jax.Array, varying: jax.Array) -> jax.Array:
    """Slopes as they are seen through instruments, along the first that vary: the others are 0.

    Along all of a standard size that was a quarter of a step, for most sets have a third of them.
    """
    count = slopes.shape[1]
    upto = [0, *range(EIGHT, count, EIGHT), count]
    some = [lambda slopes, k=k: slopes.at[:, :k].set(through(slopes[:, :k])) for k in upto]
    return jax.lax.switch((varying + EIGHT - 1) // EIGHT, some, slopes)


def _cost(rows: jax.Array) -> jax.Array:
    return 0.5 * jnp.sum(rows**2)


def _together(given: Residuals, subset: Subset, place: jax.Array) -> tuple[jax.Array, jax.Array]:
    """Tangents pushed forward together, once; `jax.linearize` would store every step of every scan."""

    def rows(at: jax.Array) -> jax.Array:
        return given.rows(*subset.point(at), subset.live)

    one = lambda tangent: jax.jvp(rows, (place,), (tangent,))  # noqa: E731
    tangents, spread = given.directions(place.size)
    value, slopes = jax.vmap(one, out_axes=(None, 1))(tangents)
    return value, spread(slopes)


def _two_by_two(
    given: Residuals, subset: Subset, place: jax.Array, wanted: Callable[[jax.Array], jax.Array]
) -> tuple[jax.Array, jax.Array]:
    """Tangents pushed forward two at a time, with what is beside these two alone, as long as `wanted`.

    The first two give the rows; `wanted` says of them whether the other slopes are needed, which are 0 where it denies.
    What only fills a standard size then costs nothing, and neither does an effect along another's direction
    (`tests/benchmarks/test_slopes_bench.py` measures what that saves). One at a time would cost memories twice the
    time: a step along a run costs the same for one tangent as for two.
    """
    assert subset.varying is not None
    assert subset.beside is not None
    even = place.size + place.size % 2
    tangents = jnp.eye(even, place.size).reshape(-1, 2, place.size)
    beside = (
        jnp.zeros((even, subset.live.size), bool).at[: place.size].set(subset.beside).reshape(-1, 2, subset.live.size)
    )
    pairs = (subset.varying + 1) // 2

    def along(found: tuple) -> tuple:
        k, _, _, slopes = found
        live = subset.live | jnp.any(beside[k], axis=0)
        one = lambda tangent: jax.jvp(lambda at: given.rows(*subset.point(at), live), (place,), (tangent,))  # noqa: E731
        value, these = jax.vmap(one, out_axes=(None, 0))(tangents[k])
        goes_on = jax.lax.cond(k == 0, wanted, lambda _: jnp.asarray(True), value)
        return k + 1, goes_on & (k + 1 < pairs), value, slopes.at[k].set(these)

    nothing = jnp.zeros(given.count), jnp.zeros((len(tangents), 2, given.count))
    _, _, value, slopes = jax.lax.while_loop(lambda found: found[1], along, (0, jnp.asarray(True), *nothing))
    return value, slopes.reshape(even, given.count)[: place.size].T


def _with_slopes(evaluate: Callable) -> Callable:
    """The rows as a function of (problem, subset, through, below, place), with the slopes that came with them."""
    evaluate = _passed_over_whole(evaluate)

    @jax.custom_jvp
    def rows(
        given: Residuals, subset: Subset, through: Through | None, below: jax.Array, place: jax.Array
    ) -> jax.Array:
        return evaluate(given, subset, place, through, below)[0]

    @rows.defjvp
    def _(primals, tangents):  # type: ignore[no-untyped-def]
        given, subset, through, below, place = primals
        value, slopes = evaluate(given, subset, place, through, below)
        return value, slopes @ tangents[4]

    return rows


def _passed_over_whole(evaluate: Callable) -> Callable:
    """The same, of which JAX makes a linear part without looking inside, since no argument of it varies there.

    It takes loops apart even then, unless the function has a rule of its own: a quarter of the time in which Python
    runs through the model.
    """
    whole = jax.custom_jvp(evaluate)

    @whole.defjvp
    def _(primals, tangents):  # type: ignore[no-untyped-def]
        raise NotImplementedError("slopes have no slopes of their own")

    return whole


class Evaluated(NamedTuple):
    """A place in the unit box, with all rows and their slopes (rows, free) there."""

    place: Array
    rows: Array
    slopes: Array

    def at(self, rows: np.ndarray) -> "Evaluated":
        """The same with these rows alone (positions)."""
        return Evaluated(self.place, np.asarray(self.rows)[rows], np.asarray(self.slopes)[rows])


class SearchEnd(eqx.Module):
    """Where a search ended: place in the unit box, half the sum of squares, whether it converged, after how many steps.

    Of several searches each array has them along its first axis.
    """

    place: Array
    cost: Array
    converged: Array
    steps: Array


class SearchResult(eqx.Module):
    """Where one search ended, with rows and slopes there."""

    end: SearchEnd
    rows: Array
    slopes: Array

    @property
    def place(self) -> Array:
        """In the unit box."""
        return self.end.place

    @property
    def cost(self) -> Array:
        """Half the sum of squares; infinite where a row is no finite number."""
        return self.end.cost


@kept(like=SearchResult(SearchEnd(HERE, HERE, HERE, HERE), HERE, HERE))
def solve(
    given: Residuals, subset: Subset, start: Array, steps: int = MAX_STEPS, look: ArrayLike = False,
    enough: ArrayLike = 0.0, through: Through | None = None,
) -> SearchResult:  # fmt: skip
    """Search from a place in the unit box (free,): one program for any number of searches of one shape.

    `look`, which may be traced, ends the search at its start: rows and slopes there, without another compilation.
    `enough`, which may be traced too, ends a search where a step promises to lower the sum of squares by less than this
    share of it. Rows are made small as they are seen `through` instruments, if any are given, and given back like that.
    A search that meets no finite number ends where it began, at an infinite cost.
    """
    # python runs through the model once, however often the solver looks at its derivatives
    any_cost = jnp.asarray(jnp.inf)
    rows = _with_slopes(eqx.filter_closure_convert(rows_and_slopes, given, subset, start, through, any_cost))
    solver = BoxLevenbergMarquardt(jnp.zeros_like(start), jnp.ones_like(start), look=look, enough=enough)
    fn = lambda at, given: rows(*given.args, given.cost, at)  # noqa: E731
    args = OfLower((given, subset, through), any_cost)
    found = optx.least_squares(fn, solver, jnp.asarray(start), args=args, max_steps=steps, throw=False)
    info = found.state.f_info  # type: ignore[attr-defined]
    cost = 0.5 * jnp.sum(info.residual**2)
    finite, converged = jnp.isfinite(cost), found.result == optx.RESULTS.successful
    place, cost = jnp.where(finite, found.value, start), jnp.where(finite, cost, jnp.inf)
    return SearchResult(
        SearchEnd(place, cost, converged, found.stats["num_steps"]), info.residual, info.jac.as_matrix()
    )


def on_the_host(result: SearchResult) -> SearchResult:
    """The same with plain arrays."""
    return jax.tree.map(np.asarray, result)


@dataclass(frozen=True)
class MultistartResult:
    """Every search's end (first axis: starts), and rows and slopes at the best of them."""

    ends: SearchEnd
    place: Array
    cost: Array
    rows: Array
    slopes: Array

    @property
    def best(self) -> Evaluated:
        """Rows and slopes at the best end."""
        return Evaluated(self.place, self.rows, self.slopes)


def joined(results: Iterable[SearchResult]) -> MultistartResult:
    """Searches as one: all their ends, and rows and slopes at the best of them.

    Those of the others are let go as soon as they are beaten: memory does not grow with the number of starts.
    """
    ends, best = list[SearchEnd](), None
    for found in map(on_the_host, results):
        ends.append(found.end)
        if best is None or float(found.cost) < float(best.cost):
            best = found
    assert best is not None
    every = jax.tree.map(lambda *parts: np.stack(parts), *ends)
    return MultistartResult(every, best.place, best.cost, best.rows, best.slopes)
