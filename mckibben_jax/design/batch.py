"""Designs by the million: any grid or sample of a muscle's dimensions, evaluated in blocks that stay in the cache.

A design is known by its number alone, so that nothing about the designs is stored: a piece of work is a range of
numbers, whoever does it and in whatever order. Either all quantities are returned, or they are reduced where they are
computed: the best designs, a histogram, how many are feasible. Every device of a mesh takes its share of a range.
Needs 64 bits.
"""

import dataclasses
import functools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from decimal import Decimal, localcontext
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax.sharding import Mesh, PartitionSpec

from mckibben_jax.design.best import Limit
from mckibben_jax.design.merit import At, built, evaluate
from mckibben_jax.effect import Effect
from mckibben_jax.muscle import Muscle

BLOCK = 2048  # designs evaluated at once on one device: their intermediate results stay in the cache
_WORD = 64
_ROW = 64  # scores of a block that are searched at once


# Which designs -------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Space:
    """Ranges of the variables, SI, and the designs in them: a grid of `counts` places on each range, or a sample.

    A grid's last variable changes fastest, and its ends belong to it. A sample is a Kronecker sequence: number i is at
    the fractional part of s + i a, where a_j = phi^-j and phi^(d+1) = phi + 1 in d dimensions. It fills the box evenly
    whatever its length (Niederreiter 1992, ch. 3; this phi: Roberts 2018). `seed` shifts it.
    """

    ranges: dict[str, tuple[float, float]]
    size: int
    counts: tuple[int, ...] = ()
    seed: int = 0

    def place(self, number: jax.Array) -> jax.Array:
        """The variables of one design, in their order; `number` is an integer of 64 bits."""
        low, high = (jnp.asarray(end) for end in np.array(list(self.ranges.values()), float).T)
        share = jnp.stack(self._of_grid(number) if self.counts else self._of_sample(number))
        return low + (high - low) * share

    def _of_grid(self, number: jax.Array) -> list[jax.Array]:
        kind = jnp.uint32 if self.size < 2**32 else jnp.uint64  # short integers divide faster
        left, shares = number.astype(kind), []
        for count in reversed(self.counts):
            left, digit = left // kind(count), left % kind(count)
            shares.append(digit.astype(float) / max(count - 1, 1))
        return shares[::-1]

    def _of_sample(self, number: jax.Array) -> list[jax.Array]:
        shift = np.random.default_rng(self.seed).integers(2**_WORD, size=len(self.ranges), dtype=np.uint64)
        turned = [number.astype(jnp.uint64) * jnp.uint64(a) + jnp.uint64(s)
                  for a, s in zip(turns(len(self.ranges)), shift, strict=True)]  # fmt: skip
        return [(t >> jnp.uint64(11)).astype(float) * 2.0**-53 for t in turned]


def turns(count: int) -> list[int]:
    """The steps of a Kronecker sequence as integers out of 2^64, which wrap around where a fraction would."""
    with localcontext() as exact:
        exact.prec = 40
        phi = Decimal(2)
        for _ in range(200):
            phi = (1 + phi) ** (Decimal(1) / (count + 1))
        return [int(phi**-j * 2**_WORD) for j in range(1, count + 1)]


# What of them --------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Histogram:
    """Counts of an output (by its place among the outputs) in equal bins; one more at each end for what lies beyond."""

    output: int
    low: float
    high: float
    bins: int = 100


@dataclass(frozen=True)
class Batch:
    """Designs to evaluate: quantities with their conditions (`outputs`) and limits that make a design feasible. SI.

    `by` is the output by whose size designs are ranked; `largest` says which end is best.
    """

    muscle: Muscle
    effects: tuple[Effect, ...]
    space: Space
    outputs: tuple[tuple[str, At], ...]
    limits: tuple[Limit, ...] = ()
    by: int = 0
    largest: bool = True
    best: int = 0
    histogram: Histogram | None = None
    columns: tuple[str, ...] = field(default=())  # names of the outputs for files


class Tally(NamedTuple):
    """A reduced range of designs: scores and numbers of the best, best first, counts per bin, feasible, not a number.

    A score is the ranked quantity, its sign turned where the smallest is best; -inf where there are fewer.
    """

    scores: Any
    numbers: Any
    counts: Any
    feasible: Any
    undefined: Any


def values_of(batch: Batch) -> Callable[[jax.Array], tuple[jax.Array, jax.Array, jax.Array]]:
    """From a design's number to its variables, its outputs, and whether it is feasible."""
    law, feasible = _law_and_limits(batch)

    def whole(number: jax.Array) -> tuple[jax.Array, jax.Array, jax.Array]:
        place, values = law(number)
        return place, values[: len(batch.outputs)], feasible(values)

    return whole


