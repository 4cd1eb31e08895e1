"""How the muscle is measured: the protocols of the study, each from a generous one to one that hides things."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from ..simulator import Dataset, Muscle, Noise, Recording, Truth, dataset, loops

WHOLE = Muscle(shear_modulus=5.4e5, strand_width=3e-4, strand_modulus=2e9, strand_poisson=0.4)
SINGLE_LOOP = (0.0, 0.26, 0.0)
FEW = {"pressures": (2e5, 4e5), "speeds": (0.01,), "turns": (0.0, 0.25, 0.0, 0.25, 0.0)}
ONE_PERCENT = {"length": 3e-3, "radius": 7e-5, "braid_angle": float(np.radians(0.3))}


@dataclass(frozen=True)
class Protocol:
    """What is imposed (`given`, as `loops` takes it) and how well the geometry is known (standard errors, SI)."""

    given: dict = field(default_factory=dict)
    errors: dict[str, float] = field(default_factory=dict)

    def record(self, truth: Truth, noise: Noise, seed: int = 0, samples: int | None = None) -> Recording:
        """Measure."""
        given = self.given if samples is None else {**self.given, "samples": samples}
        return loops(truth, noise=noise, seed=seed, **given)

    def data(self, truth: Truth, noise: Noise, seed: int) -> Dataset:
        """Measure, and state the muscle as well as its owner knows it."""
        return dataset(truth, [self.record(truth, noise, seed)], "Hidden", noise, seed, **self.errors)

    def stretched(self, ratio: float) -> Protocol:
        """The same displacements on a muscle whose length is `ratio` times as long."""
        turns = self.given.get("turns", (0.0, 0.26, 0.08, 0.18, 0.0))
        return replace(self, given={**self.given, "turns": tuple(turn / ratio for turn in turns)})


PROTOCOLS = {
    "rich": Protocol(),
    "poor": Protocol({**FEW, "samples": 800}),
    "one pressure": Protocol({"pressures": (3e5,), "speeds": (0.005, 0.01, 0.02, 0.04)}),
    "no repeats": Protocol({"turns": SINGLE_LOOP, "samples": 800}),
    "geometry to 1 %": Protocol(errors=ONE_PERCENT),
}
