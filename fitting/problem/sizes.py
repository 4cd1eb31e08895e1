"""Problems brought to standard sizes, so that what was compiled for one data set serves the next.

A program is compiled for arrays of one shape. Runs of force are therefore laid one behind another into a few lanes of
a standard length, whatever their number and their lengths are.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import jax
import jax.numpy as jnp
import numpy as np

from fitting.problem.block import Block
from fitting.problem.residuals import Problem

RUNS = np.unique(np.round(np.concatenate([np.arange(1, 5), 5 * 1.2 ** np.arange(40)])).astype(int))
# (lanes, samples of a lane). A diagnosis thins what it reads to between 1,750 and 3,500 samples and a few more. These
# few shapes serve it, since a program of the whole library takes half a minute to compile. Half as many samples more
# cost a search half as long again, other lanes of as many nothing (measured); no runs get lanes that take more than
# twice the time of the best (`tests/test_sizes.py`). Maps of some points have shapes of their own, for they are
# refitted a thousand times without some of them.
OF_A_DIAGNOSIS = ((10, 32), (1, 320), (4, 320), (1, 1280), (10, 256), (4, 960), (10, 384), (1, 3840))
SAMPLES = tuple(round(384 * 1.25**power) * 10 for power in range(1, 30))  # of all lanes together, where there are more
LANES = (10, 4, 1)
# What remembers goes along its lanes step by step, all lanes at once: a step took as long as five samples of all else,
# and one effect in seven remembers. Few short lanes with room to spare are faster than one long one without.
STEP = 1
LARGER = sorted(
    ((lanes, samples // lanes) for samples in SAMPLES for lanes in LANES), key=lambda size: (size[0] + STEP) * size[1]
)
LANE_SHAPES = (*OF_A_DIAGNOSIS, *LARGER)
PRIORS = 3  # of a muscle: length, radius and angle are what is stated with errors
WASTE = 1.6  # times as many samples may be computed to have one block where there were two
OURS, FORCE = "mckibben_jax", "force"


@dataclass(frozen=True)
class Standard:
    """A problem as it is searched, and where its own rows stand among those of the search, priors behind the others."""

    problem: Problem
    rows: np.ndarray

    @classmethod
    def of(cls, given: Problem) -> "Standard":
        """Of standard size where nothing but force was measured; a motion is searched as it is."""
        if not all(block.of_force for block in given.blocks):
            return cls(given, np.arange(given.count))
        searched, real = of_standard_size(given)
        priors = searched.count - searched.prior_at.size + np.arange(given.prior_at.size)
        return cls(searched, np.concatenate([real, priors]))

    def without(self, left_out: np.ndarray) -> "Standard":
        """The same where these of the measured rows (a mask) count next to nothing."""
        measured, size = self.rows[: len(left_out)], self.problem.count - self.problem.prior_at.size
        return replace(self, problem=self.problem.without(widened(left_out, measured, size)))


def of_standard_size(given: Problem) -> tuple[Problem, np.ndarray]:
    """The problem with blocks of standard sizes in which every sample is kept, and with a standard number of priors.

    What carries no weight gets an infinite standard deviation and a row of zero. Also returns the positions, among the
    rows of the measurements, of those that do carry weight, in their old order; behind the priors there were, rows of
    zero are added.
    """
    blocks, real, before = [], [], 0
    wants_lanes = _reads_run_by_run(given)
    for some in _together(given):
        in_lanes = _in_lanes(some) if wants_lanes and some[0].of_force else None
        for grown, kept in [in_lanes] if in_lanes else map(_padded, joined(some)):
            blocks.append(grown)
            real.append(before + kept)
            before += grown.keep.size
    return _with_priors(replace(given, blocks=tuple(blocks))), np.concatenate(real)


def _together(given: Problem) -> list[list[Block]]:
    """Neighbouring recordings of force on one data set, to a model all the same; every other one for itself."""
    groups = [[given.blocks[0]]]
    for block in given.blocks[1:]:
        if _alike(groups[-1][-1], block):
            groups[-1].append(block)
        else:
            groups.append([block])
    return groups


def _alike(first: Block, second: Block) -> bool:
    of = [(b.of_force, b.dataset, float(b.scaled), float(b.from_length), b.averaging is None) for b in (first, second)]
    return first.of_force and of[0] == of[1]


def joined(blocks: Sequence[Block]) -> list[Block]:
    """Recordings that are the same to a model in one block, where that is little waste; rows keep their order."""
    made = [blocks[0]]
    for block in blocks[1:]:
        last = made[-1]
        size = (len(last.measured) + len(block.measured)) * max(last.measured.shape[1], block.measured.shape[1])
        fits = size <= WASTE * (last.measured.size + block.measured.size)
        made[-1:] = [_one(last, block)] if fits else [last, block]
    return made


def _one(first: Block, second: Block) -> Block:
    size = max(first.measured.shape[1], second.measured.shape[1])
    both = lambda a, b: jnp.concatenate([_longer(a, size), _longer(b, size)])  # noqa: E731
    kept = [_kept(first, size), _kept(second, size) + len(first.measured) * size]
    return replace(
        first,
        states=jax.tree.map(both, first.states, second.states),
        measured=both(first.measured, second.measured),
        load=both(first.load, second.load),
        sigma=both(first.sigma, second.sigma),
        keep=jnp.asarray(np.concatenate(kept)),
        averaging=jax.tree.map(both, first.averaging, second.averaging),
    )


def _longer(values: jax.Array, size: int) -> jax.Array:
    return jnp.concatenate([values, jnp.repeat(values[:, -1:], size - values.shape[1], axis=1)], axis=1)


def _kept(block: Block, size: int) -> np.ndarray:
    run, sample = np.divmod(np.asarray(block.keep), block.measured.shape[1])
    return run * size + sample


def _reads_run_by_run(given: Problem) -> bool:
    """Whether every effect that sees a whole run knows where the next begins; a user's own need not."""
    effects = given.templates[0].effects
    return all(type(effect).__module__.startswith(OURS) for effect in effects if effect.stage == "read")


