"""Scores of the group `kinds`: recordings that are not loops at constant speeds, one kind beside the other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from .scores import KIND, Record, Score, answered, astray, holds, of, right, said, sets, share, truth, unique, wrong

ALL = "all of them"


def kind_scores(records: Sequence[Record]) -> dict[str, list[Score]]:
    """The same measures for all recordings of other kinds, and for each kind; nothing where there are none."""
    mine = of(records, "kinds")
    kinds = dict.fromkeys(record["protocol"] for record in mine)
    table = {ALL: mine} | {kind: [r for r in mine if r["protocol"] == kind] for kind in kinds}
    return {kind: measures(these) for kind, these in table.items()} if mine else {}


def measures(records: Sequence[Record]) -> list[Score]:
    """Of one kind: clean recordings, one effect of the library, one of nobody's, and what has no verdict."""
    told = answered(records)
    clean = [r for r in told if not r["hidden"]]
    outside = [r for r in told if is_outside(r)]
    single = [r for r in told if r["hidden"] and not is_outside(r)]
    return [
        share("false alarm on clean data", "<= 6 %", clean, said, most=0.06),
        share("clean data called inconclusive", "", clean, unsure),
        share("one effect: named uniquely", "", single, right),
        share("one effect: in the set", "", single, holds),
        share("one effect: another named uniquely", "<= 1 %", single, wrong, most=0.01),
        share("the same, less what follows the truth within 0.1 noise", "", single, astray),
        share("one effect: named, but only with others that are not there", "", single, crowded),
        share("one effect: called not in the library", "", single, strange),
        share('one effect: called "nothing" or inconclusive', "", single, lambda r: not said(r)),
        share("outside the library: said so", ">= 90 %", outside, strange, least=0.9),
        share("outside the library: one of ours named uniquely", "<= 3 %", outside, unique, most=0.03),
        share("crashed or took too long", "0", records, lambda r: "error" in r, most=0.0),
        share("no sensible size would show (not diagnosed)", "", [r for r in records if r["hidden"]], unseen),
    ]


def named_kinds(table: dict[str, list[Score]]) -> list[Score]:
    """One list of all scores, each with its kind."""
    return [replace(score, measure=f"{kind}: {score.measure}") for kind, scores in table.items() for score in scores]


def is_outside(record: Record) -> bool:
    """Whether what is hidden is in nobody's library."""
    return any(name in KIND for name in record["hidden"])


def crowded(record: Record) -> bool:
    """Whether every explanation named holds the truth and something else."""
    return bool(sets(record)) and all(set(truth(record)) < set(names) for names in sets(record))


def unsure(record: Record) -> bool:
    """Whether the program could not decide."""
    return record["verdict"] == "inconclusive"


def strange(record: Record) -> bool:
    """Whether the program finds something that it has no name for."""
    return record["verdict"] == "not in the library"


def unseen(record: Record) -> bool:
    """Whether no size of what was to be hidden shows in such a recording."""
    return record.get("visible") is False
