"""Our answers and those of rivals to the same recordings, where all instruments err.

python -m tests.hidden.study.rival_table tests/hidden/results/2026-11-26-rivals.jsonl
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import click

from .first_test import table
from .rivals import NAMES
from .run import records
from .scores import Record, alikes, answered, program_answer, truth
from .worth import mix, one, outside, words

Answer = Callable[[Record], list[list[str]]]


def answers_of(told: Sequence[Record]) -> dict[str, Answer]:
    """The methods by what the table calls them."""
    rivals = told[0]["rivals"] if told else ()
    return {"this program": program_answer} | {
        NAMES[name]: lambda record, name=name: [sorted(record["rivals"][name])] for name in rivals
    }


def compared(told: Sequence[Record], answer: Answer) -> tuple[str, ...]:
    """How often something is said to be missing of what lacks nothing; and of what hides one of ours, several, others.

    Of one effect or several also how often exactly these are named (or exact likes of one); this program may name
    several explanations, the others one.
    """
    clean = [record for record in told if not record["hidden"]]
    single = [record for record in told if one(record) and not outside(record)]
    several = [record for record in told if len(record["hidden"]) > 1]
    strange = [record for record in told if outside(record)]

    def says(record: Record) -> bool:
        return answer(record) != [[]]

    def names_one(record: Record) -> bool:
        return any(any(names) for names in answer(record))

    def exact(record: Record) -> bool:
        named = answer(record)
        return bool(named) and all("+".join(names) in alikes(record) for names in named) and bool(truth(record))

    def held(record: Record) -> bool:
        return any("+".join(names) in alikes(record) for names in answer(record)) and bool(truth(record))

    return (
        words(clean, says), words(single, says), words(single, held), words(single, exact), words(several, exact),
        words(strange, names_one),
    )  # fmt: skip


HEADS = (
    "method", "clean: something said to be missing", "one effect: something said to be missing",
    "one effect: it is among what is named", "one effect: named exactly",
    "several: named exactly", "of nobody's library: one of the library named",
)  # fmt: skip


@click.command()
@click.argument("path", type=click.Path(exists=True, dir_okay=False, path_type=Path))
def main(path: Path) -> None:
    """Print how the methods answer the records at PATH that all of them have answered."""
    told = [record for record in answered(records(path)) if "rivals" in record]
    click.echo(f"Of {len(told)} recordings: {mix(told)}.\n")
    click.echo(table(HEADS, [(name, *compared(told, answer)) for name, answer in answers_of(told).items()]))


if __name__ == "__main__":
    main()
