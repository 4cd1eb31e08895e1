"""The top of the page: the verdict, the sentences and the numbers below it, and the command to type next."""

from collections.abc import Sequence

from fitting.comparison.compare import Comparison
from fitting.diagnosis.record import Diagnosis
from fitting.report.settings import ERROR_TEXT
from fitting.report.text.amounts import amount, percent
from fitting.report.text.comparison import judgement
from fitting.report.text.diagnosis import effect_set, leading_text, verdict_text
from fitting.report.text.instrument_answers import explaining_text, odd_run_texts, rival_texts
from fitting.report.text.next_step import after_comparison, after_diagnosis
from fitting.report.text.practice import practice_text
from fitting.report.text.stages import added_text
from fitting.study.practice import practice
from fitting.study.stages import Stage
from fitting.study.task import Task


def verdict(c: Comparison, d: Diagnosis | None, task: Task, stages: Sequence[Stage]) -> str:
    """The headline: the verdict of a diagnosis, or what the error is."""
    return judgement(c) if d is None else _verdict(d, task, stages)


def _verdict(d: Diagnosis, task: Task, stages: Sequence[Stage]) -> str:
    """The verdict; what was missing may be in the model by now."""
    if d.verdict == "missing" and _is_added(d, task):
        names = d.explanations[0]
        return f"{effect_set(names)} {'was' if len(names) == 1 else 'were'} missing, and is in the model now."
    said = verdict_text(d)
    added = " and ".join(added_text(stage) for stage in stages[1:] if stage.added)
    if not added:
        return said
    before = "With" if stages[-1].verdict else "Before"  # a verdict on the last model, or on one before it
    return f"{before} {added} added: {said[:1].lower()}{said[1:]}"


def _is_added(d: Diagnosis, task: Task) -> bool:
    return any({*names} <= {*task.names} for names in d.explanations)


def next_command(c: Comparison, d: Diagnosis | None, task: Task) -> tuple[str, str] | None:
    """What to do next, and the command for it."""
    folders = [str(e.folder) for e in task.experiments]
    if d is None:
        command = after_comparison(c, task.experiments, folders)
        return ("Which effect is missing?", command) if command else None
    return None if _is_added(d, task) else after_diagnosis(d, folders)


def lead(c: Comparison, d: Diagnosis | None, stages: Sequence[Stage], enough: float) -> list[str]:
    """The sentences below the verdict."""
    said = (
        []
        if d is None
        else [
            text
            for text in (leading_text(d), *odd_run_texts(d), explaining_text(d), *rival_texts(d), judgement(c))
            if text
        ]
    )
    if len(stages) > 1:
        first, last = stages[0].rmse, stages[-1].rmse
        said.insert(0, practice_text(practice(stages, c, enough)))
        said.append(f"The error fell from {amount(first, c.unit)} to {amount(last, c.unit)}.")
    return said


def cards(c: Comparison, d: Diagnosis | None) -> list[tuple[str, str]]:
    """The numbers on top, each with what it is."""
    shown = [
        (amount(c.rmse, c.unit), "error, root mean square"),
        (percent(c.share), f"of full scale, {amount(c.full_scale, c.unit)}"),
        (amount(c.floor, c.unit), "noise, " + ("one reading" if c.noise_floor is None else "repeated loops")),
    ]
    if c.fingerprint.odd_share is not None and c.rmse > ERROR_TEXT.near_floor * c.floor:
        shown.append((percent(c.fingerprint.odd_share), "of the misfit is odd: changes sign with the direction"))
    return shown if d is None else [*shown, (f"{d.p_value:.2g}", "p in the test that nothing is missing")]
