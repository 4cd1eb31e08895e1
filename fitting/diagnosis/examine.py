"""How one fitted set of effects stands: tested for anything missing, and on runs left out."""

from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from math import comb

import numpy as np

from fitting.diagnosis import omnibus
from fitting.diagnosis.adequacy import AdequacyTest
from fitting.diagnosis.blamed import unbelieved
from fitting.diagnosis.candidate_fit import CandidateFit
from fitting.diagnosis.estimates import untold
from fitting.diagnosis.findings import RestsOn
from fitting.diagnosis.flip_groups import flip_groups
from fitting.diagnosis.missing_effect import Ground, MissingEffectTest, missing_effect_test
from fitting.diagnosis.nuisance import Nuisance
from fitting.diagnosis.outcomes import Reason, Why
from fitting.diagnosis.schwarz import criterion, far_likelier, free_of_noise
from fitting.diagnosis.settings import DIAGNOSIS, DiagnosisSettings
from fitting.diagnosis.signatures import signatures
from fitting.diagnosis.universe import Universe
from fitting.full_names import owner_of
from fitting.instruments.errors import InstrumentErrors, InstrumentWhitener
from fitting.instruments.felt import errors_felt
from fitting.least_squares import held_out
from fitting.least_squares.decomposed import lstsq
from fitting.least_squares.working_noise import Kinds, Noise


