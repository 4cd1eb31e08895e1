"""The group `instruments` of the plan: gauges, load cells and rulers that err, alone and all together.

Clean recordings of every kind of instrument, measured richly, poorly, with the length held, and point by point; under
all errors together (`laboratory`) one effect of each family at its limit and at three times that, two and three at
once, and effects of nobody's library; one effect under each kind alone. All of it twice: with the data sheets stated
and with accuracies presumed. Cases that differ in kind and statement only have the same noise and the same draws.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from itertools import product

import numpy as np

from ..instruments import EVERY_KIND, LABORATORY
from ..simulator import TYPICAL, TYPICAL_STRANGERS
from .cases import ERRING, FAMILIES, LIMITS, SIGMAS, Case, together

TOGETHER = "laboratory"
RIGS = {**EVERY_KIND, "half laboratory": LABORATORY.scaled(0.5)}
MEASURED = ("rich", "poor", "isometric", "static map")
NOISE = "ar"
CLEAN = 25  # for each kind, protocol and statement: 200 recordings of a kind
PAIRS, TRIPLES = 40, 40
# What changes nothing in such a recording: friction rests where a length is held, a map has no time.
NO_OTHER = {
    "rich": ("held length",),
    "poor": ("held length",),
    "isometric": ("friction warming", "ripple"),
    "static map": ("held length", "skew", "jitter", "ripple"),
}


def erring(seed: int) -> Iterator[Case]:
    """Every case of the group."""
    for case in (*clean(seed), *singles(seed), *powers(seed), *strangers(seed), *several(seed)):
        yield replace(case, stated=False)
        if case.instruments != "exact":  # nothing to be stated
            yield replace(case, stated=True)


def case_of(hidden: tuple[str, ...], size: float, unit: str, protocol: str, number: int, seed: int, rig=TOGETHER):
    """A case of this group, its accuracies presumed."""
    return Case(ERRING, hidden, size, unit, NOISE, protocol, number, seed, instruments=rig)


def clean(seed: int) -> Iterable[Case]:
    """Nothing hidden."""
    for rig, protocol, number in product(RIGS, MEASURED, range(CLEAN)):
        if rig not in NO_OTHER[protocol]:
            yield case_of((), 0.0, "sigma", protocol, number, seed, rig)


def singles(seed: int) -> Iterable[Case]:
    """One effect of each family at three times its limit: all together in every protocol, each alone in rich loops."""
    for name in one_of_each_family():
        yield from (case_of((name,), LIMITS, "limit", protocol, 0, seed) for protocol in MEASURED)
        alone = (rig for rig in RIGS if rig != TOGETHER and rig not in NO_OTHER["rich"])
        yield from (case_of((name,), LIMITS, "limit", "rich", 0, seed, rig) for rig in alone)


def powers(seed: int) -> Iterable[Case]:
    """One effect of each family as large as its printed detection limit, all errors together."""
    for name, protocol in product(one_of_each_family(), MEASURED):
        yield case_of((name,), 1.0, "limit", protocol, 0, seed)


def one_of_each_family() -> tuple[str, ...]:
    """Effects that are no rivals of each other; without the lag of a supply, which a held pressure never shows."""
    taken: list[str] = []
    for name in TYPICAL:
        rivals = set().union(*(family for family in FAMILIES if name in family))
        if name != "supply_lag" and not rivals & set(taken):
            taken.append(name)
    return tuple(taken)


def strangers(seed: int) -> Iterable[Case]:
    """Effects of nobody's library."""
    for name, size, protocol in product(TYPICAL_STRANGERS, SIGMAS[1:], MEASURED):
        yield case_of((name,), size, "sigma", protocol, 0, seed)


def several(seed: int) -> Iterable[Case]:
    """Two and three at once, each at three times its own limit."""
    random = np.random.default_rng([seed, 4])
    for how_many, count in ((2, PAIRS), (3, TRIPLES)):
        for number in range(count):
            yield case_of(together(random, how_many), LIMITS, "limit", MEASURED[number % 2], number, seed)
