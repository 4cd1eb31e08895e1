"""`mckibben fit`: values, errors, bounds, ties."""

from typing import TYPE_CHECKING, Any

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
from fitting.cli.run import CommandRun, start
from fitting.errors import InputError

if TYPE_CHECKING:
    from fitting.least_squares.left_out_sets import LeftOutSet
    from fitting.least_squares.record import Fit


@click.command("fit", cls=Command)
@data_argument
@study_options
@fit_options
@shooting_option
@click.option("--leave-out", is_flag=True, help="Also predict each data set by a fit of all others.")
@save_options
@each_options
@output_options
def command(leave_out: bool, **options: Any) -> None:
    """Fit the model to the data: values with robust errors, bounds, and what can make up for what.

    Several data sets are fitted together: they share the effects, and the sizes of a hose that all of them are cut
    from. With --each, every one is fitted on its own.
    """
    if wants_each(options):
        if leave_out:
            raise InputError("--leave-out beside --each", cure="take --leave-out without --each: it needs a common fit")
        return run_each(options, "fit")
    run = start(options)
    if leave_out and len(run.task.experiments) == 1:
        raise InputError("--leave-out needs other data sets to learn from", cure="name two data sets or more")
    from fitting.cli.saving import save
    from fitting.comparison.compare import compare
    from fitting.report.results import comparison_result, fit_result
    from fitting.report.text.comparison import error_text, judgement
    from fitting.report.text.fit import fit_report
    from fitting.report.text.layout import line, lines
    from fitting.report.text.left_out import left_out_result
    from fitting.report.text.warnings import comparison_warnings
    from fitting.study.task import fit_task

    with run.progress("fitting"):
        fit = fit_task(run.task)
        found = compare(fit, run.task.experiments)
    run.print([line("RESULT", judgement(found), "bold"), line("ERROR", error_text(found))])
    run.print([*lines("WARNING", comparison_warnings(found), "yellow"), *fit_report(fit)])
    run.print(save(run, fit))
    left_out = _left_out(run, fit) if leave_out else ()
    said = left_out_result(left_out) if leave_out else {}
    run.write(fit_result(fit) | {"comparison": comparison_result(found)} | said)
    if run.request.html:
        from fitting.report.page.left_out import left_out_section
        from fitting.report.page.page import write_page

        write_page(run.request.html, run.task, found, more=[left_out_section(left_out)] if leave_out else ())
    run.end(fit.converged)


def _left_out(run: CommandRun, fit: "Fit") -> tuple["LeftOutSet", ...]:
    """How well each data set is predicted by a fit of the others; printed, too."""
    from fitting.least_squares.left_out_sets import each_left_out
    from fitting.report.text.left_out import left_out_report

    with run.progress("leaving out each data set"):
        found = tuple(each_left_out(fit))
    run.print(left_out_report(found))
    return found
