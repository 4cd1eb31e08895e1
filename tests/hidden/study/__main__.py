"""Run a share of the study and write its page."""

from pathlib import Path

import click


def listed(_context: click.Context, option: click.Parameter, words: str) -> tuple[str, ...]:
    """The groups, or the kinds of instruments, named in a list with commas."""
    from .cases import plan

    field = {"groups": "group", "rigs": "instruments"}[str(option.name)]
    known = dict.fromkeys(getattr(case, field) for case in plan())
    named = tuple(word.strip() for word in words.split(",") if word.strip())
    strange = [name for name in named if name not in known]
    if strange:
        raise click.BadParameter(f"no {', '.join(strange)}; the plan has {', '.join(known)}")
    return named


@click.command()
@click.option("--share", default=0.1, show_default=True, help="Share of the plan, 0 to 1.")
@click.option("--workers", default=2, show_default=True, help="Processes.")
@click.option("--out", default="hidden.jsonl", show_default=True, help="Records, one a line; a stopped study goes on.")
@click.option("--seed", default=1, show_default=True, help="Of the plan.")
@click.option("--limit", default=900.0, show_default=True, help="Seconds for one case, compilation included.")
@click.option("--rivals", default=0.25, show_default=True, help="Share of the cases that rivals answer too.")
@click.option("--page", default=None, help="HTML page; beside it a table in Markdown and CSV. OUT.html unless given.")
@click.option("--only-page", is_flag=True, help="Only write the page of what is there.")
@click.option("--groups", default="", callback=listed, help="Groups of the plan, as in kinds,none; all unless given.")
@click.option(
    "--instruments", "rigs", default="", callback=listed, help="Kinds of instruments, as laboratory; all unless given."
)
def main(
    share: float, workers: int, out: str, seed: int, limit: float, rivals: float, page: str | None, only_page: bool,
    groups: tuple[str, ...], rigs: tuple[str, ...],
) -> None:  # fmt: skip
    """Hide effects, diagnose, and count how often the verdict was right."""
    from .distance import distances
    from .page import rig_markdown, rig_tables, write_page
    from .run import records, study

    place = Path(out)
    found = records(place) if only_page else study(place, share, workers, seed, limit, rivals, groups=groups, rigs=rigs)
    command = f"python -m tests.hidden.study --share {share:g} --workers {workers} --seed {seed} --rivals {rivals:g}"
    command += f" --groups {','.join(groups)}" if groups else ""
    command += f" --instruments {','.join(rigs)}" if rigs else ""
    oracle = distances(found, place.with_suffix(".oracle.jsonl"))
    written = write_page(found, Path(page) if page else place.with_suffix(".html"), command, oracle)
    click.echo(rig_markdown(rig_tables(found, oracle)))
    click.echo(f"{len(found)} cases; {written}")


if __name__ == "__main__":
    main()
