"""Distance to the oracle: the program's printed detection limits over what an oracle detects in the same recordings.

Both are misfits in N that are left once the baseline has been refitted, with power 0.8: 1 is as good as can be, and
whoever does not know the family of the effect cannot be below 1.26. The oracle has the same accuracies as the program
(`tests.hidden.oracle`); what it finds is kept beside the records, so that a study that goes on does not ask again:
remove that file where protocols or instruments have changed since.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ..simulator import EVERY_NOISE, TYPICAL
from .erring import NOISE, RIGS, TOGETHER
from .run import append, place_of, records
from .scores import Record, Score, number

MEDIAN, WORST = 1.5, 2.5


class Distance(NamedTuple):
    """One effect in one protocol."""

    effect: str
    protocol: str
    instruments: str
    stated: bool
    program: float  # N, the printed detection limit
    oracle: float  # N

    @property
    def ratio(self) -> float:
        """Program over oracle."""
        return self.program / self.oracle


def distances(found: Sequence[Record], kept: Path) -> list[Distance]:
    """Of every clean recording from which detection limits are read, with exact instruments and with all errors."""
    known = {(*place_of(r)[1:3], r["effect"]): r["rms"] for r in records(kept)}
    out = []
    for record in pilots(found):
        for effect in (name for name in TYPICAL if record["limits"].get(name)):
            key = (record["protocol"], record["instruments"], effect)
            if key not in known:
                known[key] = asked(*key)
                append(kept, {"noise": NOISE, "protocol": key[0], "instruments": key[1], "effect": effect,
                              "rms": known[key]})  # fmt: skip
            if known[key]:
                out.append(Distance(effect, *key[:2], record["stated"], record["limits"][effect], known[key]))
    return out


def pilots(found: Sequence[Record]) -> Iterator[dict[str, Any]]:
    """Clean records with limits, one of each protocol, statement and of two kinds of instruments."""
    for place, record in {place_of(r): r for r in found if "limits" in r and r["number"] == 0}.items():
        noise, _, instruments, stated = place
        if noise == NOISE and instruments in ("exact", TOGETHER):
            yield {**record, "instruments": instruments, "stated": stated}


def asked(protocol: str, instruments: str, effect: str) -> float | None:
    """What the oracle detects, N; None where it sees nothing of a sensible size."""
    from ..oracle import oracle_size

    size = oracle_size(effect, protocol, EVERY_NOISE[NOISE], RIGS[instruments])
    return size.rms if size else None


def distance_scores(found: Iterable[Distance]) -> dict[str, list[Score]]:
    """A column for each protocol and kind of instruments: median, worst, and every effect."""
    columns: dict[str, list[Distance]] = {}
    for one in found:
        columns.setdefault(heading(one), []).append(one)
    effects = [name for name in TYPICAL if any(one.effect == name for these in columns.values() for one in these)]
    return {key: column(these, effects) for key, these in columns.items()}


def heading(one: Distance) -> str:
    """The column of a distance."""
    if one.instruments == "exact":
        return f"{one.protocol}, exact"
    return f"{one.protocol}, {one.instruments}, {'stated' if one.stated else 'presumed'}"


def column(these: Sequence[Distance], effects: Sequence[str]) -> list[Score]:
    """Program over oracle."""
    ratios = {one.effect: one.ratio for one in these}
    return [
        number("median", f"<= {MEDIAN:g}", list(ratios.values()), np.median, most=MEDIAN),
        number("worst", f"<= {WORST:g}", list(ratios.values()), np.max, most=WORST),
        *(number(name, "", [ratios[name]] if name in ratios else []) for name in effects),
    ]
