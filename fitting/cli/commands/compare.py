"""`mckibben compare`: where the model fails."""

from typing import TYPE_CHECKING, Any

import click

from fitting.cli.options import Command, data_argument, fit_options, output_options, study_options
from fitting.cli.run import CommandRun, start

if TYPE_CHECKING:
    from fitting.diagnosis.similarity import Knowable
    from fitting.least_squares.record import Fit


@click.command("compare", cls=Command)
@data_argument
@study_options
@fit_options
@click.option("--alike", is_flag=True, help="Also which missing effects would look alike here, and what would tell.")
@output_options
def command(alike: bool, **options: Any) -> None:
    """Compare the model with the data: how large the error is, where it is worst, and what kind it is.

    Values that a model file gives are kept; what has no fitted value yet is fitted first. PREDICTED says how large the
    error was before that.
    """
    run = start(options)
    from fitting.comparison.compare import compare
    from fitting.report.results import comparison_result, fit_result
    from fitting.report.text.alike import alike_report, alike_result, known_report, known_result
    from fitting.report.text.comparison import comparison_report
    from fitting.report.text.fit import fit_warnings
    from fitting.report.text.layout import line, lines, paste_line
    from fitting.report.text.names import marked
    from fitting.report.text.next_step import after_comparison
    from fitting.report.text.predicted import predicted_result, predicted_text
    from fitting.study.known import as_known, unfitted

    with run.progress("fitting and comparing"):
        fit, fitted_here = as_known(run.task)
        found = compare(fit, run.task.experiments)
    can_be_known = _knowable(run, fit) if alike else None
    more = {} if can_be_known is None else {"alike": alike_result(can_be_known)}
    if fitted_here and run.task.is_of_others:
        before = compare(unfitted(run.task), run.task.experiments)
        run.print([line("PREDICTED", predicted_text(before, fitted_here, run.task.knows_hose))])
        more |= predicted_result(before, fitted_here)
    elif fitted_here:
        run.print([line("FITTED", marked(name for name in fitted_here if name in fit.free) or "nothing")])
    run.print(lines("WARNING", fit_warnings(fit), "yellow") if fitted_here else [])
    run.print(comparison_report(found))
    run.print(known_report(fit))
    run.print([] if can_be_known is None else alike_report(can_be_known))
    after = after_comparison(found, run.request.again)
    run.print([line("", ""), paste_line("NEXT", after)] if after else [])
    if run.request.json:  # limits of values at their bounds take seconds
        run.write(comparison_result(found) | {"fit": fit_result(fit), "known": known_result(fit)} | more)
    if run.request.html:
        from fitting.report.page.page import write_page

        write_page(run.request.html, run.task, found)
    run.end(fit.converged)


def _knowable(run: CommandRun, fit: "Fit") -> "Knowable":
    from fitting.diagnosis.similarity import knowable

    with run.progress("looking at every effect"):
        kinds = [kind for kind in run.task.library.values() if not kind.rival]
        return knowable(fit, run.task.experiments, kinds)
