"""`mckibben plan`: which recording would separate what is still tied."""

from typing import Any

import click

from fitting.cli.options import Command, candidate_options, data_argument, output_options, study_options
from fitting.cli.run import start
from fitting.progress import part_of


@click.command("plan", cls=Command)
@data_argument
@study_options
@candidate_options
@output_options
def command(**options: Any) -> None:
    """Say which recordings would tell apart what these data leave tied, and with what power."""
    run = start(options)
    from fitting.report.text.diagnosis import verdict_text
    from fitting.report.text.layout import line
    from fitting.report.text.plan import plan_report, plan_result
    from fitting.study.diagnosing import candidates_of, diagnose_task
    from fitting.study.plan import plan_of

    candidates = candidates_of(run.task, run.request.candidates, run.request.rivals)
    with run.progress("diagnosing") as progress:
        found, _ = diagnose_task(run.task, candidates, part_of(progress, 0.0, 0.5))
        plan = plan_of(run.task, found, part_of(progress, 0.5, 1.0))
    report = [line("VERDICT", verdict_text(found)), *plan_report(plan, run.request.model_file)]
    run.print(report)
    run.write(plan_result(plan, run.request.model_file))
    if run.request.html:
        from fitting.report.page.parts import write_text_page

        write_text_page(run.request.html, "mckibben plan", report)
    run.end(found.baseline.converged)