def _with_priors(given: Problem) -> Problem:
    """Priors that say nothing, added to have a standard number of them."""
    usual = PRIORS * len(given.templates)
    more = max(usual, -(-given.prior_at.size // usual) * usual) - given.prior_at.size
    fill = lambda values, value: jnp.asarray(np.append(values, np.full(more, value, values.dtype)))  # noqa: E731
    return replace(
        given,
        prior_at=fill(given.prior_at, 0),
        prior_mean=fill(given.prior_mean, 0.0),
        prior_sd=fill(given.prior_sd, np.inf),
    )


@dataclass(frozen=True)
class _Lanes:
    """Which sample of which run stands where in lanes of one length: arrays (lanes, samples).

    Behind each run stands its last sample once more, so late (`is_between`) that the time goes back to the next run's.
    """

    run: np.ndarray
    sample: np.ndarray
    is_between: np.ndarray

    @classmethod
    def of(cls, lengths: np.ndarray, ends: np.ndarray, size: tuple[int, int]) -> "_Lanes | None":
        """Runs of these lengths (samples) and ends (s); None where there is not room enough."""
        lanes = _shared_out(lengths, *size)
        if lanes is None:
            return None
        run, sample, is_between = np.zeros(size, int), np.zeros(size, int), np.ones(size, bool)
        for lane, inside in enumerate(lanes):
            first = 0
            for one in sorted(inside, key=lambda each: ends[each]):  # a clock that runs through them stays small
                last = first + lengths[one]
                run[lane, first:], sample[lane, first:] = one, lengths[one] - 1
                sample[lane, first:last], is_between[lane, first:last] = np.arange(lengths[one]), False
                first = last + 1
        return cls(run, sample, is_between)


def _shared_out(lengths: np.ndarray, lanes: int, samples: int) -> list[list[int]] | None:
    """Which runs go into which lane: the longest first, each where most room is left; None where there is none."""
    inside, taken = [[] for _ in range(lanes)], np.zeros(lanes, int)
    for one in np.argsort(-lengths, kind="stable"):
        lane = int(np.argmin(taken))
        inside[lane].append(int(one))
        taken[lane] += lengths[one] + 1
        if taken[lane] > samples:
            return None
    return inside


def _in_lanes(blocks: Sequence[Block]) -> tuple[Block, np.ndarray] | None:
    """Recordings of force as one block of a standard size, which is None where there is none so large.

    What follows the last reading of a run with weight is dropped, but not the states of which that is the mean.
    """
    flat = lambda pick: np.concatenate([np.asarray(pick(block)).reshape(-1) for block in blocks])  # noqa: E731
    width = np.concatenate([np.full(len(block.measured), block.measured.shape[1]) for block in blocks])
    begin = np.cumsum(width) - width  # of each run, among all samples
    before = np.cumsum([0, *(block.measured.size for block in blocks)])
    counted = np.concatenate([first + np.asarray(block.keep) for first, block in zip(before, blocks, strict=False)])
    run = np.searchsorted(begin, counted, side="right") - 1
    lengths, time = np.zeros(len(begin), int), flat(lambda block: block.states.time)
    reach = 0 if blocks[0].averaging is None else blocks[0].averaging.shape[-1] // 2
    np.maximum.at(lengths, run, np.minimum(counted - begin[run] + 1 + reach, width[run]))
    used = np.flatnonzero(lengths)
    ends = np.maximum(time[(begin + lengths - 1)[used]], time[begin[used]].max()) + 1.0
    lanes = _first_with_room(lengths[used], ends)
    if lanes is None:
        return None
    source = begin[used][lanes.run] + lanes.sample
    laid = lambda pick: jnp.asarray(flat(pick)[source])  # noqa: E731
    states = jax.tree.map(lambda *parts: jnp.asarray(np.concatenate([np.ravel(p) for p in parts])[source]),
                          *(block.states for block in blocks))  # fmt: skip
    states = states.replace(time=jnp.asarray(np.where(lanes.is_between, ends[lanes.run], np.asarray(states.time))))
    place = np.zeros(len(time), int)
    place[source[~lanes.is_between]] = np.flatnonzero(~lanes.is_between)
    kept, sigma = place[counted], np.full(source.size, np.inf)
    sigma[kept] = flat(lambda block: block.sigma)[counted]
    grown = replace(
        blocks[0],
        states=states,
        measured=laid(lambda block: block.measured),
        load=laid(lambda block: block.load),
        sigma=jnp.asarray(sigma.reshape(source.shape)),
        keep=jnp.arange(source.size),
        test=FORCE,
        averaging=_laid_out([block.averaging for block in blocks], source),
    )
    return grown, kept


def _laid_out(means: Sequence[jax.Array | None], source: np.ndarray) -> jax.Array | None:
    """The weights of means of several blocks, those of these samples; None where there are none."""
    flat = [np.reshape(each, (-1, each.shape[-1])) for each in means if each is not None]
    return jnp.asarray(np.concatenate(flat)[source]) if flat else None


def _first_with_room(lengths: np.ndarray, ends: np.ndarray) -> _Lanes | None:
    """The runs in the first lanes of standard size that have room for them; None where none have."""
    return next((lanes for size in LANE_SHAPES if (lanes := _Lanes.of(lengths, ends, size)) is not None), None)


def _padded(block: Block) -> tuple[Block, np.ndarray]:
    """A block with a standard number of runs."""
    runs, samples = block.measured.shape
    wanted = int(RUNS[np.searchsorted(RUNS, runs)]) if runs <= RUNS[-1] else runs
    more = lambda x: jnp.concatenate([x, jnp.repeat(x[-1:], wanted - runs, axis=0)])  # noqa: E731
    sigma = np.full(wanted * samples, np.inf)
    kept = np.asarray(block.keep)
    sigma[kept] = np.asarray(block.sigma).reshape(-1)[kept]
    grown = replace(
        block,
        states=jax.tree.map(more, block.states),
        measured=more(block.measured),
        load=more(block.load),
        sigma=jnp.asarray(sigma.reshape(wanted, samples)),
        keep=jnp.arange(wanted * samples),
        averaging=jax.tree.map(more, block.averaging),
    )
    return grown, kept


def widened(rows: np.ndarray, real: np.ndarray, size: int) -> np.ndarray:
    """Rows put back among those that carry no weight, which are zero."""
    wide = np.zeros(size, rows.dtype)
    wide[real] = rows
    return wide
