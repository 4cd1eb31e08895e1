"""`mckibben fit`: values, errors, bounds, ties."""

from typing import Any

import click

from fitting.cli.each.options import asked_for_each, do_each, each_options
from fitting.cli.options import (
    Command,
    data_argument,
    fit_options,
    output_options,
    save_options,
    shooting_option,
    study_options,
)
from fitting.cli.run import begin


@click.command("fit", cls=Command)
@data_argument
@study_options
@fit_options
@shooting_option
@save_options
@each_options
@output_options
def command(**given: Any) -> None:
    """Fit the model to the data: values with robust errors, bounds, and what can make up for what.

    Several data sets are fitted together: they share the effects. With --each, every one is fitted on its own.
    """
    if asked_for_each(given):
        return do_each(given, "fit")
    study = begin(given)
    from fitting.cli.saving import save
    from fitting.comparison.compare import compare
    from fitting.report.results import comparison_result, fit_result
    from fitting.report.text.comparison import error_text, judgement
    from fitting.report.text.fit import fit_report
    from fitting.report.text.layout import line, lines
    from fitting.report.text.warnings import comparison_warnings
    from fitting.study.task import fitted

    with study.working("fitting"):
        fit = fitted(study.task)
        found = compare(fit, study.task.experiments)
    study.print([line("RESULT", judgement(found), "bold"), line("ERROR", error_text(found))])
    study.print([*lines("WARNING", comparison_warnings(found), "yellow"), *fit_report(fit)])
    study.print(save(study, fit))
    study.write(fit_result(fit) | {"comparison": comparison_result(found)})
    if study.asked.html:
        from fitting.report.page.page import write_page

        write_page(study.asked.html, study.task, found)
    study.end(fit.converged)
