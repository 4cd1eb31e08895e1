"""`mckibben selftest`: what a verdict on these recordings is worth."""

import os
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from fitting.cli.interrupts import stopped
from fitting.cli.options import (
    Command,
    NamesOption,
    candidate_options,
    data_argument,
    output_options,
    study_options,
)
from fitting.cli.run import CommandRun, check_places, start

if TYPE_CHECKING:
    from collections.abc import Iterator

    from fitting.selftest.record import Log

LOG = "selftest.jsonl"  # beside the data


@click.command("selftest", cls=Command)
@data_argument
@study_options
@candidate_options
@click.option("--hide", multiple=True, cls=NamesOption, metavar="NAME...", help="Effects to hide; default: all.")
@click.option("--log", metavar="FILE", help=f"Keeps every diagnosis as it comes; default: {LOG} beside the data.")
@click.option("--again", is_flag=True, help="Begin anew, whatever the log holds.")
@output_options
def command(hide: tuple[str, ...], log: str | None, again: bool, **options: Any) -> None:
    """Hide each effect of the library in these recordings, and say from which size it is found.

    The recordings are made again as they were, with the instruments and the noise that they show. A diagnosis takes
    half a minute, all effects take an hour; stopped or killed, the same command goes on where it was.
    """
    run = start(options)
    from fitting.report.text.layout import line
    from fitting.report.text.selftest import selftest_report, selftest_result, sought_text
    from fitting.selftest.selftest import selftest
    from fitting.study.diagnosing import candidates_of

    place = _place(run, log, again)
    candidates = candidates_of(run.task, run.request.candidates, run.request.rivals)
    with _kept(place), run.progress("self-test") as progress:

        def show(sought: Any) -> None:
            with progress.aside():
                run.print([line("", sought_text(sought))])

        found = selftest(run.task, candidates, hide, place, progress, show)
    report = selftest_report(found)
    run.print(report)
    run.write(selftest_result(found))
    if run.request.html:
        from fitting.report.page.parts import write_text_page

        write_text_page(run.request.html, "mckibben selftest", report)


@contextmanager
def _kept(place: "Log | None") -> "Iterator[None]":
    """Whoever stops it learns what is kept."""
    try:
        yield
    except KeyboardInterrupt:
        if place is None:
            stopped("Nothing is kept.")
        stopped(f"What was found is kept in {place.path}: the same command goes on.")


def _place(run: CommandRun, log: str | None, again: bool) -> "Log | None":
    """Where diagnoses are kept; nowhere beside data that may not be written to, which is said."""
    from fitting.selftest.record import Log

    check_places(log)
    folder = run.task.experiments[0].folder
    if log is None and not os.access(folder, os.W_OK):
        run.print([f"Nothing is kept on the way: {folder} may not be written to (--log FILE names another place)."])
        return None
    place = Path(log) if log else folder / LOG
    kept = Log(place, again=again)
    kept.check()
    return kept
