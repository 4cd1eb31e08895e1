"""What a diagnosis says: immutable records, made by `diagnose`, shown by `report` and written by the command line."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from fitting.diagnosis.findings import Blamed, InstrumentAnswer, OddRun, RestsOn
from fitting.diagnosis.outcomes import Screened, Verdict, Why
from fitting.least_squares.record import Fit
from fitting.problem.estimate import Estimate


@dataclass(frozen=True)
class Evidence:
    """What speaks for one effect of the library, added to the baseline alone (or put in place of its rival)."""

    name: str
    p_value: float | None = None  # that this effect is not missing from the baseline, corrected for all looked at
    rmse: float | None = None  # of the baseline refitted with it, N
    held_out_rmse: float | None = None  # on runs left out, N
    detection_limit: float | None = None  # N rms left after refitting the baseline, found with power 0.8
    absorbed_share: float | None = None  # of its signature that the baseline's parameters swallow
    similar: dict[str, float] = field(default_factory=dict)  # other effects with nearly the same signature: cosine
    estimate: dict[str, Estimate] = field(default_factory=dict)  # by the parameter's name
    adequate: bool = False
    why: Why | None = None  # it cannot be tested, it is not adequate, or it is not named though it is
    unexplained: float | None = None  # rms of what neither noise nor instruments within their accuracy can make, N


@dataclass(frozen=True)
class Explanation:
    """A set of effects to add to the baseline (or to put in place of a rival), refitted jointly."""

    effects: tuple[str, ...]
    rmse: float
    held_out_rmse: float
    fall: float  # of the left-out mean square below the baseline's, in its standard errors
    p_value: float  # of the test that anything is still missing from it
    adequate: bool
    why: Why | None = None  # it is not tested, not adequate, or not named though it is
    plausible: bool = True  # nothing added ends at its bound, no stated measurement is denied
    estimate: dict[str, Estimate] = field(default_factory=dict)  # by the parameter's full name
    unexplained: float = float("nan")  # as of `Evidence`
    replaces: tuple[str, ...] = ()  # rivals that the baseline has


@dataclass(frozen=True)
class Leading:
    """The effect, or class of exact likes, that lowers the left-out error by clearly more than any other."""

    effects: tuple[str, ...]
    share: float  # of the squared left-out error that it removes
    held_out_rmse: float
    runner_up_rmse: float


@dataclass(frozen=True)
class Diagnosis:
    """The verdict with its evidence. Errors in N (m where only positions were measured)."""

    verdict: Verdict
    negligible: bool
    explanations: tuple[tuple[str, ...], ...]
    classes: tuple[tuple[tuple[str, ...], ...], ...]  # sets of effects that these data cannot tell apart at all
    nearest: tuple[Explanation, ...]
    leading: Leading | None
    p_value: float
    level: float
    rests_on: RestsOn
    rmse: float
    held_out_rmse: float
    noise_floor: float
    full_scale: float
    effects: dict[str, Evidence]
    tried: tuple[Explanation, ...]
    baseline: Fit
    residual: np.ndarray  # of the baseline, as its samples
    instruments: tuple[InstrumentAnswer, ...] = ()
    blamed: tuple[Blamed, ...] = ()  # errors of instruments that the explanations stand for, in their order
    faint: tuple[str, ...] = ()  # effects that could hide here at more than the noise of a reading
    why: Why | None = None  # nothing is decided
    screened: tuple[Screened, ...] = ()
    notes: tuple[str, ...] = ()  # on the recordings
    odd_runs: tuple[OddRun, ...] = ()  # differ from the others by more than their instruments allow
    unexplained: float = float("nan")  # by the model itself, as of `Evidence`
    substitutes: tuple[tuple[str, str], ...] = ()  # effect of the model, and one that would do the same in its place
    # what single effects and named sets would change the prediction by, as the residual
    changes: Mapping[frozenset[str], np.ndarray] = field(default_factory=dict, compare=False, repr=False)

    @property
    def beyond_noise(self) -> float:
        """The error of the model without what noise alone leaves, N."""
        return float(np.sqrt(max(self.rmse**2 - self.noise_floor**2, 0.0)))

    @property
    def is_strained(self) -> bool:
        """Whether instruments explain the misfit only if one of them errs by far more than its accuracy.

        The test hardly sees what is the same in all repeats of a few held lengths; the sizes of the errors do.
        """
        return self.verdict == Verdict.WITHIN_INSTRUMENTS and any(each.is_beyond for each in self.instruments)
