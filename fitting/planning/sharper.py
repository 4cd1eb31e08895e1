"""Which recording would show effects that these data cannot see, or see only when they are large."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import norm
from threadpoolctl import threadpool_limits

from fitting.diagnosis.record import Diagnosis
from fitting.planning.next_measurement import NextMeasurement, PairPower, Visible, measurement_of, trouble
from fitting.planning.predictions import Explained, changed_rows
from fitting.planning.prospect import Prospect, prospect
from fitting.planning.settings import CHOICE, SHARPEN
from fitting.problem.varying import AS_DECLARED, Varying
from fitting.progress import Progress, part_of, unwatched
from fitting.recordings.records import Experiment
from mckibben_jax.effect import Effect, name_of
from mckibben_jax.effects import LIBRARY


@dataclass(frozen=True)
class Signature:
    """What one effect would change, beside what the model's own parameters can make up for."""

    name: str
    old: float  # squared strength in the data
    new: np.ndarray  # the same with each candidate

    def gains(self) -> np.ndarray:
        """How many times smaller an effect would be seen."""
        least = max(self.old, float(self.new.max()) / SHARPEN.unseen**2, 1e-300)
        return np.sqrt(np.maximum(self.new, least) / least)


def blind(diagnosis: Diagnosis) -> tuple[str, ...]:
    """Effects that the data do not see, and those that must be largest to be seen; the worst first."""
    unseen = [e.name for e in diagnosis.effects.values() if e.rmse is not None and e.detection_limit is None]
    seen = [e for e in diagnosis.effects.values() if (e.detection_limit or 0.0) > diagnosis.noise_floor]
    large = [e.name for e in sorted(seen, key=lambda e: -(e.detection_limit or 0.0))]
    return (*large, *unseen)


def sharper(
    diagnosis: Diagnosis,
    experiments: Sequence[Experiment],
    *,
    known: Sequence[Effect] = (),
    varying: Varying = AS_DECLARED,
    seed: int = 0,
    progress: Progress = unwatched,
) -> NextMeasurement | None:
    """The recording that makes the effects of `blind` visible, as many of the worst as one recording can."""
    wanted = blind(diagnosis)[: 2 * SHARPEN.effects]
    if not wanted:
        return None
    present = diagnosis.explanations[0] if diagnosis.verdict == "missing" else ()
    with threadpool_limits(1, "blas"):
        first = prospect(
            diagnosis, experiments, [present], varying, known=known, seed=seed, progress=part_of(progress, 0.0, 0.2)
        )
        kinds = {name_of(effect): effect for effect in (*(kind() for kind in LIBRARY), *known)}
        missing = [kinds[name] for name in wanted if name not in present]
        progress("what each recording would show of what these data hardly see", 0.2)
        changes = changed_rows(first.outlook.explained[0], first.outlook.planned, missing, varying)
        found = [_signature(first, name, change) for name, change in changes.items()]
        return _chosen(first, [s for s in found if s.gains().max() > SHARPEN.least_gain][: SHARPEN.effects])


def _signature(given: Prospect, name: str, change: np.ndarray) -> Signature:
    """An effect at its declared values, by what it changes (rows,) where it is added to the fitted model."""
    base, planned, usable = given.outlook.explained[0], given.outlook.planned, set(given.usable)
    return Signature(
        name,
        _strength(given, base, change, None),
        np.array([_strength(given, base, change, n) if n in usable else 0.0 for n in range(len(planned.rows))]),
    )


def _strength(given: Prospect, base: Explained, change: np.ndarray, number: int | None) -> float:
    """Squared norm of a change beside the model's slopes, in the data and, if given, a candidate."""
    outlook = given.outlook
    parts = [outlook.old_white(np.hstack([change[:, None], base.slopes])[outlook.planned.old])]
    if number is not None:
        parts.append(outlook.new(number, np.hstack([change[:, None], base.slopes]), CHOICE.usual))
    both = np.concatenate(parts)
    both = np.nan_to_num(both)
    slopes = np.vstack([both[:, 1:], base.prior_slopes])
    aim = np.concatenate([both[:, 0], np.zeros(len(base.prior_slopes))])
    left = aim - slopes @ np.linalg.lstsq(slopes, aim, rcond=1e-12)[0]
    whole = float(aim @ aim)
    return float(left @ left) if left @ left > SHARPEN.dust * whole else 0.0


def _chosen(given: Prospect, wanted: Sequence[Signature]) -> NextMeasurement | None:
    """The candidate whose smallest gain is largest; inside what the rig has shown, unless that shows nothing."""
    if not wanted:
        return None
    gains = np.array([s.gains() for s in wanted])
    for beyond in (False, True):
        numbers = [n for n in given.usable if given.protocols[n].beyond == beyond]
        alive = [row for row in range(len(wanted)) if len(numbers) and gains[row, numbers].max() > SHARPEN.least_gain]
        if alive:
            least = {n: float(gains[alive, n].min()) for n in numbers}
            if max(least.values()) < SHARPEN.least_gain:  # no one recording serves all: the worst effect comes first
                alive = alive[:1]
                least = {n: float(gains[alive[0], n]) for n in numbers}
            best = min(numbers, key=lambda n: (-np.round(2 * np.log(least[n])), trouble(given, n)))
            return _recording(given, best, [wanted[row] for row in alive])
    return None


def _recording(given: Prospect, number: int, shown: Sequence[Signature]) -> NextMeasurement:
    """The record of a candidate that makes these effects visible."""
    pairs = tuple(PairPower((s.name,), (), _power(s, number), float(s.new[number])) for s in shown)
    gains = [(s.name, float(s.gains()[number])) for s in shown]
    visible = tuple(Visible(name, gain, gain >= SHARPEN.unseen) for name, gain in gains)
    return replace(measurement_of(given, number, CHOICE.usual, pairs), shows=visible)


def _power(signature: Signature, number: int) -> float:
    """For an effect of half the size that the data can show now, whose score grows as its strength does."""
    size = SHARPEN.shown_size * (SHARPEN.critical + SHARPEN.power_quantile) * float(signature.gains()[number])
    return float(norm.cdf(size - SHARPEN.critical))
