"""A protocol of recordings to make after a diagnosis: what, in which order, why, and what it should show."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

from rich.console import RenderableType

from fitting import units
from fitting.diagnosis.diagnose import of_force
from fitting.diagnosis.record import Diagnosis
from fitting.planning.candidates import Shown, shown, simulation
from fitting.planning.next_measurement import NextMeasurement, measurements, remaining
from fitting.planning.sharper import sharper
from fitting.report.columns import columns
from fitting.report.next_step import typed
from fitting.report.results import measurement_result
from fitting.report.sentences import effect_set, percent
from fitting.report.terminal import headed, lines, to_type
from fitting.study.task import MODEL_FILE, Task

REST = 60.0  # s between recordings, for creep and warmth to fade
INSTRUMENT = "instrument"  # the source of an effect that is none of the muscle's
SURE = 0.8  # power from which a pair counts as separated

Sets = tuple[str, ...]


@dataclass(frozen=True)
class Plan:
    """Recordings in their order; `tied` are pairs of explanations that none of them separates."""

    purpose: str
    steps: tuple[NextMeasurement, ...]
    tied: tuple[tuple[Sets, Sets], ...]
    expected: str
    can: Shown
    simulate: tuple[str | None, ...]  # the command that rehearses each recording
    instruments: tuple[str, ...] = ()  # of the effects that stay tied, those that an instrument shows by itself


def plan_of(task: Task, diagnosis: Diagnosis, data: Sequence[str], model: str | None = None) -> Plan:
    """What to record: to separate explanations where several are left, else to see what is still unseen.

    `model` is the file to rehearse with; that beside the first data set unless given.
    """
    extra = [kind() for kind in task.library.values()]
    asked: dict[str, Any] = {"fix": task.fix, "free": task.free, "own": task.own, "seed": task.seed}
    rivals = remaining(diagnosis)
    if len(rivals) > 1:
        steps = measurements(diagnosis, task.experiments, known=extra, **asked)
        tied = _still_tied(rivals, steps)
        purpose, expected = _purpose(diagnosis, rivals), _expected(diagnosis, steps, tied)
    else:
        found = sharper(diagnosis, task.experiments, known=extra, **asked)
        steps, tied = ((found,) if found else ()), ()
        purpose = "Nothing needs separating. This would show more of what these data hardly see."
        expected = f"as now ({diagnosis.verdict}), or one of the effects shown is missing too" if steps else ""
    tested = of_force(task.experiments)[0][0].name
    can = shown(next(e for e in task.experiments if e.name == tested))
    model = typed([model or (f"{data[0]}/{MODEL_FILE}" if data else MODEL_FILE)])
    rehearsals = (simulation(s.protocol, s.repeats, can, model, f"rehearsal_{n + 1}") for n, s in enumerate(steps))
    open_ones = dict.fromkeys(name for pair in tied for names in pair for name in names)
    instruments = tuple(n for n in open_ones if n in task.library and task.library[n].source == INSTRUMENT)
    return Plan(purpose, steps, tied, expected, can, tuple(rehearsals), instruments)


def _still_tied(rivals: Sequence[Sets], steps: Sequence[NextMeasurement]) -> tuple[tuple[Sets, Sets], ...]:
    done = {frozenset((p.one, p.other)) for step in steps for p in step.pairs if p.power >= SURE}
    return tuple((a, b) for a, b in combinations(rivals, 2) if frozenset((a, b)) not in done)


def _purpose(d: Diagnosis, rivals: Sequence[Sets]) -> str:
    names = "; ".join(effect_set(names) for names in rivals)
    if d.verdict == "not in the library":
        return f"No effect explains all; this separates the nearest: {names}."
    return f"These data cannot tell apart: {names}."


def _expected(d: Diagnosis, steps: Sequence[NextMeasurement], tied: Sequence[tuple[Sets, Sets]]) -> str:
    """The verdict to be expected once all is recorded."""
    if not steps:
        return "as now: no force test on this muscle, nor on one of another length or wall, separates them"
    decided = [p.power for step in steps for p in step.pairs if p.power >= SURE]
    if tied:
        pairs = ", ".join(f"{effect_set(a)} or {effect_set(b)}{_in_how_many(steps, a, b)}" for a, b in tied)
        rest = f"; the other pairs are decided (probability {percent(min(decided))} each)" if decided else ""
        return f"may stay open: {pairs}{rest}"
    after = "one is left, or none of them" if d.verdict == "not in the library" else "missing: one of them, uniquely"
    return f"{after} (each pair is decided with probability {percent(min(decided))})"


def _in_how_many(steps: Sequence[NextMeasurement], one: Sets, other: Sets) -> str:
    """How often the best of these recordings tells two explanations apart, in words; empty where none can."""
    powers = [p.power for step in steps for p in step.pairs if {p.one, p.other} == {one, other}]
    return f" (told apart in {percent(max(powers))} of the cases)" if powers else ""


# ----------------------------------------------------------------------------------------------------------- for people


def plan_report(plan: Plan) -> list[RenderableType]:
    """The protocol, and which pair is separated by what."""
    shown = [headed("PLAN", plan.purpose, "bold")]
    if not plan.steps:
        return [*shown, headed("RECORD", _nothing(plan))]
    for number, (step, command) in enumerate(zip(plan.steps, plan.simulate, strict=True)):
        shown += [headed(f"RECORD {number + 1}", f"{step.what}. It takes {duration(step.seconds)}.", "bold")]
        shown += [headed("", f"Why: {step.why}.")]
        shown += [headed("NEEDS", step.needs, "yellow")] if step.needs else []
        shown += [to_type("REHEARSE", command)] if command else []
    if len(plan.steps) > 1:
        shown.append(headed("ORDER", f"as listed, {duration(REST)} of rest without pressure between recordings"))
    cured = [_tie(plan, *pair) for pair in plan.tied]
    return [*shown, *lines("TIED", cured, "yellow"), headed("EXPECT", plan.expected), *_pairs(plan)]


def _nothing(plan: Plan) -> str:
    """Why no recording is proposed; and what does instead, where that is known."""
    zero = ". Read the instrument by itself: a gauge while the muscle is vented, a load cell while nothing hangs on it"
    shown = "nothing that a force test on this rig, or a changed one, would show"
    return f"{shown}{zero}, and you know {' and '.join(plan.instruments)}" if plan.instruments else shown


def _tie(plan: Plan, one: Sets, other: Sets) -> str:
    often = _in_how_many(plan.steps, one, other)
    return f"{effect_set(one)} or {effect_set(other)}{often or ': nothing here separates them'}"


def duration(seconds: float) -> str:
    """A time for people."""
    return f"{seconds / 60:.0f} min" if seconds >= 100 else units.show(max(seconds, 1.0), "s", digits=2)


def _pairs(plan: Plan) -> list[RenderableType]:
    table = columns("separated", "from", "by recording", "power", words=range(4))
    for number, step in enumerate(plan.steps):
        for p in step.pairs:
            other = effect_set(p.other) if p.other else "its absence"
            table.add_row(effect_set(p.one), other, str(number + 1), percent(p.power))
    return [headed("", ""), table]


# --------------------------------------------------------------------------------------------------------- for machines


def plan_result(plan: Plan, d: Diagnosis) -> dict[str, Any]:
    """`plan`: the protocol in SI units."""
    return {
        "verdict": d.verdict,
        "explanations": [list(names) for names in d.explanations],
        "purpose": plan.purpose,
        "protocol": [
            {"order": order, "rest_s": REST * (order > 1), **(measurement_result(step) or {}), "simulate": run}
            for order, (step, run) in enumerate(zip(plan.steps, plan.simulate, strict=True), start=1)
        ],
        "tied": [[list(a), list(b)] for a, b in plan.tied],
        "expected_verdict": plan.expected,
        "next_measurement": measurement_result(plan.steps[0]) if plan.steps else None,
    }
