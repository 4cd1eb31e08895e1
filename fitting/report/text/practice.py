"""The verdict for practice, in a sentence and for machines."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from fitting.diagnosis.outcomes import NOTHING_MISSING, Verdict
from fitting.diagnosis.record import Diagnosis
from fitting.diagnosis.step_rules import RULES
from fitting.diagnosis.tiers import is_left
from fitting.report.text.amounts import percent
from fitting.report.text.names import marked
from fitting.report.text.next_step import shell_words
from fitting.study.practice import Practice


def practice_text(found: Practice) -> str:
    """What was added explains all but so much of full scale, whether that is little, and what the rest is."""
    rest = f" {_rest(found)}" if found.verdict else ""
    return f"{explained_text(found)}{_outside(found)}, which is {_size(found)}.{rest}"


def explained_text(found: Practice) -> str:
    """What was added explains all but so much of full scale; without a full stop."""
    who = marked(found.added, " + ") if found.added else "The model"
    verb = "explain" if len(found.added) > 1 else "explains"
    return f"{who} {verb} all but {percent(found.left)} of full scale"


def left_text(found: Practice) -> str:
    """Whether what is left is little: the sentence that follows `explained_text`."""
    return f"What is left is {_size(found)}{_outside(found)}."


def small_rest_texts(d: Diagnosis, enough: float, data: Sequence[str]) -> list[str]:
    """That what is missing was left as it is, for it is so small, and how to look into it; nothing where it was not."""
    governed = d.verdict in (Verdict.NOT_IN_LIBRARY, Verdict.MISSING, Verdict.ONE_OF) and d.beyond_noise > 0
    if not governed or not is_left(d, replace(RULES, enough=enough)):
        return []
    share = f"{50 * d.beyond_noise / d.full_scale:.1g} %"
    return [
        "What is missing is small. Single effects that would take a part of it were not added. This command adds them "
        f"as long as they pay: mckibben discover {shell_words(data)} --enough '{share}'"
    ]


def _outside(found: Practice) -> str:
    return "" if found.held_out is None else f" ({percent(found.held_out)} on held-out runs)"


def _size(found: Practice) -> str:
    return f"{'below' if found.is_enough else 'above'} {percent(found.enough)}"


def practice_result(found: Practice) -> dict[str, Any]:
    """The same for machines: shares of full scale."""
    return {
        "practice": {
            "left": found.left,
            "held_out_left": found.held_out,
            "enough": found.enough,
            "is_enough": found.is_enough,
        }
    }


def _rest(found: Practice) -> str:
    verdict = found.verdict
    if found.strained:
        return "What remains could come from the instruments only if one erred by more than three times its accuracy."
    if verdict == Verdict.NOT_IN_LIBRARY:
        return "No effect of the library explains all of what remains."
    if verdict == Verdict.WITHIN_INSTRUMENTS:
        return "What remains is within what the instruments may err by."
    if verdict in (Verdict.MISSING, Verdict.ONE_OF):
        return "The verdict says what that may be."
    return (
        "In what remains these data show nothing more."
        if verdict in NOTHING_MISSING
        else "What remains is not decided by these data."
    )
