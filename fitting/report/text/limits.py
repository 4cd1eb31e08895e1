"""What these data would have shown where nothing is missing, and what remains open."""

import math
from collections.abc import Sequence

from fitting import showing
from fitting.diagnosis.outcomes import NOTHING_MISSING, Reason, Verdict
from fitting.diagnosis.record import Diagnosis
from fitting.report.text.amounts import amount
from fitting.report.text.names import listed

STEPS = (1, 2, 5, 10)  # of a limit, within a power of ten: finer ones say no more to a reader
SEEN = "Each of these would have been seen, had it left at least this RMS error after the fit"


def would_have_shown(d: Diagnosis, unit: str = "N") -> list[tuple[str, list[str]]]:
    """In steps of 1, 2 and 5, the least first: the largest limit of a step, with the effects seen from there on."""
    if d.verdict not in NOTHING_MISSING:
        return []
    steps: dict[float, list[tuple[float, str]]] = {}
    for limit, name in _limits(d, [name for name in d.effects if name not in d.faint]):
        steps.setdefault(_rounded_up(limit, unit), []).append((limit, name))
    return [(amount(each[-1][0], unit, 2), [name for _, name in each]) for each in steps.values()]


def limits_lines(d: Diagnosis, unit: str = "N") -> list[str]:
    """The same as lines, with identifiers alone, for they are many; none where something is missing."""
    shown = [f"from {step}: {', '.join(names)}" for step, names in would_have_shown(d, unit)]
    return [f"{SEEN}:", *shown] if shown else []


def open_text(d: Diagnosis, unit: str = "N") -> str | None:
    """What could hide here at a size that matters; None where nothing could, or where something is missing."""
    undecided = d.verdict == Verdict.INCONCLUSIVE and d.why is not None and d.why.reason is Reason.FAINT
    faint = _limits(d, d.why.names if undecided and d.why else d.faint)
    if not faint or not (undecided or d.verdict in NOTHING_MISSING):
        return None
    alike: dict[str, list[str]] = {}
    for limit, name in faint:
        alike.setdefault(amount(limit, unit, 2), []).append(name)
    named = ", ".join(_below(names, limit) for limit, names in alike.items())
    # with exact instruments none of these could hide, or the verdict were inconclusive
    hidden = f"Errors of the instruments within their accuracy could hide {'them' if len(faint) > 1 else 'it'}."
    return f"{named}. {hidden}" if d.verdict == Verdict.NOTHING else f"{named}."


def _below(names: Sequence[str], limit: str) -> str:
    """Effects that are seen from the same size on: the size is said once, and identifiers alone where they are many."""
    each = "each " if len(names) > 1 else ""
    return f"{listed(names)} {each}below {limit}"


def _limits(d: Diagnosis, names: Sequence[str]) -> list[tuple[float, str]]:
    known = ((d.effects[name].detection_limit, name) for name in names)
    return sorted((limit, name) for limit, name in known if limit)


def _rounded_up(limit: float, unit: str) -> float:
    """To 1, 2 or 5 times a power of ten of the unit that people read."""
    _, size = showing.shown_in(unit, limit)
    power = 10.0 ** math.floor(math.log10(limit / size))
    return next(step for each in STEPS if (step := each * power * size) >= limit * (1 - 1e-9))
