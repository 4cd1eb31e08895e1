"""`mckibben diagnose`: which effect is missing."""

from typing import Any

import click

from fitting.cli.each.options import asked_for_each, do_each, each_options
from fitting.cli.options import Command, candidate_options, data_argument, output_options, study_options
from fitting.cli.run import begin


@click.command("diagnose", cls=Command)
@data_argument
@study_options
@candidate_options
@click.option("--propose", is_flag=True, help="Propose a form for what no effect of the library explains.")
@each_options
@output_options
def command(propose: bool, **given: Any) -> None:
    """Say which effect is missing from the model, or that these data cannot say.

    Several data sets are diagnosed together: they share the effects. With --each, every one is diagnosed on its own.
    """
    if asked_for_each(given):
        return do_each(given | {"propose": propose}, "diagnose")
    study = begin(given)
    from fitting.diagnosis.diagnose import of_force
    from fitting.diagnosis.proposal import proposed, require_sparse_regression
    from fitting.report.results import diagnosis_result
    from fitting.report.text.comparison import error_text
    from fitting.report.text.diagnosis import diagnosis_report, measurement_text, motion_notes
    from fitting.report.text.layout import line, lines, paste_line
    from fitting.report.text.next_step import after_diagnosis
    from fitting.report.text.proposal import proposal_result, proposal_text
    from fitting.report.text.warnings import comparison_warnings
    from fitting.study.diagnosing import candidates_of, diagnosed, following, in_newtons

    candidates = candidates_of(study.task, given["candidates"], given["rivals"])
    if propose:
        require_sparse_regression()
    with study.working("diagnosing") as progress:
        found, compared = diagnosed(study.task, candidates, progress)
        planned = following(study.task, found, progress)
        form = proposed(found, progress) if propose else None
    study.print(lines("WARNING", comparison_warnings(compared), "yellow"))
    study.print(diagnosis_report(found, compared.unit))
    notes = [*of_force(study.task.experiments)[1], *motion_notes(found, study.task.experiments)]
    study.print(lines("NOTE", notes))
    study.print([line("ERROR", error_text(compared))])
    study.print([line("MEASURE", " ".join(measurement_text(planned)))] if planned else [])
    after = after_diagnosis(found, study.asked.again, propose)
    study.print([paste_line("NEXT", after)] if after else [])
    if form:
        study.print([line("PROPOSAL", proposal_text(form))])
        study.console.print(form.command(study.asked.again), soft_wrap=True)  # to be pasted: in one line
    study.write(diagnosis_result(found, compared, planned) | ({"proposal": proposal_result(form)} if form else {}))
    if study.asked.html:
        from fitting.report.page.page import write_page

        write_page(study.asked.html, in_newtons(study.task), compared, found, planned=planned)
        study.print([line("PAGE", study.asked.html)])
    study.end(found.baseline.converged)
