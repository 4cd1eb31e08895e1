"""`mckibben diagnose`: which effect is missing."""

from typing import Any

import click

from fitting.options import Command, candidate_options, data_argument, output_options, study_options
from fitting.study import begin


@click.command("diagnose", cls=Command)
@data_argument
@study_options
@candidate_options
@output_options
def command(**given: Any) -> None:
    """Say which effect is missing from the model, or that these data cannot say."""
    study = begin(given)
    from fitting.diagnosing import candidates_of, diagnosed
    from fitting.report import diagnosis_report, headed
    from fitting.results import diagnosis_result
    from fitting.sentences import error_in_words, next_command

    candidates = candidates_of(study.task, given["candidates"], given["rivals"])
    with study.working("diagnosing") as told:
        found, compared = diagnosed(study.task, candidates, told)
    study.write(diagnosis_result(found, compared))
    if study.asked.html:
        from fitting.page import write_page

        write_page(study.asked.html, study.task, compared, found)
    study.print(diagnosis_report(found, compared.unit))
    study.print([headed("ERROR", error_in_words(compared))])
    following = next_command(found, study.asked.data)
    study.print([headed("NEXT", following)] if following else [])
    study.end(found.baseline.converged)
