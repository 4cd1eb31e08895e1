"""`mckibben fit`: values, errors, bounds, ties."""

from typing import Any

import click

from fitting.cli.each.options import each_options, run_each, wants_each
from fitting.cli.options import (
    Command,
    data_argument,
    fit_options,
    output_options,
    save_options,
    shooting_option,
    study_options,
)
from fitting.cli.run import start


@click.command("fit", cls=Command)
@data_argument
@study_options
@fit_options
@shooting_option
@save_options
@each_options
@output_options
def command(**options: Any) -> None:
    """Fit the model to the data: values with robust errors, bounds, and what can make up for what.

    Several data sets are fitted together: they share the effects. With --each, every one is fitted on its own.
    """
    if wants_each(options):
        return run_each(options, "fit")
    run = start(options)
    from fitting.cli.saving import save
    from fitting.comparison.compare import compare
    from fitting.report.results import comparison_result, fit_result
    from fitting.report.text.comparison import error_text, judgement
    from fitting.report.text.fit import fit_report
    from fitting.report.text.layout import line, lines
    from fitting.report.text.warnings import comparison_warnings
    from fitting.study.task import fit_task

    with run.progress("fitting"):
        fit = fit_task(run.task)
        found = compare(fit, run.task.experiments)
    run.print([line("RESULT", judgement(found), "bold"), line("ERROR", error_text(found))])
    run.print([*lines("WARNING", comparison_warnings(found), "yellow"), *fit_report(fit)])
    run.print(save(run, fit))
    run.write(fit_result(fit) | {"comparison": comparison_result(found)})
    if run.request.html:
        from fitting.report.page.page import write_page

        write_page(run.request.html, run.task, found)
    run.end(fit.converged)
