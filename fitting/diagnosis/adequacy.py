"""Whether a fitted set of effects is adequate, and what the test of it says of every candidate."""

from dataclasses import dataclass

import numpy as np

from fitting.diagnosis.missing_effect import MissingEffectTest
from fitting.diagnosis.outcomes import Why
from fitting.diagnosis.settings import FLIP_TEST, VERDICT, VerdictSettings


@dataclass(frozen=True)
class Seen:
    """What the test says of one candidate."""

    p_value: float
    limit: float | None  # N rms left after refitting, found with power 0.8; None where the data cannot see it
    absorbed: float
    similar: dict[str, float]


@dataclass(frozen=True)
class AdequacyTest:
    """A fitted set and its test; `why` it is not adequate; None if it is."""

    test: MissingEffectTest
    columns: tuple[str, ...]  # the candidate of each tested column
    rms_columns: np.ndarray  # of what is left of each column, N
    noise_rms: float
    noise: float  # the same, N
    why: Why | None = None
    settings: VerdictSettings = VERDICT
    many_times_noise: float = FLIP_TEST.many

    @property
    def rejected(self) -> bool:
        """Whether something is missing."""
        return self.test.rejected

    def of(self, name: str) -> Seen:
        """What the test says of one candidate, over all its shapes."""
        at = [i for i, column in enumerate(self.columns) if column == name]
        if not at:
            return Seen(float("nan"), None, float("nan"), {})
        unreal = self.test.explained > self.settings.unreal
        shows = (self.test.left**2 > self.settings.invisible) | (self.test.detectable < self.settings.shown_amount)
        visible = [i for i in at if shows[i] and not unreal[i]]
        large = np.sqrt(self.many_times_noise**2 - 1) * self.noise  # seen where flips are blind, if the bases see it
        seen_anyway = np.maximum(large, self.test.explained * self.rms_columns)
        limits = [min(self.test.detectable[i] * self.rms_columns[i], seen_anyway[i]) for i in visible]
        absorbed = 1 - max(self.test.left[i] ** 2 for i in at)
        return Seen(
            float(min(self.test.p_effects[i] for i in at)),
            float(np.median(limits)) if limits else None,
            float(absorbed),
            self._similar(visible, name) if visible else {},
        )

    def _similar(self, at: list[int], name: str) -> dict[str, float]:
        found: dict[str, float] = {}
        for j, other in enumerate(self.columns):
            if other != name and self.test.left[j] ** 2 > self.settings.invisible:
                cosine = float(np.max(np.abs(self.test.cosines[at, j])))
                if cosine > self.settings.similar:
                    found[other] = max(found.get(other, 0.0), cosine)
        return dict(sorted(found.items(), key=lambda item: -item[1]))
