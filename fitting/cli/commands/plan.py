"""`mckibben plan`: which recording would separate what is still tied."""

from typing import Any

import click

from fitting.cli.options import Command, candidate_options, data_argument, output_options, study_options
from fitting.cli.run import begin


@click.command("plan", cls=Command)
@data_argument
@study_options
@candidate_options
@output_options
def command(**given: Any) -> None:
    """Say which recordings would tell apart what these data leave tied, and with what power."""
    study = begin(given)
    from fitting.report.text.diagnosis import verdict_text
    from fitting.report.text.layout import line
    from fitting.report.text.plan import plan_report, plan_result
    from fitting.study.diagnosing import candidates_of, diagnosed
    from fitting.study.plan import plan_of

    candidates = candidates_of(study.task, given["candidates"], given["rivals"])
    with study.working("diagnosing") as progress:
        found, _ = diagnosed(study.task, candidates, progress)
        progress("planning", 0.95)
        plan = plan_of(study.task, found)
    report = [line("VERDICT", verdict_text(found)), *plan_report(plan, study.asked.model_file)]
    study.print(report)
    study.write(plan_result(plan, study.asked.model_file))
    if study.asked.html:
        from fitting.report.page.parts import write_text_page

        write_text_page(study.asked.html, "mckibben plan", report)
    study.end(found.baseline.converged)
