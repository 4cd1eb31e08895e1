"""How the muscle is measured: the protocols of the study, each from a generous one to one that hides things.

`LOOPS` are hysteresis loops driven at constant speeds. `OTHERS` are what else laboratories give: lengths held while the
pressure cycles, static maps with and without the direction of approach, loops together with either, loops driven by a
sine, and loops in which no state is met in two runs.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from ..rig import MAJOR_AND_MINOR, STATIONS
from ..simulator import EXACT, Dataset, Instruments, Muscle, Noise, Recording, Truth, dataset, isometric, loops, static

WHOLE = Muscle(shear_modulus=5.4e5, strand_width=3e-4, strand_modulus=2e9, strand_poisson=0.4)
SINGLE_LOOP = (0.0, 0.26, 0.0)
FEW = {"pressures": (2e5, 4e5), "speeds": (0.01,), "turns": (0.0, 0.25, 0.0, 0.25, 0.0)}
ONE_PERCENT = {"length": 3e-3, "radius": 7e-5, "braid_angle": float(np.radians(0.3))}
ONE_SPEED = {"speeds": (0.01,), "samples": 600}

MADE = {"loop": loops, "isometric": isometric, "static": static}
# Which argument holds the contractions of each kind of test, and what they are where a protocol does not say.
CONTRACTIONS = {
    "loop": ("turns", MAJOR_AND_MINOR),
    "isometric": ("contractions", (0.0, 0.05, 0.1, 0.15)),
    "static": ("contractions", STATIONS),
}


@dataclass(frozen=True)
class Part:
    """One recording of a protocol: its kind of test, and what is imposed (`given`, as the simulator takes it)."""

    test: str = "loop"
    given: dict = field(default_factory=dict)

    def record(
        self, truth: Truth, noise: Noise, seed: int = 0, samples: int | None = None, instruments: Instruments = EXACT
    ) -> Recording:
        """Measure; `samples` of a run instead of the protocol's own, where a test has any (a map has points)."""
        key, usual = CONTRACTIONS[self.test]
        given = {key: usual, **self.given}
        if samples is not None and self.test != "static":
            given["samples"] = samples
        return MADE[self.test](truth, noise=noise, seed=seed, instruments=instruments, **given)

    def stretched(self, ratio: float) -> Part:
        """The same displacements on a muscle whose length is `ratio` times as long."""
        key, usual = CONTRACTIONS[self.test]
        return replace(self, given={**self.given, key: tuple(eps / ratio for eps in self.given.get(key, usual))})


@dataclass(frozen=True)
class Protocol:
    """The recordings that are made of one muscle, and how well its geometry is known (standard errors, SI)."""

    parts: tuple[Part, ...] = (Part(),)
    errors: dict[str, float] = field(default_factory=dict)

    def recordings(
        self, truth: Truth, noise: Noise, seed: int = 0, samples: int | None = None, instruments: Instruments = EXACT
    ) -> tuple[Recording, ...]:
        """Measure; every recording has noise, and errors of its instruments, of its own."""
        return tuple(part.record(truth, noise, seed + i, samples, instruments) for i, part in enumerate(self.parts))

    def data(self, truth: Truth, noise: Noise, seed: int, instruments: Instruments = EXACT) -> Dataset:
        """Measure, and state the muscle as well as its owner knows it."""
        made = self.recordings(truth, noise, seed, instruments=instruments)
        return dataset(truth, made, "Hidden", noise, seed, **self.errors)

    def stretched(self, ratio: float) -> Protocol:
        """The same displacements on a muscle whose length is `ratio` times as long."""
        return replace(self, parts=tuple(part.stretched(ratio) for part in self.parts))


def in_loops(errors: dict[str, float] | None = None, **given) -> Protocol:
    """One recording of loops."""
    return Protocol((Part("loop", given),), errors or {})


LOOPS = {
    "rich": in_loops(),
    "poor": in_loops(**FEW, samples=800),
    "one pressure": in_loops(pressures=(3e5,), speeds=(0.005, 0.01, 0.02, 0.04)),
    "no repeats": in_loops(turns=SINGLE_LOOP, samples=800),
    "geometry to 1 %": in_loops(ONE_PERCENT),
}
OTHERS = {
    "isometric": Protocol((Part("isometric"),)),
    "static map": Protocol((Part("static"),)),
    "static map without branches": Protocol((Part("static", {"branches": ()}),)),
    "loops and static map": Protocol((Part("loop", ONE_SPEED), Part("static"))),
    "loops and isometric": Protocol((Part("loop", ONE_SPEED), Part("isometric"))),
    "sine loops": in_loops(sine=True),
    "own pressures": in_loops(pressures=(0.7e5, 1.5e5, 2.5e5, 4e5), speeds=(0.01,), turns=5 * (0.0, 0.24) + (0.0,)),
    "own states": in_loops(pressures=(1e5, 2e5, 4e5), speeds=(0.003, 0.01, 0.03), turns=3 * (0.0, 0.24) + (0.0,)),
}
NEVER_TWICE = ("own pressures", "own states")  # no run has the state of another, so that what steps looks like a law
PROTOCOLS = {**LOOPS, **OTHERS}
