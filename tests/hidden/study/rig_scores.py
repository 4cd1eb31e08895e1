"""Scores of the group `instruments`: what verdicts are worth where gauges, load cells and rulers err."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from .cases import ERRING, LIMITS
from .erring import TOGETHER
from .kinds import is_outside, strange, unsure
from .scores import (
    Record,
    Score,
    answered,
    astray,
    extra,
    followed,
    holds,
    number,
    of,
    right,
    said,
    share,
    unique,
    wrong,
)

WITHIN = "within the instruments"
ANSWERS = ("nothing detectable", WITHIN)
STATEMENTS = {"all": (True, False), "stated": (True,), "presumed": (False,)}
GROUPS = ("none", "single", "pair", "triple")  # by the number of effects hidden
Table = dict[str, list[Score]]


def rig_scores(records: Sequence[Record]) -> Table:
    """The same measures for all cases, for those with data sheets stated and for those without; nothing without any."""
    mine = of(records, ERRING)
    table = {words: [r for r in mine if r["stated"] in stated] for words, stated in STATEMENTS.items()}
    return {words: measures(these) for words, these in table.items()} if mine else {}


def measures(records: Sequence[Record]) -> list[Score]:
    """The goals under instruments at their accuracy, all together, and what each kind alone does."""
    told = answered(records)
    clean, together = [r for r in told if not r["hidden"]], [r for r in told if r["instruments"] == TOGETHER]
    rich = [r for r in together if not r["hidden"] and r["protocol"] == "rich"]
    outside = [r for r in together if is_outside(r)]
    inside = [r for r in together if r["hidden"] and not is_outside(r)]
    single, pairs, triples = ([r for r in inside if at_limits(r, LIMITS, count)] for count in (1, 2, 3))
    power = [r for r in inside if at_limits(r, 1.0, 1)]
    alone = [r for r in told if r["hidden"] and r["instruments"] != TOGETHER]
    return [
        number("clean, worst kind: share said to lack something", "<= 0.02", alarms(clean), np.max, most=0.02),
        share("clean, all together: said to lack something", "<= 2 %", clean_of(clean, TOGETHER), said, most=0.02),
        share("clean, all together, rich: nothing detectable or within the instruments", ">= 80 %", rich,
              answers, least=0.8),
        share("clean, all together: within the instruments", "", clean_of(clean, TOGETHER), within),
        share("clean, all together: inconclusive", "", clean_of(clean, TOGETHER), unsure),
        share("one effect at 3 x its limit: named uniquely or as its class", ">= 95 %", single, right, least=0.95),
        share("one effect at 3 x its limit: in the set", ">= 99 %", single, holds, least=0.99),
        share("one effect: another named alone", "", single, wrong),
        share("the same, less what follows the truth within 0.1 noise", "<= 1 %", single, astray, most=0.01),
        share("one effect: called not in the library", "", single, strange),
        share("one effect: called within the instruments", "", single, within),
        share("power at the printed detection limit", "80 +- 5 %", power, said, least=0.75, most=0.85),
        share("two at once: exact", ">= 85 %", pairs, right, least=0.85),
        share("three at once: exact", ">= 65 %", triples, right, least=0.65),
        share("two or three at once: false extras, less what follows the truth", "", [*pairs, *triples],
              lambda r: extra(r) and not followed(r)),
        share("outside the library: said so", ">= 90 %", outside, strange, least=0.9),
        share("outside the library: one of ours named alone", "", outside, unique),
        share("one kind alone, one effect: named uniquely or as its class", "", alone, right),
        share("one kind alone, one effect: in the set", "", alone, holds),
        share("one kind alone, one effect: another named alone, less what follows", "", alone, astray),
        share("crashed or took too long", "0", records, lambda r: "error" in r, most=0.0),
        share("no sensible size would show (not diagnosed)", "", [r for r in records if r["hidden"]],
              lambda r: r.get("visible") is False),
    ]  # fmt: skip


def alarm_table(records: Sequence[Record]) -> Table:
    """False alarms on clean recordings: a column for each protocol, a row for each kind of instrument."""
    clean = [r for r in answered(of(records, ERRING)) if not r["hidden"]]
    kinds, protocols = (list(dict.fromkeys(r[key] for r in clean)) for key in ("instruments", "protocol"))

    def column(mine: Sequence[Record]) -> list[Score]:
        return [share(kind, "<= 2 %", clean_of(mine, kind), said, most=0.02) for kind in kinds]

    table = {"all protocols": column(clean)}
    return table | {p: column([r for r in clean if r["protocol"] == p]) for p in protocols} if clean else {}


def usual(records: Sequence[Record]) -> list[Record]:
    """The cases with all errors together, under the group that each would have with exact instruments."""
    mine = [r for r in answered(of(records, ERRING)) if r["instruments"] == TOGETHER and not at_limits(r, 1.0, 1)]
    return [{**r, "group": "outside" if is_outside(r) else GROUPS[len(r["hidden"])]} for r in mine]


def named_rigs(title: str, table: Table) -> list[Score]:
    """One list of all scores of a table, each with the table's name and its column."""
    return [replace(one, measure=f"{title}, {key}: {one.measure}") for key, column in table.items() for one in column]


def alarms(clean: Sequence[Record]) -> list[float]:
    """The share of false alarms of each kind of instrument."""
    kinds = dict.fromkeys(r["instruments"] for r in clean)
    return [float(np.mean([said(r) for r in clean_of(clean, kind)])) for kind in kinds]


def clean_of(clean: Sequence[Record], kind: str) -> list[Record]:
    """Clean recordings of one kind of instrument."""
    return [r for r in clean if r["instruments"] == kind]


def at_limits(record: Record, size: float, count: int) -> bool:
    """Whether `count` effects are hidden, each of so many of its own limits."""
    return len(record["hidden"]) == count and record["size"] == size


def answers(record: Record) -> bool:
    """Whether a clean muscle got an answer."""
    return record["verdict"] in ANSWERS


def within(record: Record) -> bool:
    """Whether what is seen is what the instruments may err by."""
    return record["verdict"] == WITHIN