def _law_and_limits(batch: Batch) -> tuple[Callable, Callable]:
    """From a design's number to its variables and all its quantities, outputs first; from these to its feasibility."""
    wanted = list(batch.outputs)
    rows = [_row(wanted, (limit.quantity, limit.at)) for limit in batch.limits]

    def law(number: jax.Array) -> tuple[jax.Array, jax.Array]:
        place = batch.space.place(number)
        muscle = dataclasses.replace(batch.muscle, **dict(zip(batch.space.ranges, place, strict=True)))
        return place, evaluate(built(muscle, batch.effects), wanted)

    def feasible(values: jax.Array) -> jax.Array:
        good = jnp.all(jnp.isfinite(values[: len(batch.outputs)]))
        for limit, row in zip(batch.limits, rows, strict=True):
            good &= (values[row] >= _or(limit.min, -math.inf)) & (values[row] <= _or(limit.max, math.inf))
        return good

    return law, feasible


def _row(wanted: list, one: tuple[str, At]) -> int:
    if one not in wanted:
        wanted.append(one)
    return wanted.index(one)


def _or(value: float | None, other: float) -> float:
    return other if value is None else value


# Evaluating ----------------------------------------------------------------------------------------------------------


class Engine:
    """A batch compiled once, for all devices: `rows` writes everything out, `tally` keeps what was asked for.

    `piece` is the count of designs of one call, of which there are `pieces`; the last is cut at the end of the space.
    """

    def __init__(self, batch: Batch, piece: int = 2**18, devices: Sequence[Any] | None = None):
        self.batch, self.piece, self.devices = batch, piece, tuple(devices or jax.devices())
        self.pieces = -(-batch.space.size // piece)
        share = -(-piece // len(self.devices))
        self.block = min(BLOCK, share)
        self.share = -(-share // self.block) * self.block  # designs of one device in one call; some may be too many
        self._mesh = Mesh(np.array(self.devices), ("device",))
        self._law = values_of(batch)

    def ends(self, number: int) -> tuple[int, int]:
        """The numbers of the first design of a piece and of the one after its last."""
        start = number * self.piece
        return start, min(start + self.piece, self.batch.space.size)

    def _everywhere(self, one: Callable, *inputs: PartitionSpec) -> Callable:
        spec = PartitionSpec("device")
        whole = jax.shard_map(one, mesh=self._mesh, in_specs=(spec, *inputs), out_specs=spec, check_vma=False)
        return jax.jit(whole)

    def _numbers(self, start: int) -> np.ndarray:
        return np.uint64(start) + np.uint64(self.share) * np.arange(len(self.devices), dtype=np.uint64)

    @functools.cached_property
    def _rows(self) -> Callable:
        law, feasible = _law_and_limits(self.batch)

        def one(start: jax.Array) -> Any:
            blocks = (start[0] + jnp.arange(self.share, dtype=jnp.uint64)).reshape(-1, self.block)
            # rows first and columns from them: where columns are computed, XLA computes what they share for each again
            place, values = (x.reshape(self.share, -1) for x in jax.lax.map(jax.vmap(law), blocks))
            return list(place.T), list(values[:, : len(self.batch.outputs)].T), jax.vmap(feasible)(values)

        return self._everywhere(one)

    def begin_rows(self, number: int) -> Any:
        """Ask the devices for a piece without waiting for it; `rows` takes what they are at."""
        return self._rows(self._numbers(self.ends(number)[0]))

    def rows(self, number: int, begun: Any = None) -> tuple[list[np.ndarray], list[np.ndarray], np.ndarray]:
        """Variables, outputs and feasibility of the designs of a piece, an array for each."""
        start, end = self.ends(number)
        found = self.begin_rows(number) if begun is None else begun
        return jax.tree.map(lambda column: np.asarray(column)[: end - start], found)

    @functools.cached_property
    def _tally(self) -> Callable:
        batch, best = self.batch, self.batch.best
        bins = batch.histogram.bins + 2 if batch.histogram else 0
        sign = 1.0 if batch.largest else -1.0
        size = jnp.uint64(batch.space.size)

        def step(end: jax.Array, known: Tally, numbers: jax.Array) -> tuple[Tally, None]:
            _, outputs, feasible = jax.vmap(self._law)(numbers)
            within = numbers < end
            feasible &= within
            defined = jnp.all(jnp.isfinite(outputs), axis=1)
            scores = jnp.where(feasible, sign * outputs[:, batch.by], -jnp.inf)
            top = (known.scores, known.numbers)
            if best:
                top = _with_better(top, scores, numbers)
            counts = known.counts
            if batch.histogram:
                counts = counts.at[_bin(batch.histogram, outputs)].add((within & defined).astype(counts.dtype))
            better, undefined = jnp.sum(feasible), jnp.sum(within & ~defined)
            return Tally(top[0], top[1], counts, known.feasible + better, known.undefined + undefined), None

        def one(start: jax.Array, end: jax.Array, floor: jax.Array) -> Tally:
            # scores at the floor must still come in, in whatever order ranges are done: a lower number then wins
            below = jnp.nextafter(floor, -jnp.inf)
            none = Tally(jnp.full(best, below), jnp.full(best, size), jnp.zeros(bins, int), jnp.zeros((), int),
                         jnp.zeros((), int))  # fmt: skip
            blocks = (start[0] + jnp.arange(self.share, dtype=jnp.uint64)).reshape(-1, self.block)
            found = jax.lax.scan(functools.partial(step, end), none, blocks)[0]
            return jax.tree.map(lambda leaf: leaf[None], found)

        return self._everywhere(one, PartitionSpec(), PartitionSpec())

    def tally(self, number: int, floor: float = -math.inf) -> Tally:
        """The designs of a piece, reduced. Designs that score below `floor` may be left out."""
        start, end = self.ends(number)
        found = self._tally(self._numbers(start), np.uint64(end), np.float64(floor))
        parts = [Tally(*part) for part in zip(*(np.asarray(leaf) for leaf in found), strict=True)]
        return functools.reduce(lambda a, b: joined(a, b, self.batch), parts)


class Picked:
    """Designs of a batch by their numbers, compiled once for any count of them."""

    def __init__(self, batch: Batch):
        self._law = jax.jit(jax.vmap(values_of(batch)))

    def __call__(self, numbers: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Variables, outputs and feasibility, a row for each design."""
        numbers = np.asarray(numbers, np.uint64)
        padded = np.resize(numbers, max(-(-len(numbers) // BLOCK), 1) * BLOCK) if len(numbers) else np.zeros(BLOCK)
        parts = [self._law(part.astype(np.uint64)) for part in padded.reshape(-1, BLOCK)]
        return tuple(np.concatenate(part)[: len(numbers)] for part in zip(*parts, strict=True))


def _with_better(top: tuple[jax.Array, jax.Array], scores: jax.Array, numbers: jax.Array) -> Any:
    """The best, best first, after a block. One enters at a time: after the first blocks few do, and a sort costs more.

    The next to enter is sought among the heads of short rows of the block, then in its row. Of equal scores the earlier
    one stands first.
    """
    rows = jnp.pad(scores, (0, -len(scores) % _ROW), constant_values=-jnp.inf).reshape(-1, _ROW)

    def some(known: tuple) -> jax.Array:
        (best, _), _, heads = known
        return jnp.max(heads) > best[-1]

    def enter(known: tuple) -> tuple:
        (best, owners), left, heads = known
        row = jnp.argmax(heads)
        column = jnp.argmax(left[row])
        place = jnp.sum(best >= heads[row])
        ranks = jnp.arange(len(best))

        def inserted(old: jax.Array, new: jax.Array) -> jax.Array:
            return jnp.where(ranks < place, old, jnp.where(ranks == place, new, jnp.roll(old, 1)))

        entered = inserted(best, heads[row]), inserted(owners, numbers[row * _ROW + column])
        left = left.at[row, column].set(-jnp.inf)
        return entered, left, heads.at[row].set(jnp.max(left[row]))

    return jax.lax.while_loop(some, enter, (top, rows, jnp.max(rows, axis=1)))[0]


def _bin(histogram: Histogram, outputs: jax.Array) -> jax.Array:
    """Bin of each design: 0 below the range, 1 ... bins in it, bins + 1 beyond."""
    share = (outputs[:, histogram.output] - histogram.low) / (histogram.high - histogram.low)
    inside = jnp.floor(jnp.nan_to_num(share) * histogram.bins)
    return jnp.clip(inside + 1, 0, histogram.bins + 1).astype(jnp.int32)


# Putting together ----------------------------------------------------------------------------------------------------


def nothing(batch: Batch) -> Tally:
    """The tally of no designs."""
    bins = batch.histogram.bins + 2 if batch.histogram else 0
    return Tally(np.zeros(0), np.zeros(0, np.uint64), np.zeros(bins, int), 0, 0)


def joined(a: Tally, b: Tally, batch: Batch) -> Tally:
    """The tally of two ranges; of designs with the same score the one with the lower number is the better."""
    scores, numbers = np.concatenate([a.scores, b.scores]), np.concatenate([a.numbers, b.numbers]).astype(np.uint64)
    real = (numbers < batch.space.size) & np.isfinite(scores)
    scores, numbers = scores[real], numbers[real]
    order = np.lexsort((numbers, -scores))[: batch.best]
    return Tally(
        scores[order],
        numbers[order],
        np.asarray(a.counts) + np.asarray(b.counts),
        int(a.feasible) + int(b.feasible),
        int(a.undefined) + int(b.undefined),
    )
