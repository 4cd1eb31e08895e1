"""What to type next, the same on the terminal and on the page."""

import shlex
from collections.abc import Iterable, Sequence

from fitting.comparison.compare import Comparison
from fitting.diagnosis.record import Diagnosis
from fitting.recordings.records import Experiment
from fitting.report.text.comparison import fails
from fitting.report.text.diagnosis import MOST


def after_comparison(c: Comparison, experiments: Sequence[Experiment], data: Sequence[str]) -> str | None:
    """The diagnosis, where the model fails; it reads forces, and motions as force, but no position without inertia."""
    if not fails(c):
        return None
    if _positions_alone(experiments):
        return f"mckibben add {typed(data)} EFFECT, one that you suspect (mckibben effects): 'diagnose' needs a force"
    return f"mckibben diagnose {typed(data)}"


def after_change(experiments: Sequence[Experiment], data: Sequence[str], model: str | None) -> str | None:
    """Whether anything is still missing; of a `model` that was saved elsewhere than with the data, by its file."""
    if _positions_alone(experiments):
        return None
    return f"mckibben diagnose {typed(data)}" + (f" --model {typed([model])}" if model else "")


def _positions_alone(experiments: Sequence[Experiment]) -> bool:
    return all(recording.test == "isotonic" for each in experiments for recording in each.recordings)


def after_diagnosis(d: Diagnosis, data: Sequence[str], proposed: bool = False) -> str | None:
    """The effect to add, a form for what none explains (unless one was `proposed` already), what to record where the
    data say too little; else None.
    """
    if d.verdict in ("missing", "one of") and d.explanations:
        first = d.leading.effects if d.leading is not None else ()
        chosen = next((names for names in d.explanations if names == first[:1]), d.explanations[0])
        return f"mckibben add {typed(data)} {' '.join(chosen)}"
    if d.leading is not None and d.leading.share > MOST:
        return f"mckibben add {typed(data)} {d.leading.effects[0]}"
    if d.verdict == "not in the library":
        return None if proposed else f"mckibben diagnose {typed(data)} --propose"
    return f"mckibben plan {typed(data)}" if d.verdict == "inconclusive" else None


def typed(names: Iterable[str]) -> str:
    """Names of files and folders as a shell takes them, whatever is in them."""
    return " ".join(map(shlex.quote, names))
