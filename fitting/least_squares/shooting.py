"""Multiple shooting: a motion cut into stretches that each begin where the muscle was seen to be.

Followed from its beginning alone, a motion that goes wrong early is wrong ever after, and its slopes say little of
where the right parameters are: such a search ends where it should not. Here the places where stretches begin (nodes)
vary beside the parameters, from what was measured; what a stretch misses the next node by is a row like any other,
weighted ever more until the motion is one again (Bock 1983, Numerical Treatment of Inverse Problems 2:95, with weights
in place of his constraints). What comes out are places for the plain search to begin from; that has the last word.

Slopes cost little more than those of single shooting: a node moves only the stretch behind it, so that one tangent
serves the contractions of all nodes and one their rates. Where effects remember, memory is carried across the nodes,
and what it carries from one stretch into later ones is left out of the slopes.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fitting.least_squares.search import joined, solve
from fitting.least_squares.subset import Subset
from fitting.problem.block import Block
from fitting.problem.positions import begin_of, shot
from fitting.problem.residuals import Problem, predict
from fitting.recordings.motion_signals import smooth
from fitting.recordings.records import MOVING_TESTS
from mckibben_jax.motion.motion import Nodes


@dataclass(frozen=True)
class ShootingSettings:
    """Settings of multiple shooting. All were chosen."""

    looseness: tuple[float, ...] = (0.03, 0.003, 0.0003)  # a gap of one standard deviation, of travel and largest speed
    steps: int = 50  # of each search
    kept: int = 3  # best ends of the first search, with which the later ones go on
    nearest: int = 9  # samples about a node from which the place and the speed of the muscle are read
    least_travel: float = 1e-4  # in contraction


SETTINGS = ShootingSettings()


class Shots(eqx.Module):
    """The stretches of one recording; `seen` and `scale` are (runs, nodes, 2): contraction and rate (1/s)."""

    step: jax.Array  # (runs, nodes): after which step of the integration a stretch begins
    seen: jax.Array  # where the muscle was measured to be there
    scale: jax.Array  # travel and largest speed: nodes move by as much at most


class Shooting(eqx.Module):
    """A problem whose motions begin anew at nodes; the nodes' places stand behind the unknowns in the vector."""

    problem: Problem
    shots: tuple[Shots | None, ...]
    behind: jax.Array  # of each row: number of the node (a pair in the vector) that its stretch begins at, else -1
    looseness: jax.Array

    @property
    def count(self) -> int:
        """How many rows there are."""
        return self.problem.count + self.size

    @property
    def size(self) -> int:
        """How many numbers the nodes are, and gaps there are."""
        return sum(each.seen.size for each in self.shots if each is not None)

    def rows(self, vector: jax.Array, switches: jax.Array, live: jax.Array | None = None) -> jax.Array:
        """Measurements, priors, and gaps in the order of the nodes, in standard deviations."""
        given, at = self.problem, vector.size - self.size
        plain, measured, gaps = vector[:at], [], []
        models = [given.model(d, plain, switches, live) for d in range(len(given.templates))]
        for block, shots in zip(given.blocks, self.shots, strict=True):
            if shots is None:
                measured.append(block.whitened(predict(block, models[block.dataset])))
                continue
            place = vector[at : at + shots.seen.size].reshape(shots.seen.shape)
            at += shots.seen.size
            shown, missed = shot(block, models[block.dataset], Nodes(shots.step, place[..., 0], place[..., 1]))
            measured.append(block.whitened(shown))
            gaps.append((jnp.stack(missed, axis=-1) / (shots.scale * self.looseness)).reshape(-1))
        return jnp.concatenate([*measured, given.prior_rows(plain), *gaps])

    def directions(self, size: int) -> tuple[jax.Array, Callable[[jax.Array], jax.Array]]:
        """Tangents in the unit box along which rows are differentiated, and all slopes from those along them."""
        nodes, plain = jnp.arange(self.size), size - self.size
        seeds = jnp.zeros((plain + 2, size)).at[jnp.arange(plain), jnp.arange(plain)].set(1.0)
        seeds = seeds.at[plain + nodes % 2, plain + nodes].set(1.0)
        gap, own = self.count - self.size + nodes, -2 / self.looseness  # the box of a node is two scales wide

        def spread(slopes: jax.Array) -> jax.Array:
            leading = slopes[:, plain:].at[gap, nodes % 2].add(-own)  # without the node that a gap leads to
            wide = jnp.where(self.behind[:, None] == nodes // 2, leading[:, nodes % 2], 0.0)
            return jnp.concatenate([slopes[:, :plain], wide.at[gap, nodes].add(own)], axis=1)

        return seeds, spread


def shooting(given: Problem, stretches: int) -> Shooting | None:
    """The problem in so many stretches a run; None where nothing moves."""
    shots = tuple(_shots(block, stretches) for block in given.blocks)
    if all(each is None for each in shots):
        return None
    behind, leading, before = [], [], 0
    for block, each in zip(given.blocks, shots, strict=True):
        if each is None:
            behind.append(np.full(block.keep.size, -1))
            continue
        runs, nodes = each.step.shape
        first = before + nodes * np.arange(runs)
        run, stretch = np.asarray(block.keep) // block.measured.shape[1], _stretch_of(block, np.asarray(each.step))
        behind.append(np.where(stretch == 0, -1, first[run] + stretch - 1))
        from_node = first[:, None] + np.arange(nodes) - 1
        leading.append(np.repeat(np.where(np.arange(nodes) == 0, -1, from_node).reshape(-1), 2))
        before += runs * nodes
    rows = np.concatenate([*behind, np.full(given.prior_at.size, -1), *leading])
    return Shooting(given, shots, jnp.asarray(rows), jnp.asarray(SETTINGS.looseness[0]))


def begin_by_shooting(given: Problem, subset: Subset, begin: np.ndarray, stretches: int) -> np.ndarray:
    """Where the plain search had better begin (starts, free), in the unit box; `begin` itself where nothing moves."""
    problem = shooting(given, stretches)
    if problem is None:
        return begin
    wider = with_shots(subset, [each for each in problem.shots if each is not None])
    places = np.concatenate([begin, np.full((len(begin), problem.size), 0.5)], axis=1)
    for looseness in SETTINGS.looseness:
        looser = replace(problem, looseness=jnp.asarray(looseness))
        ends = joined(solve(looser, wider, place, SETTINGS.steps) for place in places).ends
        places = ends.place[np.argsort(ends.cost)[: SETTINGS.kept]]
    return np.concatenate([places[:, : begin.shape[1]], begin[:1]])


def with_shots(subset: Subset, shots: Sequence[Shots]) -> Subset:
    """The subset with the nodes behind its unknowns, all of them free."""
    seen, scale = (np.concatenate([np.asarray(part).reshape(-1) for part in parts])
                   for parts in zip(*((each.seen, each.scale) for each in shots), strict=True))  # fmt: skip
    behind = lambda one, more: jnp.concatenate([one, jnp.asarray(more)])  # noqa: E731
    return Subset(
        full=behind(subset.full, seen),
        free=behind(subset.free, subset.full.size + np.arange(seen.size)),
        switches=subset.switches,
        live=subset.live,
        lower=behind(subset.lower, seen - scale),
        upper=behind(subset.upper, seen + scale),
        logarithmic=behind(subset.logarithmic, np.zeros(seen.size, bool)),
    )


# Where stretches begin -----------------------------------------------------------------------------------------------


def _shots(block: Block, stretches: int) -> Shots | None:
    """The stretches of a recording, about as much time and way in each."""
    count = min(stretches, _taken(block) // 2)
    if block.test not in MOVING_TESTS or count < 2:
        return None
    runs = block.measured.shape[0]
    found = [_nodes(block, run, count) for run in range(runs)]
    step, seen, scale = (jnp.asarray(np.stack(parts)) for parts in zip(*found, strict=True))
    return Shots(step, seen, scale)


def _nodes(block: Block, run: int, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """After which steps stretches of one run begin, where it was measured to be there, and its travel and speed."""
    time, place = _measured(block, run)
    begin, stride = _clock(block, run)
    way = np.cumsum(np.abs(np.diff(smooth(place, SETTINGS.nearest), prepend=place[0])))
    share = (time - begin) / (time[-1] - begin) + way / max(way[-1], 1e-12)
    step = np.round((np.interp(2 * np.arange(1, count) / count, share, time) - begin) / stride)
    for j in range(count - 1):  # each at least a step behind the one before, and the last before the end
        step[j] = np.clip(step[j], step[j - 1] + 1 if j else 1, _taken(block) - count + 1 + j)
    seen = np.array([_local(time, place, at) for at in begin + stride * step])
    travel = max(float(np.ptp(place)), SETTINGS.least_travel)
    speed = max(float(np.abs(seen[:, 1]).max()), travel / (time[-1] - begin))
    return step, seen, np.broadcast_to([travel, speed], seen.shape)


def _measured(block: Block, run: int) -> tuple[np.ndarray, np.ndarray]:
    """Times and readings (as a contraction of the muscle as stated) that carry weight."""
    keep = np.asarray(block.keep)
    width = block.measured.shape[1]
    mine = keep[keep // width == run] % width
    return np.asarray(block.states.time)[run, mine], np.asarray(block.measured / block.stated_length)[run, mine]


def _clock(block: Block, run: int) -> tuple[float, float]:
    """When a run's motion begins, and how long one step of it is, s."""
    time = np.asarray(block.states.time)[run]
    begin = begin_of(block.test, float(time[0]))
    return begin, float(time[-1] - begin) / _taken(block)


def _taken(block: Block) -> int:
    """Steps of integration."""
    return 0 if block.taken is None else int(block.taken)


def _local(time: np.ndarray, place: np.ndarray, at: float) -> np.ndarray:
    """Place and rate at a time, from a parabola through the nearest readings."""
    near = np.argsort(np.abs(time - at))[: SETTINGS.nearest]
    line = np.polynomial.Polynomial.fit(time[near], place[near], min(2, len(near) - 1))
    return np.array([line(at), line.deriv()(at)])


def _stretch_of(block: Block, step: np.ndarray) -> np.ndarray:
    """Which stretch of its run each weighted sample lies in, counted from 0."""
    keep, width = np.asarray(block.keep), block.measured.shape[1]
    stretch = np.zeros(len(keep), int)
    for run in range(len(step)):
        mine = keep // width == run
        begin, stride = _clock(block, run)
        at = np.clip(np.floor((np.asarray(block.states.time)[run, keep[mine] % width] - begin) / stride), 0, None)
        stretch[mine] = np.searchsorted(step[run], np.minimum(at, _taken(block) - 1), side="right")
    return stretch
