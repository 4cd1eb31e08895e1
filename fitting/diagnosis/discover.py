"""Diagnose and add, until nothing more can be said."""

from collections.abc import Sequence
from dataclasses import dataclass

from fitting.diagnosis.diagnose import Progress, diagnose, library_candidates
from fitting.diagnosis.record import Diagnosis
from fitting.recordings.records import Experiment
from mckibben_jax.effect import Effect, name_of
from mckibben_jax.model import with_effects

MOST_ROUNDS = 6
WORTH_IT = 0.99  # of the left-out error: an effect that the data cannot see changes it by a rounding error


@dataclass(frozen=True)
class Step:
    """One model on the way: what was added to the one before, its errors (N), and what is said of it."""

    effect: str  # "baseline" first; names joined by "+" where several were added at once
    rmse: float
    held_out_rmse: float
    verdict: str
    diagnosis: Diagnosis


def discover(
    experiments: Sequence[Experiment],
    effects: Sequence[Effect],
    *,
    candidates: Sequence[Effect] | None = None,
    fix: Sequence[str] = (),
    free: Sequence[str] = (),
    own: Sequence[str] = (),
    seed: int = 0,
    progress: Progress | None = None,
) -> tuple[Step, ...]:
    """Diagnose, add what is missing, and diagnose again.

    `candidates` as in `diagnose`. Where the verdict is not unique, what lowers the left-out error most is added, as
    long as that falls by more than its standard error. Each step carries the verdict on the model that it leads to.
    """
    steps: list[Step] = []
    present, added = list(effects), ("baseline",)
    candidates = library_candidates() if candidates is None else candidates
    known = {name_of(effect): effect for effect in (*effects, *candidates)}
    while True:
        found = diagnose(
            experiments,
            present,
            candidates=list(known.values()),
            fix=fix,
            free=free,
            own=own,
            seed=seed,
            progress=progress,
        )
        steps.append(Step("+".join(added), found.rmse, found.held_out_rmse, found.verdict, found))
        added = next_to_add(found)
        if not added or len(steps) > MOST_ROUNDS:
            return tuple(steps)
        present = with_added(present, [known[name] for name in added])


def next_to_add(found: Diagnosis) -> tuple[str, ...]:
    """What to add after a diagnosis: the explanation, else what predicts best; nothing where nothing is missing."""
    if found.verdict in ("nothing detectable", "inconclusive"):
        return ()
    if found.verdict == "missing":
        return found.explanations[0]
    singles = [e for e in found.tried if len(e.effects) == 1]
    pool = [e for e in found.tried if e.effects in found.explanations] or [e for e in singles if e.plausible] or singles
    useful = [e for e in pool if e.fall > 1 and e.held_out_rmse < WORTH_IT * found.held_out_rmse]
    return min(useful, key=lambda e: e.held_out_rmse).effects if useful else ()


def with_added(present: Sequence[Effect], new: Sequence[Effect]) -> list[Effect]:
    """A set of effects with others added, each in place of its rivals."""
    return list(with_effects(present, new))
