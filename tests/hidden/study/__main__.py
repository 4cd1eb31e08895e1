"""Run a share of the study and write its page."""

from pathlib import Path

import click


@click.command()
@click.option("--share", default=0.1, show_default=True, help="Share of the plan, 0 to 1.")
@click.option("--workers", default=2, show_default=True, help="Processes.")
@click.option("--out", default="hidden.jsonl", show_default=True, help="Records, one a line; a stopped study goes on.")
@click.option("--seed", default=1, show_default=True, help="Of the plan.")
@click.option("--limit", default=900.0, show_default=True, help="Seconds for one case, compilation included.")
@click.option("--rivals", default=0.25, show_default=True, help="Share of the cases that rivals answer too.")
@click.option("--page", default=None, help="HTML page; beside it a table in Markdown and CSV. OUT.html unless given.")
@click.option("--only-page", is_flag=True, help="Only write the page of what is there.")
def main(
    share: float, workers: int, out: str, seed: int, limit: float, rivals: float, page: str | None, only_page: bool
) -> None:
    """Hide effects, diagnose, and count how often the verdict was right."""
    from .page import write_page
    from .run import records, study

    place = Path(out)
    found = records(place) if only_page else study(place, share, workers, seed, limit, rivals)
    command = f"python -m tests.hidden.study --share {share:g} --workers {workers} --seed {seed} --rivals {rivals:g}"
    written = write_page(found, Path(page) if page else place.with_suffix(".html"), command)
    click.echo(f"{len(found)} cases; {written}")


if __name__ == "__main__":
    main()
