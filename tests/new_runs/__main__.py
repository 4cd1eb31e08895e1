"""Record sessions, fit some of their runs, and count the readings of the others that lie in the band."""

from __future__ import annotations

from pathlib import Path

import click

from ..case_by_case import work_through
from ..hidden.study.run import records
from .cases import judged, plan
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
    work_through(judged, plan(cases, seed), place, workers, "sessions")
    found = records(place)
    written = place.with_suffix(".md")
    written.write_text(page(found, f"python -m tests.new_runs --cases {cases} --seed {seed}", about), encoding="utf-8")
    click.echo(f"{len(found)} sessions; {written}")


if __name__ == "__main__":
    main()
