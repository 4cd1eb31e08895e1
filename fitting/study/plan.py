"""A protocol of recordings to make after a diagnosis: which, in which order, and what stays tied."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

from fitting.diagnosis.diagnose import of_force
from fitting.diagnosis.outcomes import NOTHING_MISSING
from fitting.diagnosis.record import Diagnosis
from fitting.planning.candidates import RigAbilities, rig_abilities
from fitting.planning.likes import with_likes_apart
from fitting.planning.next_measurement import NextMeasurement, measurements, remaining
from fitting.planning.sharper import sharper
from fitting.problem.varying import Varying
from fitting.progress import Progress, unwatched
from fitting.recordings.records import Experiment
from fitting.study.settings import STUDY
from fitting.study.task import Task
from mckibben_jax.effect import INSTRUMENT, Effect, name_of
from mckibben_jax.effects import LIBRARY

Sets = tuple[str, ...]


@dataclass(frozen=True)
class Plan:
    """Recordings in their order, after a diagnosis.

    `rivals` are the explanations that stand, `tied` those pairs of them that none of the recordings separates. Where
    nothing is missing but an effect of the model has likes (`of_likes`), they are that effect and each of these.
    """

    diagnosis: Diagnosis
    rivals: tuple[Sets, ...]
    steps: tuple[NextMeasurement, ...]
    tied: tuple[tuple[Sets, Sets], ...]
    can: RigAbilities
    instruments: tuple[str, ...] = ()  # of the effects that stay tied, those that an instrument shows by itself
    of_likes: bool = False

    @property
    def separates(self) -> bool:
        """Whether there are explanations to separate; else the recordings show what is still unseen."""
        return len(self.rivals) > 1


def plan_of(task: Task, diagnosis: Diagnosis, progress: Progress = unwatched) -> Plan:
    """The plan for a task: it knows the effects of the user's own file too."""
    known = [kind() for kind in task.library.values()]
    return plan(diagnosis, task.experiments, known=known, progress=progress, **task.asked)


def plan(
    diagnosis: Diagnosis,
    experiments: Sequence[Experiment],
    *,
    known: Sequence[Effect] = (),
    fix: Sequence[str] = (),
    free: Sequence[str] = (),
    own: Sequence[str] = (),
    seed: int = 0,
    progress: Progress = unwatched,
) -> Plan:
    """What to record: to separate explanations where several are left, else to see what is still unseen.

    `experiments`, `fix`, `free` and `own` as they were diagnosed; `known` are effects that the library does not have.
    """
    varying = Varying(fix, free, own)
    of_likes = diagnosis.verdict in NOTHING_MISSING and bool(diagnosis.substitutes)
    tested = of_force(experiments)[0]
    tie = with_likes_apart(diagnosis, tested, varying) if of_likes else diagnosis
    rivals = remaining(tie)
    if len(rivals) > 1:
        steps = measurements(tie, experiments, known=known, varying=varying, seed=seed, progress=progress)
        tied = _still_tied(rivals, steps)
    else:
        found = sharper(diagnosis, experiments, known=known, varying=varying, seed=seed, progress=progress)
        steps, tied = ((found,) if found else ()), ()
    can = rig_abilities(next(e for e in experiments if e.name == tested[0].name))
    sources = {name_of(effect): effect.source for effect in (*LIBRARY, *known)}
    open_ones = dict.fromkeys(name for pair in tied for names in pair for name in names)
    instruments = tuple(name for name in open_ones if sources.get(name) == INSTRUMENT)
    return Plan(diagnosis, tuple(rivals), tuple(steps), tied, can, instruments, of_likes)


def _still_tied(rivals: Sequence[Sets], steps: Sequence[NextMeasurement]) -> tuple[tuple[Sets, Sets], ...]:
    done = {frozenset((p.one, p.other)) for step in steps for p in step.pairs if p.power >= STUDY.separated}
    return tuple((a, b) for a, b in combinations(rivals, 2) if frozenset((a, b)) not in done)
