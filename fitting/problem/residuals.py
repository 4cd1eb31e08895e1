"""One residual function for everything: least squares, sampling and diagnosis all see the same whitened rows."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fitting.problem.block import Block
from fitting.problem.points import reached
from fitting.problem.positions import predict_positions, starts, steps_of
from fitting.problem.unknowns import Unknowns, filled
from fitting.recordings.noise import noise_of
from fitting.recordings.records import FORCE_TESTS, Experiment, Recording, Run
from mckibben_jax.model import Model
from mckibben_jax.state import State

LENGTHS = np.unique(np.round(8 * 1.25 ** np.arange(60)).astype(int))  # runs are padded to these, to compile less often


LIGHT = 1e6  # standard deviations of a reading that is left out


def predict(block: Block, model: Model) -> jax.Array:
    """What the instrument would show at every sample of a recording, (runs, time), N or m."""
    if block.of_force:
        return block.averaged(jax.vmap(model.force)(block.imposed(model.muscle.length)))
    return predict_positions(block, model)


class Problem(eqx.Module):
    """Data and models laid out for one compiled residual; what varies is an argument."""

    templates: tuple[Model, ...]
    places: tuple[jax.Array, ...]
    blocks: tuple[Block, ...]
    prior_at: jax.Array
    prior_mean: jax.Array
    prior_sd: jax.Array

    def model(self, dataset: int, vector: jax.Array, switches: jax.Array, live: jax.Array | None) -> Model:
        """The model of one data set."""
        return filled(self.templates[dataset], vector[self.places[dataset]], switches, live)

    def data_rows(self, vector: jax.Array, switches: jax.Array, live: jax.Array | None = None) -> jax.Array:
        """The rows of the measurements."""
        models = [self.model(d, vector, switches, live) for d in range(len(self.templates))]
        return jnp.concatenate([block.whitened(predict(block, models[block.dataset])) for block in self.blocks])

    @property
    def count(self) -> int:
        """How many rows there are, those of the priors included."""
        return sum(block.keep.size for block in self.blocks) + self.prior_at.size

    def directions(self, size: int) -> tuple[jax.Array, Callable[[jax.Array], jax.Array]]:
        """Tangents along which rows are differentiated, and all slopes from those along them."""
        return jnp.eye(size), lambda slopes: slopes

    def of_force(self, samples: "Samples") -> np.ndarray:
        """Which samples measure force, a mask; all, where only positions were measured."""
        force = np.array([block.of_force for block in self.blocks])[samples.recording]
        return force if force.any() else ~force

    def split(self, rows: np.ndarray) -> list[np.ndarray]:
        """Rows of the measurements, block by block."""
        return np.split(rows, np.cumsum([block.keep.size for block in self.blocks])[:-1])

    def of_rows(self, wanted: np.ndarray) -> "Problem":
        """The same problem with these rows of the measurements (a mask) alone, and no other runs than theirs."""
        pairs = zip(self.blocks, self.split(wanted), strict=True)
        return replace(self, blocks=tuple(block.of_rows(mask) for block, mask in pairs if mask.any()))

    def without(self, left_out: np.ndarray) -> "Problem":
        """The same problem in which these rows (a mask) count next to nothing, without another compilation."""
        blocks = []
        for block, mask in zip(self.blocks, self.split(left_out), strict=True):
            sigma = np.array(block.sigma, order="C")  # so that what is reshaped is still the same array
            sigma.reshape(-1)[np.asarray(block.keep)] *= np.where(mask, LIGHT, 1.0)
            blocks.append(replace(block, sigma=sigma))
        return replace(self, blocks=tuple(blocks))

    def shifted(self, pressure: float = 0.0, contraction: float = 0.0) -> "Problem":
        """The same problem with so many pascals, and so much contraction, more in every reading."""
        moved = lambda s: s.replace(pressure=s.pressure + pressure, contraction=s.contraction + contraction)  # noqa: E731
        return replace(self, blocks=tuple(replace(b, states=moved(b.states)) for b in self.blocks))

    def coarser(self, times: float) -> "Problem":
        """The same problem with so many times fewer steps of integration, without another compilation."""
        fewer = (replace(b, taken=None if b.taken is None else jnp.ceil(b.taken / times)) for b in self.blocks)
        return replace(self, blocks=tuple(fewer))

    def prior_rows(self, vector: jax.Array) -> jax.Array:
        """The rows of the normal priors, behind those of the measurements."""
        return (vector[self.prior_at] - self.prior_mean) / self.prior_sd

    def rows(self, vector: jax.Array, switches: jax.Array, live: jax.Array | None = None) -> jax.Array:
        """All rows: half their sum of squares is what a fit minimises."""
        return jnp.concatenate([self.data_rows(vector, switches, live), self.prior_rows(vector)])


@dataclass(frozen=True)
class Samples:
    """Where each row of the measurements comes from: arrays as long as the rows, in their order."""

    dataset: np.ndarray
    recording: np.ndarray
    run: np.ndarray  # numbered through all recordings
    loop: np.ndarray  # numbered within its run
    half: np.ndarray  # the same
    row: np.ndarray
    time: np.ndarray
    contraction: np.ndarray
    pressure: np.ndarray
    rate: np.ndarray
    pressure_rate: np.ndarray
    branch: np.ndarray
    measured: np.ndarray
    sigma: np.ndarray
    position: np.ndarray  # place within the run, counting every sample

    def __len__(self) -> int:
        return len(self.row)

    def where(self, mask: np.ndarray) -> "Samples":
        """Only some rows."""
        return Samples(**{name: value[mask] for name, value in vars(self).items()})


def problem(experiments: Sequence[Experiment], layout: Unknowns) -> tuple[Problem, Samples]:
    """Lay out data sets for the residual function, and say where each of its rows comes from."""
    blocks, samples, runs_before = [], [], 0
    for d, experiment in enumerate(experiments):
        for recording in experiment.recordings:
            block = _block(recording, d, float(experiment.muscle.length))
            samples.append(_samples(recording, d, len(blocks), runs_before, noise_of(recording)))
            blocks.append(block)
            runs_before += len(recording.runs)
    priors = [(i, *entry.prior) for i, entry in enumerate(layout.entries) if entry.prior is not None]
    at, mean, sd = np.array(priors).reshape(-1, 3).T
    places = tuple(jnp.asarray(place) for place in layout.places)
    built = Problem(layout.templates, places, tuple(blocks), jnp.asarray(at, int), jnp.asarray(mean), jnp.asarray(sd))
    return built, _joined(samples)


def _block(recording: Recording, dataset: int, length: float) -> Block:
    runs = [part for run in recording.runs for part in reached(run)]
    size = _padded(max(len(run) for run in runs))
    stacked = {name: jnp.asarray(np.stack([_pad(getattr(run, name), size) for run in runs])) for name in _SIGNALS}
    weight = np.stack([_pad(run.weight, size, 0.0) for run in runs]).reshape(-1)
    zero = jnp.zeros_like(stacked["time"])
    states = State(
        contraction=stacked["contraction"],
        pressure=stacked["pressure"],
        rate=stacked["rate"],
        pressure_rate=stacked["pressure_rate"],
        stretch=zero,
        stretch_rate=zero,
        time=stacked["time"],
    )
    loads = [_pad(run.load, size) for run in runs if run.load is not None]
    load = jnp.asarray(np.stack(loads)) if loads else zero
    of_force, steps = recording.test in FORCE_TESTS, steps_of(recording)
    return Block(
        states,
        stacked["measured"],
        load,
        jnp.full_like(zero, noise_of(recording)),
        jnp.asarray(np.flatnonzero(weight > 0)),
        jnp.asarray(length),
        jnp.asarray(float(recording.position != "contraction")),
        jnp.asarray(float(recording.position == "length")),
        dataset,
        of_force,
        _padded(steps) if steps else 0,
        recording.test,
        None if of_force else jnp.asarray(starts(recording)),
        jnp.asarray(float(steps)) if steps else None,
        _means(runs, size),
    )


def _means(runs: Sequence[Run], size: int) -> jax.Array | None:
    """The weights of the means that were measured (runs, size, neighbours); None where none were."""
    weights = [run.averaging for run in runs if run.averaging is not None]
    if not weights:
        return None
    return jnp.asarray(np.stack([np.pad(each, ((0, size - len(each)), (0, 0))) for each in weights]))


_SIGNALS = ("time", "pressure", "contraction", "rate", "pressure_rate", "measured")


def _padded(length: int) -> int:
    return 1 if length <= 1 else int(LENGTHS[np.searchsorted(LENGTHS, length)])


def _pad(values: np.ndarray, size: int, fill: float | None = None) -> np.ndarray:
    last = values[-1] if fill is None else fill
    return np.concatenate([values, np.full(size - len(values), last, dtype=float)])


_OF_ROWS = (*_SIGNALS, "loop", "half", "row", "branch")  # what each row of the measurements keeps of its run


def _samples(recording: Recording, dataset: int, number: int, runs_before: int, sigma: float) -> Samples:
    parts = []
    for r, run in enumerate(recording.runs, runs_before):
        places = np.flatnonzero(run.usable)
        count = len(places)
        signals = {name: getattr(run, name)[places] for name in _OF_ROWS}
        parts.append(
            Samples(
                dataset=np.full(count, dataset),
                recording=np.full(count, number),
                run=np.full(count, r),
                sigma=np.full(count, sigma),
                position=places,
                **signals,
            )
        )
    return _joined(parts)


def _joined(parts: list[Samples]) -> Samples:
    return Samples(**{name: np.concatenate([getattr(p, name) for p in parts]) for name in vars(parts[0])})
