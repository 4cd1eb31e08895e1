"""The signals of one recording as arrays of one shape, for a compiled residual."""

from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fitting.recordings.averages import mean_of
from mckibben_jax.state import State


class Block(eqx.Module):
    """The runs of one recording, padded to one length by repeating their last sample.

    `keep` are the flat positions of the samples that carry weight, `sigma` the standard deviation of one reading.
    `stated_length` is the length at rest (m) that made a contraction of what the rig read.
    """

    states: State  # (runs, time)
    measured: jax.Array  # (runs, time), N or m
    load: jax.Array  # (runs, time), N; zero in force tests
    sigma: jax.Array  # (runs, time)
    keep: jax.Array
    stated_length: jax.Array
    scaled: jax.Array  # 1 where another length at rest makes another contraction of the same reading, else 0
    from_length: jax.Array  # 1 where the rig read a length, else 0
    dataset: int = eqx.field(static=True)
    of_force: bool = eqx.field(static=True)
    steps: int = eqx.field(static=True, default=0)  # of integration, that there is room for
    test: str = eqx.field(static=True, default="loop")
    start: jax.Array | None = None  # (runs,), m; where a run begins in which the position is measured
    taken: jax.Array | None = None  # steps of integration that are taken
    averaging: jax.Array | None = None  # (runs, time, neighbours), weights of what was measured; None: instants

    def imposed(self, length: jax.Array) -> State:
        """The states that the rig imposed on a muscle of this length at rest."""
        ratio = 1.0 + self.scaled * (self.stated_length / length - 1.0)
        shift = self.from_length * (1.0 - ratio)
        return self.states.replace(contraction=shift + ratio * self.states.contraction, rate=ratio * self.states.rate)

    def counts_from(self, length: jax.Array) -> jax.Array:
        """What a position (m) was counted from, where a length was read and the muscle is so long at rest."""
        return self.from_length * (self.stated_length - length)

    def of_rows(self, wanted: np.ndarray) -> "Block":
        """The same with these samples alone (a mask of those that are kept), and no other runs than theirs."""
        run, place = np.divmod(np.asarray(self.keep)[wanted], self.measured.shape[1])
        chosen, number = np.unique(run, return_inverse=True)
        of_chosen = lambda each: jnp.asarray(np.asarray(each)[chosen])  # noqa: E731  (JAX takes long to pick rows)
        return replace(
            self,
            states=jax.tree.map(of_chosen, self.states),
            measured=of_chosen(self.measured),
            load=of_chosen(self.load),
            sigma=of_chosen(self.sigma),
            keep=jnp.asarray(number * self.measured.shape[1] + place),
            start=None if self.start is None else of_chosen(self.start),
            averaging=None if self.averaging is None else of_chosen(self.averaging),
        )

    def averaged(self, force: jax.Array) -> jax.Array:
        """Forces (runs, time) as they are measured: their means, where that is what was measured."""
        return force if self.averaging is None else mean_of(force, self.averaging, jnp)

    def whitened(self, shown: jax.Array) -> jax.Array:
        """What the instrument shows minus the measurement, in standard deviations: the rows of samples with weight.

        A sample whose sigma is infinite has a row of 0.
        """
        rows = (shown - self.measured) / self.sigma
        return jnp.where(jnp.isinf(self.sigma), 0.0, rows).reshape(-1)[self.keep]
