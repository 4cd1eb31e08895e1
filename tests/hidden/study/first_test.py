"""The first question of a diagnosis alone, on many recordings: is anything missing? Errors of instruments, both ways.

A diagnosis costs a hundred times as much as this test, and names nothing unless it rejects. What rejects on a clean
recording is therefore diagnosed in full, and counts as a false alarm where the verdict says that something is missing.
One effect as large as its printed detection limit is to be found in 80 of 100 recordings.

    python -m tests.hidden.study.first_test --clean 25 --power 8
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import click

from ..simulator import EVERY_NOISE, write
from .cases import Case, is_pilot
from .erring import MEASURED, RIGS, TOGETHER, case_of, clean, powers
from .judge import hidden_of, verdict_of
from .protocols import PROTOCOLS
from .run import worked
from .scores import Record, said, share
from .sizes import base_of, hiding

if TYPE_CHECKING:
    from fitting.diagnosis.search import Search


def plan(numbers: int, repeats: int, seed: int) -> tuple[Case, ...]:
    """Clean recordings of every kind of instrument, `numbers` of each protocol, and effects at their printed limits."""
    nothing = [case for case in clean(seed) if case.number < numbers]
    pilots = [case_of((), 0.0, "sigma", protocol, 0, seed) for protocol in MEASURED if repeats and not numbers]
    hidden = [replace(case, number=number) for case in powers(seed) for number in range(repeats)]
    both = [replace(case, stated=stated) for case in (*nothing, *pilots, *hidden) for stated in (False, True)]
    return tuple(case for case in both if not (case.stated and case.instruments == "exact"))


def answer(case: Case, limits: dict[str, float], rivals: bool) -> dict[str, Any]:
    """The record of one case; no rivals are asked, whatever is wanted."""
    from fitting.diagnosis.diagnose import concluded, one_thread

    hidden, _ = hidden_of(case, limits)
    record = {"id": case.id, **vars(case), "parameters": hidden}
    if hidden is None:
        return record
    search = searched(case, hidden, base_of(hidden))
    with one_thread():
        found = search.examiner.adequacy(frozenset(), search.base, {}, limits=is_pilot(case))
    record |= {"p": found.test.p, "level": found.test.level, "rejected": found.rejected}
    if is_pilot(case):
        limits_found = {name: found.of(name).limit for name in search.world.candidates}
        record["limits"] = {name: limit for name, limit in limits_found.items() if limit is not None}
    if found.rejected and not hidden:
        record |= verdict_of(concluded(search.run()))
    return record


def searched(case: Case, hidden: dict[str, dict[str, float]], effects: Iterable[str]) -> Search:
    """The recording of a case read and a model of these effects fitted to it, ready to be asked what is missing."""
    from fitting.diagnosis.diagnose import prepared
    from fitting.recordings.experiment import read_experiment
    from mckibben_jax.effect import name_of
    from mckibben_jax.effects import LIBRARY

    known = {name_of(kind): kind for kind in LIBRARY}
    truth = hiding(base_of(hidden), hidden)
    data = PROTOCOLS[case.protocol].data(truth, EVERY_NOISE[case.noise], case.recording_seed(), RIGS[case.instruments])
    with TemporaryDirectory() as folder:
        experiment = read_experiment(write(data, Path(folder) / "data", say_accuracy=case.stated))
    return prepared([experiment], [known[name]() for name in effects])


def page(records: Sequence[Record], command: str, about: str) -> str:
    """What the records add up to, in Markdown."""
    failed = [record for record in records if "error" in record]
    done = [record for record in records if "rejected" in record]
    nothing, hidden = [r for r in done if not r["hidden"]], [r for r in done if r["hidden"]]
    parts = ["# Is anything missing? The first test of a diagnosis, under errors of instruments", about, f"`{command}`",
             f"{len(failed)} of {len(records)} cases ended in an error."]  # fmt: skip
    parts += [f"The first: {failed[0]['error']}"] if failed else []
    parts += ["## Clean recordings: share that the test rejects, and share of which the verdict says that something is "
              "missing (goal: 2 %)",
              table(("instruments", "rejected", "said to lack something", "recordings"),
                    [(kind, words(rejected, of), words(alarm, of), str(len(of)))
                     for kind, of in groups(nothing, kinds)]),
              "By protocol, all kinds:",
              table(("protocol", "rejected", "said to lack something", "recordings"),
                    [(kind, words(rejected, of), words(alarm, of), str(len(of)))
                     for kind, of in groups(nothing, lambda r: r["protocol"])])]  # fmt: skip
    parts += [f"## One effect at its printed detection limit, all errors together (`{TOGETHER}`; goal: 80 +- 5 %)",
              table(("effect", "found", "recordings"), [(kind, words(rejected, of), str(len(of)))
                    for kind, of in [*groups(hidden, lambda r: r["hidden"][0]), ("all", hidden)]]),
              "By protocol:",
              table(("protocol", "found", "recordings"), [(kind, words(rejected, of), str(len(of)))
                    for kind, of in groups(hidden, lambda r: r["protocol"])])]  # fmt: skip
    return "\n\n".join(part for part in parts if part) + "\n"


def kinds(record: Record) -> str:
    """The kind of instruments of a record."""
    return record["instruments"]


def groups(records: Sequence[Record], key: Any) -> list[tuple[str, list[Record]]]:
    """Records by what `key` says of them, in the order of the plan."""
    return [(name, [r for r in records if key(r) == name]) for name in dict.fromkeys(map(key, records))]


def rejected(record: Record) -> bool:
    """Whether the test found anything."""
    return record["rejected"]


def alarm(record: Record) -> bool:
    """Whether the verdict says that something is missing; what does not reject has no verdict."""
    return "verdict" in record and said(record)


def words(which: Any, records: Sequence[Record]) -> str:
    """A share with its 95 % interval."""
    return share("", "", records, which).words


def table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table in Markdown."""
    return "\n".join("| " + " | ".join(row) + " |" for row in (heads, ["---"] * len(heads), *rows))


@click.command()
@click.option("--clean", "numbers", default=25, show_default=True, help="Clean recordings of each kind and protocol.")
@click.option("--power", "repeats", default=8, show_default=True, help="Recordings of each effect and protocol.")
@click.option("--workers", default=2, show_default=True, help="Processes.")
@click.option("--seed", default=1, show_default=True, help="Of the plan.")
@click.option("--out", default="first_test.jsonl", show_default=True, help="Records; a stopped study goes on.")
@click.option("--about", default="", help="A line for the page: date, version, machine.")
def main(numbers: int, repeats: int, workers: int, seed: int, out: str, about: str) -> None:
    """Count false alarms on clean recordings, and effects found at their printed limits."""
    cases = plan(numbers, repeats, seed)
    found = worked(cases, Path(out), workers, 900.0, 0.0, False, answer)
    command = f"python -m tests.hidden.study.first_test --clean {numbers} --power {repeats} --seed {seed}"
    Path(out).with_suffix(".md").write_text(page(found, command, about), encoding="utf-8")
    click.echo(f"{len(found)} cases; {Path(out).with_suffix('.md')}")


if __name__ == "__main__":
    main()
