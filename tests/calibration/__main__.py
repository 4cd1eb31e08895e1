"""Draw data sets from the prior, ask the program of each, and count."""

from __future__ import annotations

from pathlib import Path

import click

from ..case_by_case import work_through
from ..hidden.study.run import records
from .cases import judged, plan
from .page import page


@click.command()
@click.option("--cases", default=200, show_default=True, help="Data sets with nothing left out, and as many with.")
@click.option("--workers", default=2, show_default=True, help="Processes.")
@click.option("--seed", default=1, show_default=True, help="Of the plan.")
@click.option("--quick", is_flag=True, help="The quick look in place of emcee.")
@click.option("--out", default="calibration.jsonl", show_default=True, help="Records, one a line; a study goes on.")
@click.option("--about", default="", help="A line for the page: date, version, machine.")
@click.option("--only-page", is_flag=True, help="Only write the page of what is there; it stands beside OUT, as .md.")
def main(cases: int, workers: int, seed: int, quick: bool, out: str, about: str, only_page: bool) -> None:
    """Draw data sets from the prior, ask the program what it knows of each, and count how often it is right."""
    place = Path(out)
    if not only_page:
        work_through(judged, plan(cases, seed, quick), place, workers, "data sets")
    found = records(place)
    command = f"python -m tests.calibration --cases {cases} --seed {seed}{' --quick' if quick else ''}"
    written = place.with_suffix(".md")
    written.write_text(page(found, command, about), encoding="utf-8")
    click.echo(f"{len(found)} data sets; {written}")


if __name__ == "__main__":
    main()
