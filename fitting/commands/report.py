"""`mckibben report`: everything on one page."""

from typing import Any

import click

from fitting.console.options import (
    Command,
    candidate_options,
    data_argument,
    fit_options,
    output_options,
    study_options,
)
from fitting.console.study import begin

PAGE = "mckibben_report.html"


@click.command("report", cls=Command)
@data_argument
@study_options
@candidate_options
@fit_options
@click.option("--no-diagnosis", is_flag=True, help="Compare only; takes seconds.")
@output_options
def command(no_diagnosis: bool, **given: Any) -> None:
    """Compare, diagnose, and write one HTML page (mckibben_report.html, or what --html names)."""
    study = begin({**given, "html": given["html"] or PAGE})
    from fitting.compare import compare
    from fitting.console.task import as_known
    from fitting.report import headed
    from fitting.results import comparison_result, diagnosis_result
    from fitting.showing.page import write_page
    from fitting.showing.sentences import judged, verdict_in_words

    with study.working("comparing") as told:
        if no_diagnosis:
            diagnosis, compared = None, compare(as_known(study.task)[0], study.task.experiments)
        else:
            from fitting.console.diagnosing import candidates_of, diagnosed

            candidates = candidates_of(study.task, given["candidates"], given["rivals"])
            diagnosis, compared = diagnosed(study.task, candidates, told)
    study.print([headed("VERDICT", verdict_in_words(diagnosis), "bold")] if diagnosis else [])
    study.print([headed("RESULT", judged(compared))])
    write_page(str(study.asked.html), study.task, compared, diagnosis)
    study.print([headed("WRITTEN", str(study.asked.html))])
    study.write(diagnosis_result(diagnosis, compared) if diagnosis else comparison_result(compared))
    study.end(compared.fit.converged)
