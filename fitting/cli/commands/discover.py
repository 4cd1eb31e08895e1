"""`mckibben discover`: diagnose and add, until nothing more can be said."""

from typing import Any

import click

from fitting.cli.options import (
    Command,
    candidate_options,
    data_argument,
    fit_options,
    output_options,
    save_options,
    study_options,
)
from fitting.cli.run import begin


@click.command("discover", cls=Command)
@data_argument
@study_options
@candidate_options
@fit_options
@save_options
@output_options
def command(**given: Any) -> None:
    """Diagnose, add what is missing, and again, until nothing more can be said."""
    study = begin(given)
    from fitting.cli.saving import save
    from fitting.report.changes import on_motions_in_words, on_motions_result
    from fitting.report.page import write_page
    from fitting.report.results import diagnosis_result, fit_result, steps_result
    from fitting.report.sentences import amount, judged
    from fitting.report.terminal import diagnosis_report, fit_report, headed, steps_report
    from fitting.study.diagnosing import all_candidates, candidates_of, in_newtons
    from fitting.study.discovering import discovered, on_motions

    candidates = candidates_of(study.task, given["candidates"], given["rivals"]) or all_candidates(study.task)
    with study.working("diagnosing") as progress:
        found = discovered(in_newtons(study.task), candidates, progress)
        motions = on_motions(study.task, found, progress)
    compared, stages = found.comparison, found.stages
    unit = compared.unit
    words = f"Error {amount(stages[0].rmse, unit)} -> {amount(compared.rmse, unit)}. {judged(compared)}"
    study.print([headed("RESULT", words, "bold"), headed("MODEL NOW", " + ".join(found.task.names))])
    study.print([*steps_report(stages, unit), headed("", "")])
    study.print([*diagnosis_report(found.diagnosis, unit), *fit_report(compared.fit)])
    final = compared.fit if motions is None else motions.after
    if motions is not None:
        study.print([headed("MOTION", on_motions_in_words(motions), "bold"), *fit_report(final)])
    unsure = motions is not None and not motions.confirmed
    study.print([headed("SAVED", "nothing: the motions do not confirm it")] if unsure else save(study, final))
    result = {**diagnosis_result(found.diagnosis, compared), **fit_result(compared.fit), **steps_result(stages)}
    study.write(result | on_motions_result(motions))
    if study.asked.html:
        write_page(study.asked.html, found.task, compared, found.diagnosis, stages)
    study.end(final.converged)
