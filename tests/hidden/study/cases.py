"""The plan, fixed beforehand by a seed: what is hidden, how large, in which noise, measured how.

Groups: `none` (nothing hidden), `single` (one effect of the library), `power` (one at the size that the program
prints as its detection limit), `outside` (an effect of nobody's library), `pair` and `triple` (several at once, each
of the stated size alone), `invariance` (the same recording said in another way), `next` (one effect measured poorly,
with the recording that the program then proposes, and with one drawn at random), `kinds` (nothing, one effect of the
library, or one of nobody's, in isometric tests, static maps, loops with either, loops driven by a sine, and loops of
which every run has its own pressure or speed; the other groups have loops at constant speeds only), `instruments` (the
cases of `erring`: instruments that err, one kind alone or all together; they are exact in all other groups). A size is
the rms misfit that is left once the baseline has been refitted: in noise sigmas, or in detection limits. What a kind
of recording cannot show has no such size, and is not diagnosed.
"""

from __future__ import annotations

import zlib
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from ..physics import BLADDERS
from ..simulator import FRICTIONS, NOISES, TYPICAL, TYPICAL_STRANGERS, UNSTEADY
from .protocols import LOOPS, NEVER_TWICE, OTHERS
from .sizes import NEEDS_RUBBER, shape_keys

SIGMAS = (2.0, 5.0, 10.0)
LIMITS = 3.0
KINDS = tuple(NOISES)
PLACES = tuple(LOOPS)
HARD = ("poor", "one pressure", "no repeats")
CHANGES = ("as it is", "10x resampled", "other units", "shuffled")
REPEATS = {"none": 24, "single": 2, "power": 2, "outside": 3, "kinds": 1}
CLEAN_KINDS = 2  # clean recordings of each other kind in each kind of noise
# With the length held, whatever moves the braid brings all of its friction, 40 to 62 sigmas, however little it moves:
# these have no small size there, but a large one.
MOVES_A_HELD_BRAID = ("series_compliance", "tip_pressure", "strand_stretch")
HELD, LARGE = ("isometric", "loops and isometric"), 65.0
PAIRS, TRIPLES, INVARIANCES = 200, 100, 24
WOBBLE = 0.25  # of the logarithm of an effect's shape parameters, from case to case
STEADY = {"eps_s": 0.04}  # a stop must stay within the stroke
# Laws that take each other's place: two of one family are never hidden together.
FAMILIES = (
    {"tip", "tip_pressure"},
    {"conical_ends", "reduced_length"},
    set(BLADDERS),
    set(FRICTIONS),
    {"presliding", "maxwell_slip"},
)
ERRING = "instruments"
Place = tuple[str, str, str, bool]


@dataclass(frozen=True)
class Case:
    """One recording to be diagnosed. `unit` of the size: "sigma" or "limit"; `stated`: whether data sheets are."""

    group: str
    hidden: tuple[str, ...]
    size: float
    unit: str
    noise: str
    protocol: str
    number: int
    seed: int
    change: str = CHANGES[0]
    instruments: str = "exact"
    stated: bool = False

    @property
    def place(self) -> Place:
        """What a detection limit depends on."""
        return self.noise, self.protocol, self.instruments, self.stated

    @property
    def id(self) -> str:
        """A name that says everything."""
        size = f"{self.size:g}{self.unit}" if self.hidden else "-"
        hidden = "+".join(self.hidden) or "nothing"
        parts = [self.group, hidden, size, self.noise, self.protocol, self.change, str(self.number)]
        if self.group == ERRING:
            parts += [self.instruments, "stated" if self.stated else "presumed"]
        return "/".join(part.replace(" ", "-") for part in parts)

    @property
    def random(self) -> np.random.Generator:
        """This case's own random numbers; a changed recording has those of the one that it was."""
        hidden = "+".join(self.hidden)
        words = f"{self.group}/{hidden}/{self.size}/{self.unit}/{self.noise}/{self.protocol}/{self.number}"
        return np.random.default_rng([self.seed, zlib.crc32(words.encode())])

    def shapes(self) -> dict[str, dict[str, float]]:
        """By how much each hidden effect's shape parameters differ from typical ones."""
        random = self.random
        return {
            name: {key: float(np.exp(STEADY.get(key, WOBBLE) * random.standard_normal())) for key in shape_keys(name)}
            for name in self.hidden
        }

    def recording_seed(self) -> int:
        """Of the noise."""
        return int(self.random.integers(2**31))


def plan(seed: int = 1) -> tuple[Case, ...]:
    """Every case of the full study."""
    from .erring import erring

    made = (nothing(seed), singles(seed), powers(seed), outsiders(seed), several(seed), invariances(seed), ties(seed))
    return tuple(case for group in (*made, kinds(seed), erring(seed)) for case in group)


def nothing(seed: int) -> Iterable[Case]:
    """Clean data of every kind."""
    for noise, protocol, number in product(KINDS, PLACES, range(REPEATS["none"])):
        yield Case("none", (), 0.0, "sigma", noise, protocol, number, seed)


def singles(seed: int) -> Iterable[Case]:
    """Each effect at each size under each protocol; the kinds of noise take turns."""
    sizes = [*((size, "sigma") for size in SIGMAS), (LIMITS, "limit")]
    yield from turning("single", TYPICAL, sizes, seed)


