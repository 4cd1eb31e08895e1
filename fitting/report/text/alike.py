"""What can be known of a muscle from these data, in words and for machines."""

from typing import Any

import numpy as np
from rich.console import RenderableType

from fitting.diagnosis.similarity import Knowable
from fitting.least_squares.record import Fit
from fitting.report.settings import ADVICE, SHOWN
from fitting.report.text.layout import line, lines
from fitting.report.text.names import listed, marked


def combinations(fit: Fit) -> tuple[int, tuple[tuple[str, ...], ...]]:
    """How many combinations of the fitted numbers the data alone determine, and what the others are made of.

    Counted in shares of the numbers' ranges; what was known before (`+/-` in muscle.toml) is left out.
    """
    if not fit.free:
        return 0, ()
    entries = [fit.layout.entry(name) for name in fit.free]
    span = np.array([entry.upper - entry.lower for entry in entries])
    slopes = fit.slopes[: len(fit.samples)] * span
    strength, ways = np.linalg.eigh(slopes.T @ slopes)  # inverse squares of errors, along orthogonal combinations
    open_ = [way for value, way in zip(strength, ways.T, strict=True) if value * ADVICE.known**2 < 1]
    named = (tuple(fit.free[i] for i in np.argsort(-np.abs(way)) if abs(way[i]) > ADVICE.weighty) for way in open_)
    return len(span) - len(open_), tuple(named)


def known_report(fit: Fit) -> list[RenderableType]:
    """How much of what is fitted these data determine."""
    count, rest = combinations(fit)
    if not fit.free or not rest:
        return []
    words = "; ".join(marked(names[: SHOWN.combinations], " with ") for names in rest)
    said = f"{count} of {len(fit.free)} combinations of fitted parameters are determined by these data; not: {words}"
    return [line("KNOWN", said)]


def alike_report(k: Knowable) -> list[RenderableType]:
    """Which effects look alike or are absorbed, and what would open them."""
    found = k.similarity
    shown = lines("SIMILAR", map(listed, found.classes))
    if not found.classes:
        shown = [line("SIMILAR", "none: every effect with a trace in these data can be told from the others")]
    if found.absorbed:
        shown.append(line("ABSORBED", f"{listed(found.absorbed)}: the fitted parameters absorb them"))
    if k.unseen:
        shown.append(line("NO TRACE", listed(k.unseen)))
    opened = (
        f"{marked(o.pair, ' or ')}: {o.what}" + (f" (cosine {o.cosine:.2f} then)" if o.cosine else "")
        for o in k.openings
    )
    return [*shown, *lines("OPENS", opened)]


def alike_result(k: Knowable) -> dict[str, Any]:
    """The same for machines."""
    found = k.similarity
    pairs = [
        {"effects": [one, other], "raw": found.cosine(one, other), "freed": found.cosine(one, other, freed=True)}
        for i, one in enumerate(found.names)
        for other in found.names[i + 1 :]
        if other not in found.absorbed and one not in found.absorbed
    ]
    return {
        "classes": [list(members) for members in found.classes],
        "absorbed": list(found.absorbed),
        "unseen": list(k.unseen),
        "left": dict(zip(found.names, found.left.tolist(), strict=True)),
        "pairs": pairs,
        "openings": [{"effects": list(o.pair), "measurement": o.what, "cosine": o.cosine} for o in k.openings],
    }


def known_result(fit: Fit) -> dict[str, Any]:
    """How many combinations the data determine, for machines."""
    count, rest = combinations(fit)
    return {"fitted": len(fit.free), "determined": count, "undetermined": [list(names) for names in rest]}