class Examiner:
    """Tests fitted sets of one universe, all with the same groups and the same flips."""

    def __init__(self, world: Universe, base: CandidateFit, seed: int, settings: DiagnosisSettings = DIAGNOSIS):
        self.world, self.base, self.seed, self.settings = world, base, seed, settings
        self.basis = omnibus.basis(world.samples)
        self.kinds = Kinds.after_removal(np.hstack([self.basis.whole, base.slopes]), world.samples, settings.noise)
        self.trusting: dict[frozenset[str], CandidateFit] = {}  # sets, fitted as if no instrument erred
        self._noise: dict[CandidateFit, Noise] = {}
        self._errors: dict[CandidateFit, tuple[InstrumentErrors, InstrumentErrors]] = {}
        self._left_out: dict[tuple[CandidateFit, bool], np.ndarray] = {}
        self._beyond: dict[CandidateFit, np.ndarray] = {}
        self._left: dict[CandidateFit, float] = {}
        # of as many as are tested at a time alone: their factors are large
        self._grounds: deque[tuple[CandidateFit, Ground]] = deque(maxlen=settings.fits.workers)
        self.flip_groups = flip_groups(world.samples, self.noise(base).memory, settings.flip_test)

    @cached_property
    def groups(self) -> np.ndarray:
        """Which left-out group each row belongs to."""
        return held_out.folds(self.world.samples)

    def noise(self, fit: CandidateFit) -> Noise:
        """The working noise model of a fit, from what neither parameters nor instruments nor the basis explain."""
        if fit not in self._noise:  # a set is tested with many sizes of instruments' errors
            self._noise[fit] = self.kinds.noise_beside(fit.rows, fit.slopes, self.errors(fit))
        return self._noise[fit]

    @property
    def rests_on(self) -> RestsOn:
        """What the test rests on."""
        return self.flip_groups.rests_on()

    def errors(self, fit: CandidateFit, every: bool = False) -> InstrumentErrors:
        """What instruments within their accuracy can do to the rows of a fitted set; with `every` whatever they could.

        What none may do stands there in small sizes.
        """
        if fit not in self._errors:
            world = self.world
            rows_at = lambda problem, without: world.rows_at(fit, problem, without)  # noqa: E731
            lost = [name for name in sorted(fit.effects) if world.effects[name].stage == "lost"]
            felt = errors_felt(
                world.problem, world.samples, rows_at, lost, world.lengths, world.accuracies,
                self.settings.instruments, every=True,
            )  # fmt: skip
            self._errors[fit] = (felt, felt.allowed)
        return self._errors[fit][0 if every else 1]

    def rejected(self, fit: CandidateFit, errors: InstrumentErrors, columns: np.ndarray) -> bool:
        """Whether anything is missing from a fitted set, were these the errors of instruments.

        It is looked for along these columns (rows, q).
        """
        return self._tested(fit, columns, errors=errors).rejected

    def left(self, fit: CandidateFit) -> float:
        """Sum of squares that a fitted set leaves when instruments within their accuracy have given way, too.

        How errors are felt hardly depends on what is added: the base's stand for all.
        """
        if fit not in self._left:  # every set is compared with many
            self._left[fit] = Nuisance.of(fit).left(fit.rows, self._whitener)
        return self._left[fit]

    def adequacy(
        self,
        added: frozenset[str],
        fit: CandidateFit,
        fits: Mapping[frozenset[str], CandidateFit],
        limits: bool = False,
        errors: InstrumentErrors | None = None,
        bettered: bool = False,
    ) -> AdequacyTest:
        """Test a fitted set against every candidate that could still be added, at several of its shapes.

        `errors` are those that instruments may make, as allowed unless given; `bettered` says that one more effect
        brings the error far down. The signatures of candidates are costly: what the bases that know no effect reject,
        or what is not adequate for another reason, is not tested against them (unless `limits` are wanted).
        """
        names, columns = [], np.zeros((len(self.world.samples), 0))
        test = None if limits else self._tested(fit, columns, errors=errors)
        if test is None or self._why_not(added, fit, test, bettered) is None:
            names, columns = self.columns(fit, fits)
            test = self._tested(fit, columns, limits, errors)
        in_newtons = self.world.in_newtons
        left = Nuisance.of(fit).project_out(columns) * self.world.samples.sigma[:, None]
        rms = np.sqrt(np.mean(left[in_newtons] ** 2, axis=0))
        noise = test.floor * float(np.sqrt(np.mean(self.world.samples.sigma[in_newtons] ** 2)))
        why = self._why_not(added, fit, test, bettered)
        many = self.settings.flip_test.many
        return AdequacyTest(test, tuple(names), rms, test.floor, noise, why, self.settings.verdict, many)

    def against(self, fit: CandidateFit, rivals: Sequence[tuple[frozenset[str], CandidateFit]]) -> float:
        """The p-value of a fitted set where only what its rivals (added, fit) would change is looked for.

        Few directions are looked along, so less is needed in each than where the whole library is. A set that is right
        leaves noise in all of them, however little of a direction its own parameters leave.
        """
        columns = [t.slopes[:, [owner_of(n) in added for n in t.free]] for added, t in rivals]
        wanted = np.hstack(columns)
        size = np.linalg.norm(wanted, axis=0)
        left = np.linalg.norm(Nuisance.of(fit).project_out(wanted), axis=0)
        seen = wanted[:, left > self.settings.verdict.rounding * np.maximum(size, 1e-300)]
        if not seen.shape[1]:
            return 1.0
        return float(self._tested(fit, seen).p_effects.min())

    def _tested(
        self, fit: CandidateFit, columns: np.ndarray, limits: bool = False, errors: InstrumentErrors | None = None
    ) -> MissingEffectTest:
        """The test of a fitted set along these columns (rows, q)."""
        return missing_effect_test(fit.rows, Nuisance.of(fit), columns, self.ground(fit, errors), limits)

    def rejecting(self, fit: CandidateFit, by: Nuisance) -> MissingEffectTest:
        """The test of a fitted set by the bases that know no effect, more than its own parameters giving way."""
        return missing_effect_test(fit.rows, by, np.zeros((len(fit.rows), 0)), self.ground(fit).prepared(by))

    def ground(self, fit: CandidateFit, errors: InstrumentErrors | None = None) -> Ground:
        """What the test of a fitted set rests on; instruments err as they may unless `errors` are given."""
        found = next((ground for of, ground in tuple(self._grounds) if of is fit), None)
        if found is None:  # a set is tested with many sizes of instruments' errors
            ground = Ground(
                self.world.samples, self.flip_groups, self.basis, self.noise(fit), self.errors(fit), self.seed,
                self.settings.flip_test,
            )  # fmt: skip
            found = ground.prepared(Nuisance.of(fit))
            self._grounds.append((fit, found))
        return found if errors is None else replace(found, errors=errors)

    def _why_not(self, added: frozenset[str], fit: CandidateFit, test: MissingEffectTest, bettered: bool) -> Why | None:
        """Why a fitted set is not adequate; None if it is."""
        if test.by_size:
            return Why(Reason.LARGE_MISFIT)
        if test.rejected:
            return Why(Reason.STILL_MISSING, p_value=test.p)
        many = test.rms_beyond > self.settings.flip_test.many * test.floor
        if added and many and test.rms_beyond**2 > self.settings.verdict.most_left * held_out.rms(self.base.rows) ** 2:
            return Why(Reason.MOST_LEFT)
        ends = tuple(name for name in fit.at_bound if owner_of(name) in added)
        if ends:
            return Why(Reason.AT_BOUND, ends)
        denied = self.world.contradicted(fit)
        if added and denied:
            return Why(Reason.CONTRADICTS, denied)
        doubted = unbelieved(self.world, added, fit, self.settings.verdict.most_blamed)
        if doubted:
            return Why(Reason.UNBELIEVED, doubted)
        vague = untold(self.seen, added, fit, self.settings.verdict.untold)
        if vague:
            return Why(Reason.UNTOLD, vague)
        if added and not self._gains(added, fit):
            return Why(Reason.NO_GAIN)
        return Why(Reason.BETTERED) if bettered else None

    def _gains(self, added: frozenset[str], fit: CandidateFit) -> bool:
        """Whether a set predicts runs left out better than the base, by more than the standard error of that gain.

        Where they do not decide, for a few runs hardly ever do, all readings must make the set far likelier; of a few
        readings that says nothing, for as many numbers meet them.
        """
        fall, error = held_out.difference(self.beyond_instruments(self.base), self.beyond_instruments(fit), self.groups)
        if abs(fall) > error:
            return bool(fall > 0)
        if not self.has_plenty(fit):
            return False
        free, alone = free_of_noise(self.ground(fit)), self.alone
        chosen_among = comb(len(self.world.candidates), len(added))
        return far_likelier(criterion(alone, free) - criterion(fit, free), chosen_among, self.settings.verdict)

    def has_plenty(self, fit: CandidateFit) -> bool:
        """Whether there are so many readings for each fitted number that their likelihood decides."""
        return len(fit.rows) >= self.settings.verdict.each * len(fit.free)

    def columns(
        self, fit: CandidateFit, fits: Mapping[frozenset[str], CandidateFit], glance: bool = False
    ) -> tuple[list[str], np.ndarray]:
        """Whatever could still be added: names, and signatures (rows, names), at three shapes; at a glance, at two."""
        wanted = self.wanted(fit, fits, glance)
        columns = signatures(self.world, fit, wanted)
        usable = np.all(np.isfinite(columns), axis=0) & np.any(columns != 0, axis=0)
        return [name for (name, _), good in zip(wanted, usable, strict=True) if good], columns[:, usable]

    def wanted(
        self, fit: CandidateFit, fits: Mapping[frozenset[str], CandidateFit], glance: bool = False
    ) -> list[tuple[str, dict[str, float]]]:
        """Whatever could still be added, each with the values of a shape of it; at a glance, at two shapes."""
        wanted = []
        for candidate in self.world.candidates:
            after = self.world.with_added([candidate], fit.effects)
            if candidate not in fit.effects and not self.world.lacking(after):
                shapes = self._shapes(candidate, fits)
                wanted += [(candidate, shape) for shape in ([shapes[0], *shapes[1:][-1:]] if glance else shapes)]
        return wanted

    def _shapes(self, candidate: str, fits: Mapping[frozenset[str], CandidateFit]) -> list[dict[str, float]]:
        """A few values of its parameters, the last as fitted alone.

        What takes another's place has the size at which every reading is trusted: that of the other. A larger friction
        would leave little but the difference in size in its signature, which the model's own absorbs.
        """
        shapes = self.world.shapes(candidate)
        added = frozenset([candidate])
        replaces = not set(self.world.base) <= self.world.with_added([candidate])
        alone = self.trusting.get(added) if replaces else fits.get(added)
        if alone is None:
            return shapes
        names = self.world.layout.of_effect(candidate)
        found = dict(zip(names, alone.vector[self.world.layout.at(names)], strict=True))
        return [*shapes[:2], found]

    def beyond_instruments(self, fit: CandidateFit, glance: bool = False) -> np.ndarray:
        """The rows of a fit on held-out runs, whitened by what instruments may err by: to compare fits with.

        A length that is off by a millimetre would else hide what an effect removes: the parameters, too, are those of
        whitened rows. They are found in one step from the fit, or by a refit without each group where there are few
        readings.
        """
        few = len(self.world.samples) <= held_out.HELD_OUT.refit_below
        if few and not glance:
            if fit not in self._beyond:
                self._beyond[fit] = self.seen.left_out(fit, self.groups, whitened=self.without_instruments)
            return self._beyond[fit]
        rows, slopes = self.without_instruments(fit.rows), self.without_instruments(fit.slopes)
        whole, target = np.vstack([slopes, fit.prior_slopes]), np.concatenate([rows, fit.prior_rows])
        at_best = target - whole @ lstsq(whole, target, 1e-12)
        rows, prior_rows = at_best[: len(rows)], at_best[len(rows) :]
        return held_out.left_out_rows(rows, slopes, prior_rows, fit.prior_slopes, self.groups)

    @cached_property
    def seen(self) -> Universe:
        """The universe in which sets are fitted: as instruments that err within their accuracy let it be seen.

        A thousand runs have more errors than a search has room for; their columns would fill the memory.
        """
        errors = self.errors(self.base)
        return self.world if errors.count > self.world.room else self.world.seen_through(errors.columns)

    @cached_property
    def alone(self) -> CandidateFit:
        """The base fitted as the sets are, and to the end."""
        return self.seen.settled(self.base.effects, self.base.vector)

    def without_instruments(self, columns: np.ndarray) -> np.ndarray:
        """Rows (rows,) or columns (rows, q) without what instruments within their accuracy can make of them."""
        return self._whitener(columns)

    @cached_property
    def _whitener(self) -> InstrumentWhitener:
        return self.errors(self.base).whitener()

    def as_fitted(self, added: frozenset[str], fit: CandidateFit) -> CandidateFit:
        """A set whose errors people read: those of a fit that trusts every reading, as all other commands fit."""
        return self.trusting.get(added) or fit.plain

    def left_out(self, fit: CandidateFit, glance: bool = False) -> np.ndarray:
        """The rows of a fit on runs left out; at a glance, without refitting."""
        key = (fit, glance)
        if key not in self._left_out:
            self._left_out[key] = self.world.left_out(fit, self.groups, glance)
        return self._left_out[key]
