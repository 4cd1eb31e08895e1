"""What a verdict is worth: of all recordings of which it is said, how many bear it out, in a stated mix of cases.

    python -m tests.hidden.study.worth tests/hidden/results/2026-11-26-laboratory.jsonl

An answer depends on what a laboratory meets: where nothing is ever missing, every "missing" is wrong. The mix of cases
therefore stands above the table.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import click

from .first_test import table
from .rig_scores import WITHIN
from .run import records
from .scores import KIND, Record, answered, followed, holds, right, sets, share, unique

NOTHING = ("nothing detectable", WITHIN)


def mix(told: Sequence[Record]) -> str:
    """What was hidden in how many recordings, in words."""
    kinds = {
        "with nothing hidden": lambda r: not r["hidden"],
        "with one effect at its printed limit": lambda r: one(r) and r["unit"] == "limit" and r["size"] == 1.0,
        "with one effect of three times its limit": lambda r: one(r) and r["unit"] == "limit" and r["size"] == 3.0,
        "with two or three effects of three times theirs": lambda r: len(r["hidden"]) > 1,
        "with an effect of nobody's library": outside,
    }
    counts = {words: sum(map(which, told)) for words, which in kinds.items()}
    others = len(told) - sum(counts.values())
    counts |= {"of other kinds": others} if others else {}
    return ", ".join(f"{count} {words}" for words, count in counts.items() if count)


def one(record: Record) -> bool:
    """Whether a single effect is hidden."""
    return len(record["hidden"]) == 1


def worth(told: Sequence[Record]) -> list[tuple[str, str, str]]:
    """What is said, what would bear it out, and in how many recordings that is so."""
    tied = [r for r in told if r["verdict"] == "one of" and not unique(r)]
    few, many = ([r for r in tied if (len(sets(r)) > 3) is beyond] for beyond in (False, True))
    strange = [r for r in told if r["verdict"] == "not in the library"]
    quiet = [r for r in told if r["verdict"] in NOTHING]
    rows = [
        ('"missing", or one class of exact likes', "it is all that is hidden", list(filter(unique, told)), right),
        ("the same", "it is, or follows the truth within a tenth of the noise", list(filter(unique, told)), near),
        ('"one of" two or three', "the truth is among them", few, holds),
        ('"one of" more', "the truth is among them", many, holds),
        ('"not in the library"', "it is an effect of nobody's library", strange, outside),
        ('"nothing detectable" or "within the instruments"', "nothing is hidden", quiet, lambda r: not r["hidden"]),
        ("the same", "nothing beyond its printed limit is hidden", quiet, within_limits),
    ]
    return [(said, meant, words(mine, true)) for said, meant, mine, true in rows]


def near(record: Record) -> bool:
    """Whether what is named is the truth, or follows it so closely that no such data tell them apart."""
    return right(record) or followed(record)


def outside(record: Record) -> bool:
    """Whether what is hidden is an effect that the library does not have."""
    return any(name in KIND for name in record["hidden"])


def within_limits(record: Record) -> bool:
    """Whether nothing is hidden but a single effect at its printed detection limit."""
    return not record["hidden"] or (one(record) and record["unit"] == "limit" and record["size"] <= 1.0)


def words(mine: Sequence[Record], true: Callable[[Record], bool]) -> str:
    """How many of how many, and the share with its 95 % interval."""
    return f"{sum(map(true, mine))} of {len(mine)}: {share('', '', mine, true).words}" if mine else "never said"


@click.command()
@click.argument("path", type=click.Path(exists=True, dir_okay=False, path_type=Path))
def main(path: Path) -> None:
    """Print how often each verdict in the records at PATH is borne out."""
    told = answered({record["id"]: record for record in records(path)}.values())
    click.echo(f"Of {len(told)} recordings: {mix(told)}.\n")
    click.echo(table(("what is said", "what would bear it out", "how often it is so"), worth(told)))


if __name__ == "__main__":
    main()
