"""Which recording would tell apart what these data leave tied.

Every explanation that remains is fitted by itself and asked what it predicts of a grid of recordings that the rig has
shown it can make. The recording that is proposed separates the worst pair best, after each of the two has given way as
far as the old data let it. Where none does, the grid is widened: what the rig has not shown, then another muscle.
Releases and steps are not proposed: the test sets them aside.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from threadpoolctl import threadpool_limits

from fitting.diagnosis.record import Diagnosis
from fitting.instruments.settings import INSTRUMENTS
from fitting.planning.prospect import Prospect, prospect
from fitting.planning.protocols import Demand, Protocol
from fitting.planning.settings import CHOICE, GRID
from fitting.problem.varying import AS_DECLARED, Varying
from fitting.progress import Progress, part_of, unwatched
from fitting.recordings.records import Experiment
from mckibben_jax.effect import Effect


@dataclass(frozen=True)
class PairPower:
    """Two explanations, and how often the test would reject the wrong one of them after the recording."""

    one: tuple[str, ...]
    other: tuple[str, ...]
    power: float
    discrepancy: float  # squared standard errors after both have given way


@dataclass(frozen=True)
class Visible:
    """An effect that a recording makes visible, and how many times smaller it may be than now."""

    effect: str
    gain: float
    unseen: bool  # whether the data do not see it at all, of whatever size


@dataclass(frozen=True)
class NextMeasurement:
    """A recording to make. Pressures in Pa, contractions as shares of the length, `speed` in m/s (isometric: Pa/s).

    It separates explanations or, where there is one or none, makes effects visible (`shows`).
    """

    separates: tuple[tuple[str, ...], ...]  # the pair that is hardest to tell apart by it
    power: float  # for that pair: the probability that the wrong one is rejected
    protocol: Protocol
    repeats: int
    speed: float
    seconds: float  # that it takes
    pairs: tuple[PairPower, ...]
    tied: tuple[tuple[tuple[str, ...], tuple[str, ...]], ...] = ()  # pairs that it leaves as they are
    shows: tuple[Visible, ...] = ()
    pull: float = 0.0  # N, the largest force that an explanation predicts there; 0 where it is not known

    @property
    def needs(self) -> tuple[Demand, ...]:
        """What the data do not show that the rig can do; empty if nothing."""
        return self.protocol.unseen

    @property
    def what(self) -> tuple[str, tuple[float, float], tuple[float, float], float, int]:
        """The recording in short: test, pressures (Pa), contractions, speed as above, repeats."""
        p = self.protocol
        return p.test, p.pressures, p.contractions, self.speed, self.repeats


def next_measurement(
    diagnosis: Diagnosis,
    experiments: Sequence[Experiment],
    *,
    known: Sequence[Effect] = (),
    varying: Varying = AS_DECLARED,
    seed: int = 0,
    progress: Progress = unwatched,
) -> NextMeasurement | None:
    """The recording that would separate what a diagnosis leaves; None where nothing is left to separate.

    `experiments` and `varying` as they were diagnosed; `known` are effects that the library does not have.
    """
    steps = measurements(diagnosis, experiments, known=known, varying=varying, seed=seed, most=1, progress=progress)
    return steps[0] if steps else None


def measurements(
    diagnosis: Diagnosis,
    experiments: Sequence[Experiment],
    *,
    known: Sequence[Effect] = (),
    varying: Varying = AS_DECLARED,
    seed: int = 0,
    most: int = 3,
    progress: Progress = unwatched,
) -> tuple[NextMeasurement, ...]:
    """Recordings in the order in which to make them: each for the pairs that those before it leave tied."""
    rivals = remaining(diagnosis)
    if len(rivals) < 2:
        return ()
    with threadpool_limits(1, "blas"):  # small matrices: more threads only wait for each other
        return _measurements(diagnosis, experiments, rivals, known, varying, seed, most, progress)


def _measurements(
    diagnosis: Diagnosis,
    experiments: Sequence[Experiment],
    rivals: Sequence[tuple[str, ...]],
    known: Sequence[Effect],
    varying: Varying,
    seed: int,
    most: int,
    progress: Progress,
) -> tuple[NextMeasurement, ...]:
    first = prospect(
        diagnosis, experiments, rivals, varying, known=known, seed=seed, progress=part_of(progress, 0.0, 0.4)
    )
    pairs = list(combinations(range(len(rivals)), 2))
    steps: list[NextMeasurement] = []
    while pairs and len(steps) < most:
        progress(f"choosing recording {len(steps) + 1} of {most} at most", 0.4 + 0.6 * len(steps) / most)
        step = _best(first, pairs)
        if step is None or step.power < CHOICE.enough_power - CHOICE.worth_more:
            step = _better(step, _on_others(diagnosis, experiments, rivals, first, known, varying, pairs))
        if step is None or not tells_more(step, steps):
            break
        steps.append(step)
        names = list(rivals)
        done = {(names.index(p.one), names.index(p.other)) for p in step.pairs if p.power >= CHOICE.enough_power}
        if not done:
            break
        pairs = [pair for pair in pairs if pair not in done]
    return tuple(steps)


def tells_more(step: NextMeasurement, before: Sequence[NextMeasurement]) -> bool:
    """Whether a recording tells any pair apart more often than each recording before it."""
    told = [p for earlier in before for p in earlier.pairs]
    reached = lambda pair: max((p.power for p in told if (p.one, p.other) == pair), default=0.0)  # noqa: E731
    return any(p.power > reached((p.one, p.other)) for p in step.pairs)


def remaining(diagnosis: Diagnosis) -> tuple[tuple[str, ...], ...]:
    """The explanations that are still to be told apart, those that predict best first."""
    if diagnosis.verdict == "not in the library":
        return tuple(e.effects for e in diagnosis.nearest)
    order = [e.effects for e in diagnosis.tried]
    names = sorted(diagnosis.explanations, key=lambda added: order.index(added) if added in order else len(order))
    return tuple(names[: CHOICE.explanations])


# ---------------------------------------------------------------------------------------------------------- the choice


def _best(given: Prospect, pairs: Sequence[tuple[int, int]]) -> NextMeasurement | None:
    """The best recording that the rig has shown it can make; one beyond that only where it is worth it."""
    inside = _chosen(given, pairs, [n for n in given.usable if not given.protocols[n].beyond])
    if inside is not None and inside.power >= CHOICE.enough_power - CHOICE.worth_more:
        return inside
    return _better(inside, _chosen(given, pairs, [n for n in given.usable if given.protocols[n].beyond]))


def _better(first: NextMeasurement | None, other: NextMeasurement | None) -> NextMeasurement | None:
    """The first of two, unless the other is worth its trouble."""
    if first is None or other is None:
        return first or other
    return other if other.power > first.power + CHOICE.worth_more else first


def _chosen(given: Prospect, pairs: Sequence[tuple[int, int]], numbers: Sequence[int]) -> NextMeasurement | None:
    """The recording among these that separates the worst pair best; None where none separates any."""
    if not numbers:
        return None
    apart = np.array([[given.outlook.discrepancy(*pair, number, CHOICE.usual) for number in numbers] for pair in pairs])
    alive = [row for row in range(len(pairs)) if apart[row].max() > CHOICE.hopeless]
    if not alive:
        return None
    least = np.minimum(apart[alive].min(axis=0), CHOICE.plenty)
    order = sorted(range(len(numbers)), key=lambda i: (-np.round(2 * np.log(least[i] + 1)), trouble(given, numbers[i])))
    best = None
    for i in order[: CHOICE.refitted]:
        above = -1.0 if best is None else best.power
        best = _judged(given, numbers[i], [pairs[row] for row in alive], apart[alive, i], above) or best
        if best is not None and best.power >= CHOICE.enough_power:
            break
    tied = tuple((given.names[a], given.names[b]) for row, (a, b) in enumerate(pairs) if row not in alive)
    return None if best is None else replace(best, tied=tied)


def trouble(given: Prospect, number: int) -> float:
    """What a recording asks of the rig: other speeds than it was used to, and time."""
    p, can = given.protocols[number], given.can
    seen = can.ramps if p.test == "isometric" else tuple(v / can.length for v in can.speeds)
    strange = 0.0 if not np.isfinite(seen[0]) or p.rate == 0 else min(abs(np.log(p.rate / v)) for v in seen)
    return strange + 0.1 * np.log1p(seconds_of(p, 1)) + (1.0 if p.hold else 0.0)


def seconds_of(p: Protocol, repeats: int) -> float:
    """How long a recording takes; points without times are as far apart as instruments are thought to drift by."""
    branch = GRID.nodes // 2 * INSTRUMENTS.point_time if p.test == "static" else p.branch_time
    return 2 * repeats * (branch + p.hold)


def _judged(
    given: Prospect, number: int, pairs: Sequence[tuple[int, int]], apart: np.ndarray, above: float
) -> NextMeasurement | None:
    """A recording with as few loops as have the power, which is counted for its worst pair.

    None where the power for any pair is not `above` this: the counting takes most of the time of a plan.
    """
    order = [pairs[i] for i in np.argsort(apart, kind="stable")]
    repeats, power = CHOICE.repeats[-1], 0.0
    for repeats in CHOICE.repeats:
        power = _power(given, order[0], number, repeats)
        if power >= CHOICE.enough_power:
            break
    powers = {order[0]: power}
    for pair in order[1:]:
        if min(powers.values()) <= above:
            return None
        powers[pair] = _power(given, pair, number, repeats)
    judged = tuple(
        PairPower(given.names[a], given.names[b], powers[a, b], given.outlook.discrepancy(a, b, number, repeats))
        for a, b in pairs
    )
    found = measurement_of(given, number, repeats, judged)
    return found if found.power > above else None


def measurement_of(given: Prospect, number: int, repeats: int, pairs: Sequence[PairPower]) -> NextMeasurement:
    """The record of a candidate that was chosen, with what it does for these pairs."""
    p, weakest = given.protocols[number], min(pairs, key=lambda pair: pair.power)
    rows = given.outlook.planned.rows[number]
    return NextMeasurement(
        separates=(weakest.one, weakest.other),
        power=weakest.power,
        protocol=p,
        repeats=repeats,
        speed=p.rate if p.test == "isometric" else p.rate * given.can.length,
        seconds=seconds_of(p, repeats),
        pairs=tuple(pairs),
        pull=max(float(forces[rows].max()) for forces in given.forces),
    )


def _power(given: Prospect, pair: tuple[int, int], number: int, repeats: int) -> float:
    """The worse of the two directions: either may be the truth."""
    one, other = pair
    return min(given.outlook.power(a, b, number, repeats, given.seed) for a, b in ((one, other), (other, one)))


def _on_others(
    diagnosis: Diagnosis,
    experiments: Sequence[Experiment],
    rivals: Sequence[tuple[str, ...]],
    first: Prospect,
    known: Sequence[Effect],
    varying: Varying,
    pairs: Sequence[tuple[int, int]],
) -> NextMeasurement | None:
    """A recording on another muscle of the same make: its length or wall changed, its effects' values the same."""
    others = prospect(diagnosis, experiments, rivals, varying, known=known, other_muscles=True, seed=first.seed)
    return _chosen(others, pairs, others.usable)
