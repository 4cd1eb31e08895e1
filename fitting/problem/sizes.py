"""Problems brought to standard sizes, so that what was compiled for one data set serves the next."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np

from fitting.problem.block import Block
from fitting.problem.residuals import Problem

RUNS = np.unique(np.round(np.concatenate([np.arange(1, 5), 5 * 1.2 ** np.arange(40)])).astype(int))
WASTE = 1.6  # times as many samples may be computed to have one block where there were two


def joined(given: Problem) -> Problem:
    """The problem with neighbouring recordings of force in one block, if that is little waste; rows keep their order.

    Each block is compiled for itself, and to a model all recordings of force on one data set are the same.
    """
    blocks = [given.blocks[0]]
    for block in given.blocks[1:]:
        last = blocks[-1]
        alike = last.of_force and block.of_force and (last.dataset, last.position) == (block.dataset, block.position)
        together = [*last.measured.shape[:1], *block.measured.shape[:1]]
        size = sum(together) * max(last.measured.shape[1], block.measured.shape[1])
        if alike and size <= WASTE * (last.measured.size + block.measured.size):
            blocks[-1] = _one(last, block)
        else:
            blocks.append(block)
    return replace(given, blocks=tuple(blocks))


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
    )


def _longer(values: jax.Array, size: int) -> jax.Array:
    return jnp.concatenate([values, jnp.repeat(values[:, -1:], size - values.shape[1], axis=1)], axis=1)


def _kept(block: Block, size: int) -> np.ndarray:
    run, sample = np.divmod(np.asarray(block.keep), block.measured.shape[1])
    return run * size + sample


def of_standard_size(given: Problem) -> tuple[Problem, np.ndarray]:
    """The problem with every block padded to a standard number of runs and every sample kept.

    What carries no weight gets an infinite standard deviation and a row of zero. Also returns the positions, among the
    rows of the measurements, of those that do carry weight, in their old order.
    """
    blocks, real, before = [], [], 0
    for block in given.blocks:
        padded, kept = _padded(block)
        blocks.append(padded)
        real.append(before + kept)
        before += padded.keep.size
    return replace(given, blocks=tuple(blocks)), np.concatenate(real)


def _padded(block: Block) -> tuple[Block, np.ndarray]:
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
    )
    return grown, kept


def widened(rows: np.ndarray, real: np.ndarray, size: int) -> np.ndarray:
    """Rows put back among those that carry no weight, which are zero."""
    wide = np.zeros(size, rows.dtype)
    wide[real] = rows
    return wide
