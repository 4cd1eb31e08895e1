"""Larger models that a discovery tried and did not keep, in sentences and for machines."""

from collections.abc import Sequence
from typing import Any

from fitting import full_names
from fitting.diagnosis.findings import Attempt, Fault, Objection
from fitting.report.settings import SHOWN
from fitting.report.text.amounts import amount
from fitting.report.text.names import mark, marked


def attempts_text(attempts: Sequence[Attempt], unit: str) -> list[str]:
    """One sentence for each of the first attempts, and how many more there are."""
    words = [attempt_text(attempt, unit) for attempt in attempts[: SHOWN.attempts]]
    more = len(attempts) - SHOWN.attempts
    return [*words, f"{more} more were tried and not kept."] if more > 0 else words


def held_text(names: Sequence[str]) -> list[str]:
    """Which stated sizes are confined since a step, and how a later command keeps them."""
    if not names:
        return []
    sizes = tuple(dict.fromkeys(map(full_names.common, names)))
    of = " of every data set" if len(sizes) < len(names) else ""
    return [
        f"A free fit would deny what was measured. From here on {marked(sizes)}{of} stay within two standard errors "
        "of what was stated. Where one of them ends at that limit, later commands with the model that is saved keep to "
        "it, and say under SIZES how to let the sizes go."
    ]


def freed_text(freed: bool) -> list[str]:
    """That no stated size is confined any more, which an earlier step has said."""
    return ["Without what was dropped no fit denies a stated size: all are free again."] if freed else []


def strained_text(strained: bool) -> list[str]:
    """Why effects are still tried where instruments explain the misfit."""
    if not strained:
        return []
    return [
        "For this an instrument would have to err by more than three times its accuracy: therefore effects are still "
        "tried."
    ]


def attempt_text(attempt: Attempt, unit: str) -> str:
    """What was tried, how far it would have brought the error, and why it was not kept."""
    errors = f"{amount(attempt.rmse, unit)}, on held-out runs {amount(attempt.held_out_rmse, unit)}"
    errors += ", with the sizes of the muscle kept to what was measured" * attempt.confined
    return f"{marked(attempt.effects, ' + ')} was tried ({errors}) and is not kept: {why_not_kept(attempt)}."


def why_not_kept(attempt: Attempt) -> str:
    """All reasons against a larger model."""
    return "; ".join(objection_text(each) for each in attempt.why)


def objection_text(objection: Objection) -> str:
    """One reason against a step."""
    about, size = mark(objection.about) if objection.about else "", objection.size
    if objection.reason == Fault.DENIES and size is not None:
        return f"{about} would lie {abs(size):.1f} standard errors from its stated value"
    if about:
        return f"{about} {objection.reason.value}"
    return f"it {objection.reason.value}"


def attempts_result(attempts: Sequence[Attempt]) -> list[dict[str, Any]]:
    """The same for machines."""
    return [
        {
            "effects": list(attempt.effects),
            "rmse_N": attempt.rmse,
            "held_out_rmse_N": attempt.held_out_rmse,
            "confined": attempt.confined,
            "why": [{"reason": w.reason.value, "parameter": w.about or None, "size": w.size} for w in attempt.why],
        }
        for attempt in attempts
    ]
