"""How far sets that stand are told apart by their likelihoods: how often the truth stays, and stays alone.

python -m tests.hidden.study.likelier tests/hidden/results/2026-11-26-likelier.jsonl
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import click
import numpy as np

from .first_test import table
from .run import records
from .scores import Record, alikes, answered, followed, holds
from .worth import one, outside, words

TIMES = (np.inf, 1000.0, 100.0, 20.0, 10.0, 1.0)  # likelier than what is named beside it; 1: the likeliest alone
HEADS = (
    "times likelier", "one effect: among what is named", "one effect: named exactly", "several: among what is named",
    "several: named exactly", "sets named where the truth is among them, mean",
)  # fmt: skip


def standing(search: Any) -> dict[str, float]:
    """Schwarz's criterion of every set that stands before likelihoods are compared."""
    from fitting.diagnosis.equivalent import best_predicting, unrivalled
    from fitting.diagnosis.likelihood import criteria

    rules = search.examiner.settings.verdict
    predicting = best_predicting(list(search.adequate), search.fits, search.examiner, rules)
    stand = unrivalled(predicting, search.fits, search.examiner, rules)
    found = criteria(stand, search.fits, search.examiner)
    return {"+".join(sorted(added)): float(value) for added, value in found.items()}


def outdone(search: Any) -> list[str]:
    """Sets that would stand, were they not far less likely than one with an effect more."""
    from fitting.diagnosis.outcomes import Reason, Why

    tested = search.adequacy_tests.items()
    return ["+".join(sorted(added)) for added, test in tested if test.why == Why(Reason.LESS_LIKELY)]


def named(record: Record, times: float) -> list[str]:
    """What would be named of the sets that stand, none beside one that is so many times likelier.

    A set that contains another one goes, as in a verdict; there the fits decide, here the names.
    """
    found = record["standing"]
    least = min(found.values(), default=0.0)
    kept = [names for names, value in found.items() if value - least <= 2 * np.log(times)]
    parts = [set(names.split("+")) for names in kept]
    return [names for names, mine in zip(kept, parts, strict=True) if not any(other < mine for other in parts)]


def row(told: Sequence[Record], times: float) -> tuple[str, ...]:
    """One row of the table."""
    single = [record for record in told if one(record) and not outside(record)]
    several = [record for record in told if len(record["hidden"]) > 1]

    def among(record: Record) -> bool:
        return any(names in alikes(record) for names in named(record, times))

    def alone(record: Record) -> bool:
        return among(record) and all(names in alikes(record) for names in named(record, times))

    sizes = [len(named(record, times)) for record in (*single, *several) if among(record)]
    size = f"{np.mean(sizes):.2f}" if sizes else ""
    called = "any" if np.isinf(times) else f"{times:g}"
    return called, words(single, among), words(single, alone), words(several, among), words(several, alone), size


def lost_and_won(told: Sequence[Record]) -> list[tuple[str, str]]:
    """What became of the recordings where sets stood, and one effect more made the readings far likelier."""
    less = [record for record in told if record.get("outdone")]

    def before(record: Record) -> bool:
        return any(names in alikes(record) for names in record["outdone"])

    rows = [
        ("the truth was among those that stood", before),
        ("it is among what is named instead", holds),
        ("the same, or what is named follows it within a tenth of the noise", lambda r: holds(r) or followed(r)),
        ("an effect of nobody's library, recognised", lambda r: outside(r) and r["verdict"] == "not in the library"),
    ]
    return [("recordings", f"{len(less)} of {len(told)}"), *((what, words(less, is_so)) for what, is_so in rows)]


@click.command()
@click.argument("path", type=click.Path(exists=True, dir_okay=False, path_type=Path))
def main(path: Path) -> None:
    """Print the table of the records at PATH."""
    told = [record for record in answered(records(path)) if "standing" in record]
    click.echo(table(HEADS, [row(told, times) for times in TIMES]))
    click.echo(table(("sets that stood, outdone by one effect more", "recordings"), lost_and_won(told)))


if __name__ == "__main__":
    main()
