"""Record sessions, fit some of their runs, and count the readings of the others that lie in the band."""

from __future__ import annotations

from concurrent.futures import FIRST_COMPLETED, wait
from pathlib import Path

import click

from ..hidden.study.run import append, bar, pool, records
from .cases import Case, attempted, plan
from .page import page


@click.command()
@click.option("--cases", default=40, show_default=True, help="Sessions of each kind, of which there are eight.")
@click.option("--workers", default=2, show_default=True, help="Processes.")
@click.option("--seed", default=1, show_default=True, help="Of the plan.")
@click.option("--out", default="new_runs.jsonl", show_default=True, help="Records, one a line; a study goes on.")
@click.option("--about", default="", help="A line for the page: date, version, machine.")
def main(cases: int, workers: int, seed: int, out: str, about: str) -> None:
    """Count how many readings of new runs the band of 90 % holds."""
    place = Path(out)
    grown(plan(cases, seed), place, workers)
    found = records(place)
    written = place.with_suffix(".md")
    written.write_text(page(found, f"python -m tests.new_runs --cases {cases} --seed {seed}", about), encoding="utf-8")
    click.echo(f"{len(found)} sessions; {written}")


def grown(cases: list[Case], place: Path, workers: int) -> None:
    """Work through the cases; what the file holds already is not done again."""
    done = {record["id"] for record in records(place)}
    todo = [case for case in cases if case.id not in done]
    with pool(workers) as working, bar(False) as shown:
        number = shown.add_task("sessions", total=len(cases), completed=len(cases) - len(todo))
        waiting = {working.schedule(attempted, args=(case,)) for case in todo}
        while waiting:
            ended, waiting = wait(waiting, return_when=FIRST_COMPLETED)
            for future in ended:
                append(place, future.result())
                shown.update(number, advance=1)


if __name__ == "__main__":
    main()
