"""Problems brought to standard sizes, so that what was compiled for one data set serves the next."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np

from fitting.residuals import Block, Problem

RUNS = np.unique(np.round(np.concatenate([np.arange(1, 5), 5 * 1.2 ** np.arange(40)])).astype(int))


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
