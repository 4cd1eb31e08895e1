"""`mckibben compare`: where the model fails."""

from typing import TYPE_CHECKING, Any

import click

from fitting.console.options import Command, data_argument, fit_options, output_options, study_options
from fitting.console.study import Study, begin

if TYPE_CHECKING:
    from fitting.alike import Knowable
    from fitting.least_squares import Fit


@click.command("compare", cls=Command)
@data_argument
@study_options
@fit_options
@click.option("--alike", is_flag=True, help="Also which missing effects would look alike here, and what would tell.")
@output_options
def command(alike: bool, **given: Any) -> None:
    """Compare the model with the data: how large the error is, where it is worst, and what kind it is.

    Values that a model file gives are kept; what has no fitted value yet is fitted first.
    """
    study = begin(given)
    from fitting.compare import compare
    from fitting.console.task import as_known
    from fitting.report import comparison_report, headed, lines, to_type
    from fitting.results import comparison_result, fit_result
    from fitting.showing.alike_words import alike_report, alike_result, known_report, known_result
    from fitting.showing.next_step import after_comparison
    from fitting.showing.sentences import fit_in_words

    with study.working("fitting and comparing"):
        fit, fitted_here = as_known(study.task)
        found = compare(fit, study.task.experiments)
    can_be_known = _knowable(study, fit) if alike else None
    more = {} if can_be_known is None else {"alike": alike_result(can_be_known)}
    if fitted_here:
        study.print([headed("FITTED", ", ".join(name for name in fitted_here if name in fit.free) or "nothing")])
    study.print(lines("WARNING", fit_in_words(fit), "yellow") if fitted_here else [])
    study.print(comparison_report(found))
    study.print(known_report(fit))
    study.print([] if can_be_known is None else alike_report(can_be_known))
    after = after_comparison(found, study.task.experiments, study.asked.again)
    study.print([headed("", ""), to_type("NEXT", after)] if after else [])
    study.write(comparison_result(found) | {"fit": fit_result(fit), "known": known_result(fit)} | more)
    if study.asked.html:
        from fitting.showing.page import write_page

        write_page(study.asked.html, study.task, found)
    study.end(fit.converged)


def _knowable(study: Study, fit: "Fit") -> "Knowable":
    from fitting.alike import knowable

    with study.working("looking at every effect"):
        kinds = [kind for kind in study.task.library.values() if not kind.rival]
        return knowable(fit, study.task.experiments, kinds)
