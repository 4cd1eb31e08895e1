"""What to type next, the same on the terminal and on the page."""

import shlex
from collections.abc import Iterable, Sequence
from typing import NamedTuple

from fitting import full_names
from fitting.comparison.compare import Comparison
from fitting.diagnosis.outcomes import NOTHING_MISSING, Verdict
from fitting.diagnosis.record import Diagnosis
from fitting.report.text.comparison import fails
from fitting.report.text.stated_sizes import denied, stated_and_free
from fitting.report.text.warnings import unlikely_ratio
from fitting.study.preview import suggested

ADD = "Put it into the model:"
HOLD = "Look again with the sizes of the muscle as they were measured:"


def after_comparison(c: Comparison, data: Sequence[str]) -> str | None:
    """The diagnosis, where the model fails.

    Nothing where a unit or a size is likelier to be wrong than the physics: that comes first.
    """
    if not fails(c) or unlikely_ratio(c) is not None:
        return None
    return f"mckibben diagnose {shell_words(data)}"


def after_change(data: Sequence[str], model: str | None) -> str:
    """Whether anything is still missing; of a `model` that was saved elsewhere than with the data, by its file."""
    return f"mckibben diagnose {shell_words(data)}" + (f" --model {shell_words([model])}" if model else "")


class NextStep(NamedTuple):
    """What to do next in a sentence, and the command for it."""

    heading: str
    command: str


def after_diagnosis(d: Diagnosis, data: Sequence[str], proposed: bool = False) -> NextStep | None:
    """The effect to add, a form for what none explains (unless one was `proposed` already), what to record where the
    data say too little, and the values of a model that lacks nothing.

    Sizes that deny what was measured may stand in for what is missing: without an effect to add, they are held first,
    unless nothing is missing.
    """
    names = suggested(d)
    if names:
        return NextStep(ADD, f"mckibben add {shell_words(data)} {' '.join(names)}")
    if denied(d.baseline) and d.verdict not in NOTHING_MISSING:
        held = " ".join(dict.fromkeys(map(full_names.common, stated_and_free(d.baseline))))
        return NextStep(HOLD, f"mckibben diagnose {shell_words(data)} --fix {held}")
    if d.verdict == Verdict.NOT_IN_LIBRARY:
        return (
            None if proposed else NextStep("Look for a form of it:", f"mckibben diagnose {shell_words(data)} --propose")
        )
    return after_discovery(d, data)


def after_discovery(d: Diagnosis, data: Sequence[str]) -> NextStep:
    """What to record where effects are left that no step could add, and the values of a model that lacks nothing."""
    if d.verdict in NOTHING_MISSING:
        return NextStep("Learn how well its values are known:", f"mckibben posterior {shell_words(data)} --quick")
    return NextStep("Ask what to record:", f"mckibben plan {shell_words(data)}")


def shell_words(names: Iterable[str]) -> str:
    """Names of files and folders as a shell takes them, whatever is in them."""
    return " ".join(map(shlex.quote, names))
