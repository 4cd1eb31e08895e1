"""What every explanation that remains predicts of the recordings that the rig could make."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fitting.diagnosis.diagnose import of_force
from fitting.diagnosis.record import Diagnosis
from fitting.diagnosis.settings import DIAGNOSIS
from fitting.planning.candidates import RigAbilities, grid, on_specimen, rig_abilities, specimens
from fitting.planning.predictions import Candidates, Explained, candidates, explain
from fitting.planning.protocols import Protocol, Specimen
from fitting.planning.separation import Outlook, Readings, noise_of_test
from fitting.planning.settings import CHOICE
from fitting.problem.thinning import thinned
from fitting.problem.varying import Varying
from fitting.progress import Progress, unwatched
from fitting.recordings.records import Experiment
from mckibben_jax.effect import Effect, name_of
from mckibben_jax.effects import LIBRARY


@dataclass(frozen=True)
class Prospect:
    """All that is needed to judge recordings: explanations, candidates, and which of these can be made."""

    outlook: Outlook
    can: RigAbilities
    usable: tuple[int, ...]
    seed: int

    @property
    def names(self) -> tuple[tuple[str, ...], ...]:
        """What each explanation adds."""
        return tuple(e.effects for e in self.outlook.explained)

    @property
    def forces(self) -> list[np.ndarray]:
        """What each explanation predicts, N, at every reading of every candidate."""
        return forces_of(self.outlook.planned, self.outlook.explained)

    @property
    def protocols(self) -> tuple[Protocol, ...]:
        """The candidates."""
        return self.outlook.planned.protocols


def prospect(
    diagnosis: Diagnosis,
    experiments: Sequence[Experiment],
    rivals: Sequence[tuple[str, ...]],
    varying: Varying,
    *,
    known: Sequence[Effect] = (),
    other_muscles: bool = False,
    seed: int = 0,
    progress: Progress = unwatched,
) -> Prospect:
    """Fit each explanation to the data and let it predict every candidate."""
    tested = of_force(experiments)[0]
    light = [thinned(experiment, DIAGNOSIS.samples // len(tested)) for experiment in tested]
    can = rig_abilities(next(e for e in experiments if e.name == tested[0].name))
    if other_muscles:
        plan = [(other, on_specimen(can, Specimen(other.name)), can) for other in specimens(light[0])]
    else:
        plan = [(light[0], grid(can), can)]
    planned = candidates(light, plan)
    told = list[Explained]()
    for added in rivals:
        progress(f"predicting with {' + '.join(added) or 'the model'}", len(told) / len(rivals))
        told.append(_explained(diagnosis, planned, added, known, varying))
    outlook = Outlook(planned, tuple(told), noise_of_test(told[0], planned), _readings(light, can))
    return Prospect(outlook, can, _usable(planned, told, can), seed)


def _explained(
    diagnosis: Diagnosis,
    planned: Candidates,
    added: Sequence[str],
    known: Sequence[Effect],
    varying: Varying,
) -> Explained:
    """An explanation, fitted from where the diagnosis left its effects."""
    kinds = {name_of(effect): effect for effect in (*(kind() for kind in LIBRARY), *known)}
    start = dict(diagnosis.baseline.values)
    for name in added:
        evidence = diagnosis.effects.get(name)
        found = {} if evidence is None else {f"{name}.{key}": value for key, (value, *_) in evidence.estimate.items()}
        start |= found
    base = diagnosis.baseline.layout.templates[0].effects
    return explain(planned, base, [kinds[name] for name in added], start, varying)


def _readings(light: Sequence[Experiment], can: RigAbilities) -> Readings:
    """How new readings will err: as the old ones, and thinned as the test will thin them all."""
    runs = [run for e in light for r in e.recordings if r.test != "static" for run in r.runs]
    loops = sum(len(np.unique(run.loop)) for run in runs)
    apart = float(np.median([np.median(np.diff(run.time)) for run in runs])) if runs else can.interval
    return Readings(max(apart / can.interval, 1.0), can.interval, DIAGNOSIS.samples / (loops + CHOICE.usual))


def forces_of(planned: Candidates, told: Sequence[Explained]) -> list[np.ndarray]:
    """What each explanation predicts, N: the readings of candidates are 0, so that rows are forces over sigma."""
    return [e.rows * planned.samples.sigma for e in told]


def _usable(planned: Candidates, told: Sequence[Explained], can: RigAbilities) -> tuple[int, ...]:
    """Candidates in which no explanation predicts that the muscle is slack, further than the data have been."""
    least = min(can.force, 0.0) - 3 * can.noise
    forces = forces_of(planned, told)
    fine = lambda rows: all(np.all(np.isfinite(f[rows])) and f[rows].min() > least for f in forces)  # noqa: E731
    return tuple(number for number, rows in enumerate(planned.rows) if fine(rows))
