"""What the sign-flip test flips as a whole: loops, half loops where loops are few, blocks of samples where both are."""

from dataclasses import dataclass

import numpy as np

from fitting.diagnosis.findings import GroupKind, RestsOn
from fitting.diagnosis.settings import FLIP_TEST, FlipTestSettings
from fitting.problem.kinds import POINTS, kinds
from fitting.problem.residuals import Samples


@dataclass(frozen=True)
class FlipGroups:
    """Groups of rows of which each gets one sign. Both arrays are of shape (rows,) and number from 0."""

    number: np.ndarray
    level: float  # of the test that flips them
    together: np.ndarray  # rows with equal numbers may err together: whole loops and points, else whole runs
    kinds: tuple[GroupKind, ...] = ()
    block_samples: int = 0

    @property
    def count(self) -> int:
        """How many."""
        return int(self.number.max()) + 1

    @property
    def trusted(self) -> bool:
        """Whether the test holds its level whatever the noise: blocks of samples rest on the noise model."""
        return GroupKind.BLOCK not in self.kinds

    def rests_on(self) -> RestsOn:
        """What a test by these groups rests on."""
        return RestsOn(self.count, self.kinds, self.block_samples)


def numbered(*keys: np.ndarray) -> np.ndarray:
    """Rows with equal keys get equal numbers, in order."""
    return np.unique(np.stack(keys), axis=1, return_inverse=True)[1]


def in_order_of_states(number: np.ndarray, samples: Samples) -> np.ndarray:
    """Groups (rows,) numbered by the state that they were measured in, not by the order of runs and files.

    Then the same recordings get the same signs, in whatever files and order they come.
    """
    keys = (samples.measured, samples.branch, samples.rate, samples.contraction, samples.pressure)
    count = np.bincount(number)
    means = [np.bincount(number, weights=key) / count for key in keys]
    rank = np.empty(len(count), int)
    rank[np.lexsort([*means])] = np.arange(len(count))
    return rank[number]


def flip_groups(samples: Samples, memory: float, settings: FlipTestSettings = FLIP_TEST) -> FlipGroups:
    """Whole loops; half loops of a kind of test that has few; where all are few, blocks of samples within a branch.

    `memory` is the correlation of neighbouring samples under the noise model.
    """
    few = few_loops(samples, settings)
    number = loops_or_halves(samples, few)
    if number.max() + 1 < settings.fewest_groups:
        return _blocks(samples, memory, settings)
    number = in_order_of_states(number, samples)
    together = numbered(samples.run, np.where(few, 0, 1 + samples.loop))
    return FlipGroups(number, settings.level, together, _kinds(few, kinds(samples) == POINTS))


def _kinds(few: np.ndarray, points: np.ndarray) -> tuple[GroupKind, ...]:
    rows = {GroupKind.LOOP: ~few & ~points, GroupKind.HALF_LOOP: few & ~points, GroupKind.POINT: points}
    return tuple(kind for kind, mask in rows.items() if mask.any())


def few_loops(samples: Samples, settings: FlipTestSettings = FLIP_TEST) -> np.ndarray:
    """Rows of a kind of test of which there are few loops, a mask.

    What only loops show cannot be seen in a few of them, however many isometric cycles stand beside them.
    """
    loops, kind = numbered(samples.run, samples.loop), kinds(samples)
    few = np.zeros(len(samples), bool)
    for each in np.unique(kind):
        few[kind == each] = len(np.unique(loops[kind == each])) < settings.fewest_groups
    return few


def loops_or_halves(samples: Samples, few: np.ndarray) -> np.ndarray:
    """The number of each row's loop, or of its half of one where there are `few`."""
    return numbered(samples.run, few, np.where(few, samples.half, samples.loop))


def _blocks(samples: Samples, memory: float, settings: FlipTestSettings) -> FlipGroups:
    """As long as the noise remembers, but not across turning points."""
    halves = numbered(samples.run, samples.half)
    lasting = settings.memories_of_block * (1 + memory) / max(1 - memory, 1e-3)
    size = int(max(settings.shortest_block, np.ceil(lasting)))
    place = np.concatenate([np.arange(n) for n in np.bincount(halves)])
    within = np.empty(len(halves), int)
    within[np.argsort(halves, kind="stable")] = place
    blocks = in_order_of_states(numbered(halves, within // size), samples)
    return FlipGroups(blocks, settings.level_of_blocks, samples.run, (GroupKind.BLOCK,), size)


def too_few_to_flip(it: RestsOn, settings: FlipTestSettings = FLIP_TEST) -> bool:
    """Whether no flip of so few blocks could reject anything: a small p is then that of a likelihood ratio."""
    return GroupKind.BLOCK in it.kinds and 2.0 ** (1 - it.groups) > settings.level_of_blocks


def rests_on_in_words(it: RestsOn) -> str:
    """What a test rests on, as part of a sentence."""
    if too_few_to_flip(it):
        block, verb = ("block", "is") if it.groups == 1 else ("blocks", "are")
        size = f"of {it.block_samples} samples"
        return f"{it.groups} {block} {size} {verb} too few to flip: p is that of the noise model alone"
    if GroupKind.BLOCK in it.kinds:
        words = (
            f"{it.groups} blocks of {it.block_samples} samples flipped: too few loops, this rests on the noise model"
        )
    else:
        few = ": few loops" if it.kinds == (GroupKind.HALF_LOOP,) else ": one kind of test has few"
        words = f"{it.groups} {' and '.join(it.kinds)} flipped{few * (GroupKind.HALF_LOOP in it.kinds)}"
    return f"signs of {words}"
