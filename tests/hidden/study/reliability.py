"""Does the truth stand in the set of explanations as often as the set says? Stated chances against observed ones.

A diagnosis names every set of effects that its test does not reject at a level; the truth is among them in all but that
share of recordings, if the test is right. Here the model that made a recording is fitted and tested, and how often it
stands is counted for many levels: by protocol and by kind of instruments, each recording with noise of its own.

    python -m tests.hidden.study.reliability --count 50
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import product
from pathlib import Path
from typing import Any

import click

from .cases import Case
from .erring import MEASURED, NO_OTHER, case_of, one_of_each_family
from .first_test import groups, searched, table
from .judge import hidden_of
from .run import worked
from .scores import Record, share
from .sizes import base_of

KINDS = ("exact", "gauge noise", "laboratory")  # of instruments
SIZE = 3.0  # of the misfit that a hidden effect leaves, in standard deviations of a reading: plainly there
STATED = (0.5, 0.7, 0.8, 0.9, 0.95, 0.98, 0.99)  # chances that the truth stands
ROUNDING = 1e-9


def plan(count: int, seed: int) -> Iterator[Case]:
    """So many recordings of each protocol and kind: nothing hidden in one of six, else one effect after the other.

    Each has a number of its own, for cases of one number have the same noise.
    """
    names = one_of_each_family()
    for at, (protocol, rig) in enumerate(product(MEASURED, KINDS)):
        if rig in NO_OTHER[protocol]:
            continue
        for number in range(count):
            hidden = () if number % 6 == 0 else (names[(number + 7 * at) % len(names)],)
            yield case_of(hidden, SIZE if hidden else 0.0, "sigma", protocol, 1000 * (at + 1) + number, seed, rig)


def answer(case: Case, limits: dict[str, float], rivals: bool) -> dict[str, Any]:
    """The p-value of the model that made the recording; none where these data could not show what is hidden."""
    from fitting.diagnosis.diagnose import one_thread

    hidden, _ = hidden_of(case, limits)
    record = {"id": case.id, **vars(case), "parameters": hidden}
    if hidden is None:
        return record
    search = searched(case, hidden, [*base_of(hidden), *hidden])
    with one_thread():
        found = search.examiner.adequacy(frozenset(), search.base, {})
    return record | {"p": found.test.p, "level": found.test.level, "rejected": found.rejected}


def curves(done: Sequence[Record]) -> list[tuple[str, ...]]:
    """For all records, each protocol, each kind, and both: at each stated chance the share of truths that stand."""
    parts = [("all", list(done)), *groups(done, lambda r: r["protocol"]), *groups(done, lambda r: r["instruments"])]
    both = groups(done, lambda r: f"{r['protocol']}, {r['instruments']}")
    return [(name, str(len(of)), *(observed(of, chance) for chance in STATED)) for name, of in (*parts, *both)]


def observed(records: Sequence[Record], chance: float) -> str:
    """The share of truths that stand at a stated chance; "too few" where its 95 % interval lies below that chance."""
    found = share("", "", records, lambda record: record["p"] >= 1 - chance - ROUNDING)
    return f"{found.value:.0%}" + (", too few" if found.high < chance else "")


def page(found: Sequence[Record], command: str, about: str) -> str:
    """What the records add up to, in Markdown."""
    done, failed = [r for r in found if "p" in r], [r for r in found if "error" in r]
    unseen = len(found) - len(done) - len(failed)
    heads = ("", "recordings", *(f"{chance:.0%}" for chance in STATED))
    parts = [
        "# Does the truth stand in the set of explanations as often as the set says?",
        about,
        f"`{command}`",
        f"{len(done)} recordings, in {sum(bool(r['hidden']) for r in done)} of which one effect is hidden. In {unseen} "
        f"others the effect could not be shown by such data; {len(failed)} ended in an error.",
        "Share of recordings of which the model that made them stands, at each stated chance. A share is too few where "
        "its 95 % interval lies below what is stated. A diagnosis states 99 %; 99.5 % where there are few loops.",
        table(heads, curves(done)),
    ]
    return "\n\n".join(part for part in parts if part) + "\n"


@click.command()
@click.option("--count", default=50, show_default=True, help="Recordings of each protocol and kind of instruments.")
@click.option("--workers", default=2, show_default=True, help="Processes.")
@click.option("--seed", default=1, show_default=True, help="Of the plan.")
@click.option("--out", default="reliability.jsonl", show_default=True, help="Records; a stopped study goes on.")
@click.option("--about", default="", help="A line for the page: date, version, machine.")
def main(count: int, workers: int, seed: int, out: str, about: str) -> None:
    """Count how often the truth stands in the set, for many levels."""
    found = worked(tuple(plan(count, seed)), Path(out), workers, 900.0, 0.0, False, answer)
    command = f"python -m tests.hidden.study.reliability --count {count} --seed {seed}"
    Path(out).with_suffix(".md").write_text(page(found, command, about), encoding="utf-8")
    click.echo(f"{len(found)} cases; {Path(out).with_suffix('.md')}")


if __name__ == "__main__":
    main()
