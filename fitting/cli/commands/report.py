"""`mckibben report`: everything on one page."""

import sqlite3
from typing import TYPE_CHECKING, Any

import click

from fitting.cli.options import (
    Command,
    candidate_options,
    data_argument,
    fit_options,
    output_options,
    study_options,
)
from fitting.cli.run import CommandRun, start
from fitting.errors import InputError
from fitting.study.request import CHAINS

if TYPE_CHECKING:
    from fitting.least_squares.record import Fit
    from fitting.report.page.parts import Section

PAGE = "mckibben_report.html"


@click.command("report", cls=Command)
@data_argument
@study_options
@candidate_options
@fit_options
@click.option("--no-diagnosis", is_flag=True, help="Compare only; takes seconds.")
@output_options
def command(no_diagnosis: bool, **options: Any) -> None:
    """Compare, diagnose, and write one HTML page (mckibben_report.html, or what --html names).

    A posterior that `mckibben posterior` sampled of the same model stands on it too.
    """
    run = start({**options, "html": options["html"] or PAGE})
    from fitting.comparison.compare import compare
    from fitting.report.page.page import write_page
    from fitting.report.results import comparison_result, diagnosis_result
    from fitting.report.text.comparison import judgement
    from fitting.report.text.diagnosis import verdict_text
    from fitting.report.text.layout import line
    from fitting.study.known import as_known

    with run.progress("comparing") as progress:
        task = run.task
        if no_diagnosis:
            diagnosis, planned, stages = None, None, ()
            compared = compare(as_known(run.task)[0], run.task.experiments)
        else:
            from fitting.study.diagnosing import candidates_of, diagnose_task, following, in_newtons
            from fitting.study.preview import before_and_after

            candidates = candidates_of(run.task, run.request.candidates, run.request.rivals)
            diagnosis, compared = diagnose_task(run.task, candidates, progress)
            planned = following(run.task, diagnosis, progress)
            task = in_newtons(run.task)
            stages = before_and_after(task, compared, diagnosis, progress)
    run.print([line("VERDICT", verdict_text(diagnosis), "bold")] if diagnosis else [])
    run.print([line("RESULT", judgement(compared))])
    sampled = _posterior(run, compared.fit)
    write_page(str(run.request.html), task, compared, diagnosis, stages, chosen=0, planned=planned, more=sampled)
    run.print([line("WRITTEN", str(run.request.html))])
    run.write(diagnosis_result(diagnosis, compared, planned) if diagnosis else comparison_result(compared))
    run.end(compared.fit.converged)


def _posterior(run: CommandRun, fit: "Fit") -> "list[Section]":
    """What was sampled of this model, if chains of it lie beside the data; they are read from a copy."""
    task, kept = run.task, run.task.experiments[0].folder / CHAINS
    if not kept.is_file():
        return []
    from fitting.posterior.stored import stored_posterior
    from fitting.report.page.posterior import posterior_sections
    from fitting.report.text.layout import line

    try:
        with run.progress("reading the posterior"):
            found = stored_posterior(kept, fit, task.experiments, seed=task.seed, priors=task.priors)
    except (InputError, OSError, sqlite3.Error) as error:  # the page is there without it
        run.print([line("NOTE", f"{kept} cannot be read, and no posterior stands on the page: {error}")])
        return []
    if found is None:
        run.print([line("NOTE", f"{kept} holds no posterior of this model and these data: left out")])
        return []
    return posterior_sections(found)
