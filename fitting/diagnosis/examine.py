"""How one fitted set of effects stands: tested for anything missing, and on runs left out."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from fitting.diagnosis import between_runs, flips, omnibus
from fitting.diagnosis.between_runs import Nuisance
from fitting.diagnosis.flips import FlipGroups, Ground
from fitting.diagnosis.universe import CandidateFit, Universe
from fitting.diagnosis.working_noise import Kinds, Noise
from fitting.full_names import owner_of
from fitting.least_squares import held_out

INVISIBLE = 0.02  # of a signature's square that must survive the model's own parameters to be seen at all
SIMILAR = 0.9
MOST = 0.25  # of the squared error, left where runs that differ a little would have to do the rest: no explanation
UNREAL = 1e4  # times its usual size, that an effect had to have to be seen: these data cannot show it


@dataclass(frozen=True)
class Seen:
    """What the test says of one candidate."""

    p_value: float
    limit: float | None  # N rms left after refitting, found with power 0.8; None where the data cannot see it
    absorbed: float
    similar: dict[str, float]


@dataclass(frozen=True)
class AdequacyTest:
    """A fitted set and its test; `reason` says why it is not adequate, empty if it is."""

    test: flips.Verdict
    columns: tuple[str, ...]  # the candidate of each tested column
    rms_columns: np.ndarray  # of what is left of each column, N
    noise_rms: float
    noise: float  # the same, N
    reason: str = ""

    @property
    def rejected(self) -> bool:
        """Whether something is missing."""
        return self.test.rejected

    def inadequate(self, reason: str) -> "AdequacyTest":
        """The same, not adequate for this reason."""
        return replace(self, reason=reason)

    def of(self, name: str) -> Seen:
        """What the test says of one candidate, over all its shapes."""
        at = [i for i, column in enumerate(self.columns) if column == name]
        if not at:
            return Seen(float("nan"), None, float("nan"), {})
        visible = [i for i in at if self.test.left[i] ** 2 > INVISIBLE and not self.test.explained[i] > UNREAL]
        large = np.sqrt(flips.MANY**2 - 1) * self.noise  # seen where flips are blind, if the bases take it up
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
            if other != name and self.test.left[j] ** 2 > INVISIBLE:
                cosine = float(np.max(np.abs(self.test.cosines[at, j])))
                if cosine > SIMILAR:
                    found[other] = max(found.get(other, 0.0), cosine)
        return dict(sorted(found.items(), key=lambda item: -item[1]))


class Examiner:
    """Tests fitted sets of one universe, all with the same units and the same flips."""

    def __init__(self, world: Universe, base: CandidateFit, seed: int):
        self.world, self.base, self.seed = world, base, seed
        self.basis = omnibus.basis(world.samples)
        self.kinds = Kinds.after_removal(np.hstack([self.basis.whole, base.slopes]), world.samples)
        self.flip_groups: FlipGroups = flips.flip_groups(world.samples, self.noise(base).memory)
        points = self.flip_groups.count == len(world.samples)  # of a static map: each was set by itself
        self.runs_apart = not points and len(np.unique(world.samples.run)) > 1
        self._left_out: dict[tuple[int, bool], np.ndarray] = {}
        self._left: dict[int, float] = {}

    @cached_property
    def groups(self) -> np.ndarray:
        """Which left-out group each row belongs to."""
        return held_out.folds(self.world.samples)

    def noise(self, fit: CandidateFit) -> Noise:
        """The working noise model of a fit, from what neither its parameters nor the omnibus basis explain."""
        return self.kinds.noise(fit.rows, fit.slopes)

    @property
    def rests_on(self) -> str:
        """What the test rests on, in words."""
        allowed = (
            f"; from run to run each effect's parameters may differ by {between_runs.REPEATABLE:.0%} at most, "
            "the zero by the noise of one reading"
        )
        return self.flip_groups.words + (allowed if self.runs_apart else "")

    def nuisance(self, fit: CandidateFit) -> Nuisance:
        """How a fitted set may give way before anything is called missing from it."""
        if self.runs_apart:
            return between_runs.nuisance_between_runs(fit, self.world.layout, self.world.samples)
        return between_runs.common_nuisance(fit)

    def left(self, fit: CandidateFit) -> float:
        """Sum of squares that a fitted set leaves when its runs may differ a little."""
        if id(fit) not in self._left:  # every set is compared with many
            self._left[id(fit)] = self.nuisance(fit).left(fit.rows)
        return self._left[id(fit)]

    def adequacy(
        self,
        added: frozenset[str],
        fit: CandidateFit,
        fits: Mapping[frozenset[str], CandidateFit],
        limits: bool = False,
    ) -> AdequacyTest:
        """Test a fitted set against every candidate that could still be added, at several of its shapes.

        What the bases that know no effect reject is rejected, and needs no candidates (unless `limits` are wanted).
        """
        names, signatures = [], np.zeros((len(self.world.samples), 0))
        verdict = None if limits else self._tested(fit, signatures)
        if verdict is None or not verdict.rejected:
            names, signatures = self.columns(fit, fits)
            verdict = self._tested(fit, signatures, limits)
        in_newtons = self.world.in_newtons
        left = between_runs.common_nuisance(fit).project_out(signatures) * self.world.samples.sigma[:, None]
        rms = np.sqrt(np.mean(left[in_newtons] ** 2, axis=0))
        noise = verdict.floor * float(np.sqrt(np.mean(self.world.samples.sigma[in_newtons] ** 2)))
        return AdequacyTest(verdict, tuple(names), rms, verdict.floor, noise, self._why_not(added, fit, verdict))

    def against(self, fit: CandidateFit, rivals: Sequence[tuple[frozenset[str], CandidateFit]]) -> float:
        """The p-value of a fitted set where only what its rivals (added, trial) would change is looked for.

        Few directions are looked along, so less is needed in each than where the whole library is.
        """
        columns = [t.slopes[:, [owner_of(n) in added for n in t.free]] for added, t in rivals]
        wanted = np.hstack(columns)
        size = np.linalg.norm(wanted, axis=0)
        left = np.linalg.norm(between_runs.common_nuisance(fit).project_out(wanted), axis=0)
        seen = wanted[:, left**2 > INVISIBLE * np.maximum(size**2, 1e-300)]
        if not seen.shape[1]:
            return 1.0
        return float(self._tested(fit, seen).p_effects.min())

    def _tested(self, fit: CandidateFit, columns: np.ndarray, limits: bool = False) -> flips.Verdict:
        """The test of a fitted set along these columns (rows, q)."""
        same, own = between_runs.common_nuisance(fit), self.nuisance(fit)
        return flips.judged(fit.rows, same, own, columns, self.ground(fit), limits)

    def ground(self, fit: CandidateFit) -> Ground:
        """What the test of a fitted set rests on."""
        return Ground(self.world.samples, self.flip_groups, self.basis, self.noise(fit), self.seed)

    def _why_not(self, added: frozenset[str], fit: CandidateFit, verdict: flips.Verdict) -> str:
        if verdict.rejected and verdict.p >= verdict.level:
            return "leaves many times the noise"
        if verdict.rejected:
            return f"something is still missing (p = {verdict.p:.2g})"
        many = verdict.rms > flips.MANY * verdict.inside
        if added and many and verdict.rms**2 > MOST * held_out.rms(self.base.rows) ** 2:
            return "leaves most of the error, many times the noise"
        ends = [name for name in fit.at_bound if owner_of(name) in added]
        if ends:
            return f"{', '.join(ends)} ends at its bound"
        denied = self.world.contradicted(fit)
        if added and denied:
            return f"contradicts what was measured: {', '.join(denied)}"
        if added:
            fall, error = held_out.difference(self.left_out(self.base), self.left_out(fit), self.groups)
            if not fall > error:
                return "does not lower the error on runs left out"
        return ""

    def columns(
        self, fit: CandidateFit, fits: Mapping[frozenset[str], CandidateFit], glance: bool = False
    ) -> tuple[list[str], np.ndarray]:
        """Whatever could still be added: names, and signatures (rows, names), at three shapes; at a glance, at two."""
        wanted = []
        for candidate in self.world.candidates:
            after = self.world.with_added([candidate], fit.effects)
            if candidate not in fit.effects and not self.world.lacking(after):
                shapes = self._shapes(candidate, fits)
                wanted += [(candidate, shape) for shape in ([shapes[0], *shapes[1:][-1:]] if glance else shapes)]
        columns = self.world.signatures(fit, wanted)
        told = np.all(np.isfinite(columns), axis=0) & np.any(columns != 0, axis=0)
        return [name for (name, _), good in zip(wanted, told, strict=True) if good], columns[:, told]

    def _shapes(self, candidate: str, fits: Mapping[frozenset[str], CandidateFit]) -> list[dict[str, float]]:
        """A few values of its parameters, the last as fitted alone."""
        shapes = self.world.shapes(candidate)
        alone = fits.get(frozenset([candidate]))
        if alone is None:
            return shapes
        names = self.world.layout.of_effect(candidate)
        found = dict(zip(names, alone.vector[self.world.layout.at(names)], strict=True))
        return [*shapes[:2], found]

    def left_out(self, fit: CandidateFit, glance: bool = False) -> np.ndarray:
        """The rows of a fit on runs left out; at a glance, without refitting."""
        key = (id(fit), glance)
        if key not in self._left_out:
            self._left_out[key] = self.world.left_out(fit, self.groups, glance)
        return self._left_out[key]
