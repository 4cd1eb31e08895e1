"""Every effect of the library hidden in a user's own recordings, and looked for: what a verdict on them is worth."""

import hashlib
import inspect
import json
import zlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from fitting.diagnosis.diagnose import diagnose, of_force, prepared
from fitting.diagnosis.outcomes import Verdict
from fitting.diagnosis.record import Diagnosis
from fitting.diagnosis.search import Search
from fitting.errors import unknown_name
from fitting.progress import Progress, unwatched
from fitting.recordings.envelopes import without_envelopes
from fitting.recordings.records import Experiment, force_was_measured
from fitting.selftest.hide import Hidden, Hiding
from fitting.selftest.record import SEEN, Log, Outcome, SelfTest, Sought, Trial
from fitting.selftest.rehearse import rehearsed
from fitting.selftest.settings import SELFTEST
from fitting.study.task import Task
from fitting.version import program_version
from mckibben_jax.effect import Effect

NOTHING = ""


@dataclass(frozen=True)
class _Rehearsal:
    """What all trials have in common."""

    task: Task
    search: Search
    experiments: tuple[Experiment, ...]  # of force, with every reading
    candidates: Sequence[Effect] | None
    log: Log
    known: dict[tuple[str, float], Trial]

    def tried(self, effect: str, times: float, hidden: Hidden, effects: frozenset[str]) -> Trial:
        """One diagnosis, unless it was made before."""
        found = self.known.get((effect, times))
        if found is None:
            found = self._diagnosed(effect, times, hidden, effects)
            self.log.keep(found)
        return found

    def _diagnosed(self, effect: str, times: float, hidden: Hidden, effects: frozenset[str]) -> Trial:
        seed = [self.task.seed, zlib.crc32(effect.encode()), int(1000 * times)]
        number = int(np.random.SeedSequence(seed).generate_state(1)[0])
        made = rehearsed(self.search, self.experiments, effects, hidden.vector, number)
        start = self.search.baseline.values
        said = diagnose(made, self.task.effects, candidates=self.candidates, start=start, **self.task.asked)
        limits = {name: each.detection_limit for name, each in said.effects.items()} if not effect else {}
        return Trial(
            effect, times, hidden.size, hidden.values, said.verdict.value, said.explanations,
            outcome_of(said, effect), limits,
        )  # fmt: skip


def selftest(
    task: Task,
    candidates: Sequence[Effect] | None = None,
    hide: Sequence[str] = (),
    log: Log | None = None,
    progress: Progress = unwatched,
    on_effect: Callable[[Sought], None] = lambda _: None,
) -> SelfTest:
    """Hide each effect (or those named in `hide`) in the task's own recordings, and diagnose them.

    The truth is the task's model at its fit with one effect more. Each is tried at a few times its detection limit.
    `log` keeps every diagnosis; `on_effect` is called with what came of each effect.
    """
    progress("fitting the model", 0.0)
    search = prepared(task.experiments, task.effects, candidates, task.varying, task.seed, start=task.known)
    names = _chosen(search, hide)
    log = replace(log, mark=_mark(task, search)) if log else Log(None)
    experiments = tuple(without_envelopes(e) for e in of_force(task.experiments)[0])
    if not force_was_measured(task.experiments):  # of a rehearsed one it looks as if it were
        candidates = [search.world.effects[name] for name in search.world.candidates]
    rehearsal = _Rehearsal(task, search, experiments, candidates, log, log.known())
    progress("nothing hidden", 0.0)
    base = Hidden(NOTHING, {}, 0.0, search.base.vector)
    clean, sought = rehearsal.tried(NOTHING, 0.0, base, search.base.effects), []
    for number, name in enumerate(names):
        told = partial(_at, progress, number / len(names))
        sought.append(_sought(rehearsal, name, clean.limits.get(name), told))
        on_effect(sought[-1])
    units = {entry.name: entry.unit for entry in search.world.layout.entries}
    fit = search.baseline
    return SelfTest(clean, tuple(sought), units, fit.rmse, fit.over_noise)


def _at(progress: Progress, share: float, text: str) -> None:
    progress(text, share)


def _chosen(search: Search, hide: Sequence[str]) -> tuple[str, ...]:
    for name in hide:
        if name not in search.world.candidates:
            raise unknown_name("effect in --hide that these data could show:", name, search.world.candidates)
    return tuple(hide) or search.world.candidates


def _sought(rehearsal: _Rehearsal, name: str, limit: float | None, progress: Callable[[str], None]) -> Sought:
    """One effect at growing sizes until it is found, and once smaller where it is found at once."""
    hiding = Hiding(rehearsal.search, name)
    lacking = rehearsal.search.world.lacking(hiding.effects)
    if lacking:
        return Sought(name, None, why_not=f"needs {' and '.join(lacking)}")
    if limit is None or not np.isfinite(limit):
        return Sought(name, None, why_not="these data cannot see it")
    trials = []
    for times in SELFTEST.sizes:
        if trials and not _worth_trying(times, trials):
            continue
        progress(f"{name} at {times:g} times its detection limit")
        hidden = hiding.of(times * limit)
        if hidden is not None:
            trials.append(rehearsal.tried(name, times, hidden, hiding.effects))
    if trials:
        return Sought(name, limit, tuple(sorted(trials, key=lambda each: each.size)))
    hidden = hiding.smallest  # of a rival without a free size: there is but one
    if not limit * SELFTEST.as_good_as_absent < hidden.size < np.inf:
        return Sought(name, limit, why_not="nowhere in its range does it leave as much as can be detected")
    return Sought(name, limit, (rehearsal.tried(name, round(hidden.size / limit, 3), hidden, hiding.effects),))


def _worth_trying(times: float, trials: Sequence[Trial]) -> bool:
    """Whether a size can still change from where an effect is found: smaller where it is, larger where it is not."""
    named = any(trial.outcome is Outcome.NAMED for trial in trials)
    return any(trial.outcome in SEEN for trial in trials) if times < trials[0].times else not named


def outcome_of(said: Diagnosis, effect: str) -> Outcome:
    """What a diagnosis made of an effect; of nothing hidden, what it made of nothing."""
    if said.verdict is Verdict.NOT_IN_LIBRARY:
        return Outcome.UNKNOWN
    if said.verdict not in (Verdict.MISSING, Verdict.ONE_OF):
        return Outcome.NOT_SEEN
    if (effect,) not in said.explanations:
        return Outcome.MISTAKEN
    return Outcome.NAMED if len(said.explanations) == 1 else Outcome.ONE_OF


def _mark(task: Task, search: Search) -> str:
    """What makes a trial the same: the data, the model with its values, what may be missing, the seed, the program."""
    values = {name: repr(value) for name, value in search.baseline.values.items()}
    parts = [[e.sha256 for e in task.experiments], sorted(search.world.base), values, sorted(search.world.candidates),
             [_law(effect) for effect in search.world.effects.values()], repr(task.varying), task.seed,
             program_version()]  # fmt: skip
    return hashlib.sha256(json.dumps(parts).encode()).hexdigest()


def _law(effect: Effect) -> str:
    """What tells an effect from another of its name: the line that defines it, or the source of a user's own."""
    kind = type(effect)
    line = getattr(kind, "line", None)
    if line is not None or kind.__module__.startswith("mckibben_jax."):
        return repr(line)
    try:
        return inspect.getsource(kind)
    except (OSError, TypeError):
        return repr(kind)
