"""`mckibben compare`: where the model fails."""

from typing import Any

import click

from fitting.options import Command, data_argument, fit_options, output_options, study_options
from fitting.study import begin


@click.command("compare", cls=Command)
@data_argument
@study_options
@fit_options
@output_options
def command(**given: Any) -> None:
    """Compare the model with the data: how large the error is, where it is worst, and what kind it is.

    Values that a model file gives are kept; what has no fitted value yet is fitted first.
    """
    study = begin(given)
    from fitting.compare import compare
    from fitting.report import comparison_report, headed, lines
    from fitting.results import comparison_result, fit_result
    from fitting.sentences import fit_in_words
    from fitting.task import as_known

    with study.working("fitting and comparing"):
        fit, fitted_here = as_known(study.task)
        found = compare(fit, study.task.experiments)
    study.write(comparison_result(found) | {"fit": fit_result(fit)})
    if study.asked.html:
        from fitting.page import write_page

        write_page(study.asked.html, study.task, found)
    if fitted_here:
        study.print([headed("FITTED", ", ".join(name for name in fitted_here if name in fit.free) or "nothing")])
    study.print(lines("WARNING", fit_in_words(fit), "yellow") if fitted_here else [])
    study.print(comparison_report(found))
    if found.rmse > 1.5 * found.floor:
        study.print([headed("", ""), headed("NEXT", f"mckibben diagnose {' '.join(study.asked.data)}")])
    study.end(fit.converged)