def powers(seed: int) -> Iterable[Case]:
    """Each effect as large as its printed detection limit."""
    yield from turning("power", TYPICAL, [(1.0, "limit")], seed)


def outsiders(seed: int) -> Iterable[Case]:
    """Each effect that no library has."""
    yield from turning("outside", TYPICAL_STRANGERS, [(size, "sigma") for size in SIGMAS], seed)


def turning(
    group: str, names: Iterable[str], sizes: Sequence[tuple[float, str]], seed: int, places: Sequence[str] = PLACES
) -> Iterable[Case]:
    """All names, sizes and protocols; every next one in the next kind of noise."""
    for i, name in enumerate(names):
        for (j, (size, unit)), (k, protocol), number in product(
            enumerate(sizes), enumerate(places), range(REPEATS[group])
        ):
            noise = KINDS[(i + 2 * j + 3 * k + 4 * number) % len(KINDS)]
            yield Case(group, (name,), size, unit, noise, protocol, number, seed)


def several(seed: int) -> Iterable[Case]:
    """Pairs and triples drawn at random from effects that can be there together."""
    random = np.random.default_rng([seed, 2])
    for group, count, how_many in (("pair", PAIRS, 2), ("triple", TRIPLES, 3)):
        for number in range(count):
            hidden = together(random, how_many)
            size, noise = SIGMAS[1 + number % 2], KINDS[number % len(KINDS)]
            yield Case(group, hidden, size, "sigma", noise, PLACES[number % len(PLACES)], number, seed)


def together(random: np.random.Generator, count: int) -> tuple[str, ...]:
    """Effects of different families; rubber's own effects only where rubber is not hidden as well."""
    while True:
        chosen = tuple(sorted(random.choice(list(TYPICAL), count, replace=False).tolist()))
        rivals = any(len(family & set(chosen)) > 1 for family in FAMILIES)
        rubber = set(NEEDS_RUBBER) & set(chosen) and any(name.startswith("bladder_") for name in chosen)
        if not rivals and not rubber and "supply_lag" not in chosen:  # a held pressure never lags
            return chosen


def invariances(seed: int) -> Iterable[Case]:
    """Recordings of many kinds, each said in every way."""
    hidden = [(), ("strain_bump",), *((name,) for name in TYPICAL if name != "supply_lag")]
    order = np.random.default_rng([seed, 3]).permutation(len(hidden))
    for number in range(INVARIANCES):
        what, noise = hidden[order[number]], KINDS[number % len(KINDS)]
        size = SIGMAS[number % 3] if what else 0.0
        yield from (Case("invariance", what, size, "sigma", noise, "rich", number, seed, change) for change in CHANGES)


def ties(seed: int) -> Iterable[Case]:
    """Effects in recordings that can hardly tell one from another."""
    for i, (name, protocol) in enumerate(product(TYPICAL, HARD)):
        yield Case("next", (name,), LIMITS, "limit", KINDS[i % len(KINDS)], protocol, 0, seed)


def kinds(seed: int) -> Iterable[Case]:
    """Recordings of other kinds: clean ones, and each effect of the library and of nobody's at two sizes."""
    for noise, protocol, number in product(KINDS, OTHERS, range(CLEAN_KINDS)):
        yield Case("kinds", (), 0.0, "sigma", noise, protocol, number, seed)
    sizes = [(size, "sigma") for size in SIGMAS[1:]]
    yield from turning("kinds", (*TYPICAL, *TYPICAL_STRANGERS), sizes, seed, tuple(OTHERS))
    yield from turning("kinds", MOVES_A_HELD_BRAID, [(LARGE, "sigma")], seed, HELD)
    for noise, protocol, number in product(UNSTEADY, NEVER_TWICE, range(REPEATS["none"])):
        yield Case("kinds", (), 0.0, "sigma", noise, protocol, number, seed)


def groups_of(cases: Iterable[Case]) -> tuple[str, ...]:
    """The groups of a plan, in its order."""
    return tuple(dict.fromkeys(case.group for case in cases))


def chosen(cases: Sequence[Case], share: float, groups: Collection[str] = ()) -> tuple[Case, ...]:
    """A stratified share of a plan (of some `groups` of it), and the clean cases from which detection limits come.

    A larger share holds every smaller one, so that a study can be widened later.
    """
    taken: set[Case] = set()
    for group in groups or groups_of(cases):
        mine = [case for case in cases if case.group == group]
        if group == "invariance":  # a recording and what it is compared with stay together
            taken |= {case for case in mine if turn(case.number) < share}
            continue
        mine.sort(key=lambda c: (*c.place, c.unit, c.size, zlib.crc32(c.id.encode())))
        taken |= {case for place, case in enumerate(mine) if turn(place) < share}
    needed = {case.place for case in taken if case.unit == "limit"}
    taken |= {case for case in cases if is_pilot(case) and case.place in needed}
    return tuple(case for case in cases if case in taken)


def is_pilot(case: Case) -> bool:
    """Whether the detection limits of a noise, a protocol and its instruments are read off this case."""
    exact = case.instruments == "exact"  # whose limits come from the group `none`
    return case.group == ("none" if exact else ERRING) and not case.hidden and case.number == 0


def turn(place: int) -> float:
    """Van der Corput's sequence: any first part of a list is thinned evenly."""
    return int(f"{place:032b}"[::-1], 2) / 2**32
