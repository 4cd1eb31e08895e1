"""A protocol of recordings in words and for machines."""

from collections.abc import Sequence
from typing import Any

from rich.console import RenderableType

from fitting import showing
from fitting.planning.next_measurement import NextMeasurement
from fitting.report.results import measurement_result
from fitting.report.settings import ADVICE
from fitting.report.text.amounts import percent
from fitting.report.text.diagnosis import effect_set
from fitting.report.text.layout import columns, line, lines, paste_line
from fitting.report.text.measurement import needs_text, pull_text, purpose_text, rehearsal_command, what_text
from fitting.report.text.names import marked
from fitting.report.text.next_step import shell_words
from fitting.report.text.stages import verdict_words
from fitting.study.plan import Plan, Sets
from fitting.study.settings import STUDY


def _purpose(plan: Plan) -> str:
    if not plan.separates:
        return "No explanations need to be told apart. This would show more of what these data hardly see."
    names = "; ".join(effect_set(names) for names in plan.rivals)
    if plan.diagnosis.verdict == "not in the library":
        return f"No effect explains all; this separates the nearest: {names}."
    if plan.of_likes:
        return f"The model has {effect_set(plan.rivals[0])}; these data cannot tell apart: {names}."
    return f"These data cannot tell apart: {names}."


def _expected(plan: Plan) -> str:
    """The verdict to be expected once all is recorded."""
    verdict = plan.diagnosis.verdict
    if plan.separates:
        return _separated(verdict, plan.steps, plan.tied, plan.of_likes)
    now = verdict_words(verdict, plan.diagnosis.is_strained)
    return f"as now ({now}), or one of the effects shown is missing too" if plan.steps else ""


def _separated(
    verdict: str, steps: Sequence[NextMeasurement], tied: Sequence[tuple[Sets, Sets]], of_likes: bool
) -> str:
    if not steps:
        return "as now: no force test on this muscle, nor on one of another length or wall, separates them"
    decided = [p.power for step in steps for p in step.pairs if p.power >= STUDY.separated]
    if tied:
        pairs = ", ".join(f"{effect_set(a)} or {effect_set(b)}{_in_how_many(steps, a, b)}" for a, b in tied)
        rest = f"; the other pairs are decided (probability {percent(min(decided))} each)" if decided else ""
        return f"may stay open: {pairs}{rest}"
    after = "one is left, or none of them" if verdict == "not in the library" else "missing: one of them, uniquely"
    after = "one of them is left: that of the model, or another that is missing then" if of_likes else after
    return f"{after} (each pair is decided with probability {percent(min(decided))})"


def _in_how_many(steps: Sequence[NextMeasurement], one: Sets, other: Sets) -> str:
    """How often the best of these recordings tells two explanations apart, in words; empty where none can."""
    powers = [p.power for step in steps for p in step.pairs if {p.one, p.other} == {one, other}]
    return f" (told apart in {percent(max(powers))} of the cases)" if powers else ""


# ----------------------------------------------------------------------------------------------------------- for people


def plan_report(plan: Plan, model: str) -> list[RenderableType]:
    """The protocol, and which pair is separated by what; `model` is the file to rehearse with."""
    shown = [line("PLAN", _purpose(plan), "bold")]
    if not plan.steps:
        return [*shown, line("RECORD", _nothing(plan))]
    for number, (step, command) in enumerate(zip(plan.steps, _rehearsals(plan, model), strict=True)):
        said = f"{what_text(step)}. It takes {duration(step.seconds)}. {pull_text(step)}".rstrip()
        shown += [line(f"RECORD {number + 1}", said, "bold")]
        shown += [line("", f"Why: {purpose_text(step)}.")]
        shown += lines("NEEDS", [needs] if (needs := needs_text(step.protocol)) else [], "yellow")
        shown += [paste_line("REHEARSE", command)] if command else []
    if len(plan.steps) > 1:
        shown.append(line("ORDER", f"as listed, {duration(ADVICE.rest)} of rest without pressure between recordings"))
    cured = [_tie(plan, *pair) for pair in plan.tied]
    return [*shown, *lines("TIED", cured, "yellow"), line("EXPECT", _expected(plan)), *_pairs(plan)]


def _rehearsals(plan: Plan, model: str) -> list[str | None]:
    """The command that rehearses each recording; None where `mckibben simulate` cannot do it."""
    steps = enumerate(plan.steps, start=1)
    return [
        rehearsal_command(s.protocol, s.repeats, plan.can, shell_words([model]), f"rehearsal_{n}") for n, s in steps
    ]


def _nothing(plan: Plan) -> str:
    """Why no recording is proposed; and what does instead, where that is known."""
    zero = ". Read the instrument by itself: a gauge while the muscle is vented, a load cell while nothing hangs on it"
    shown = "nothing that a force test on this rig, or a changed one, would show"
    return f"{shown}{zero}, and you know {marked(plan.instruments, ' and ')}" if plan.instruments else shown


def _tie(plan: Plan, one: Sets, other: Sets) -> str:
    often = _in_how_many(plan.steps, one, other)
    return f"{effect_set(one)} or {effect_set(other)}{often or ': nothing here separates them'}"


def duration(seconds: float) -> str:
    """A time for people."""
    return f"{seconds / 60:.0f} min" if seconds >= 100 else showing.show(max(seconds, 1.0), "s", digits=2)


def _pairs(plan: Plan) -> list[RenderableType]:
    table = columns("separated", "from", "by recording", "power", words=range(4))
    for number, step in enumerate(plan.steps):
        for p in step.pairs:
            other = effect_set(p.other) if p.other else "its absence"
            table.add_row(effect_set(p.one), other, str(number + 1), percent(p.power))
    return [line("", ""), table]


# --------------------------------------------------------------------------------------------------------- for machines


def plan_result(plan: Plan, model: str) -> dict[str, Any]:
    """`plan`: the protocol in SI units, with the commands that rehearse it on a model file."""
    d = plan.diagnosis
    return {
        "verdict": d.verdict,
        "explanations": [list(names) for names in d.explanations],
        "likes": [list(names) for names in plan.rivals] if plan.of_likes else [],
        "purpose": _purpose(plan),
        "protocol": [
            {"order": order, "rest_s": ADVICE.rest * (order > 1), **(measurement_result(step) or {}), "simulate": run}
            for order, (step, run) in enumerate(zip(plan.steps, _rehearsals(plan, model), strict=True), start=1)
        ],
        "tied": [[list(a), list(b)] for a, b in plan.tied],
        "expected_verdict": _expected(plan),
        "next_measurement": measurement_result(plan.steps[0]) if plan.steps else None,
    }
