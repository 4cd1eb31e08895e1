"""`mckibben diagnose`: which effect is missing."""

from typing import Any

import click

from fitting.cli.each.options import each_options, run_each, wants_each
from fitting.cli.options import Command, candidate_options, data_argument, output_options, study_options
from fitting.cli.run import start


@click.command("diagnose", cls=Command)
@data_argument
@study_options
@candidate_options
@click.option("--propose", is_flag=True, help="Propose a form for what no effect of the library explains.")
@each_options
@output_options
def command(propose: bool, **options: Any) -> None:
    """Say which effect is missing from the model, or that these data cannot say.

    Several data sets are diagnosed together: they share the effects. With --each, every one is diagnosed on its own.
    """
    if wants_each(options):
        return run_each(options | {"propose": propose}, "diagnose")
    run = start(options)
    from fitting.diagnosis.diagnose import of_force
    from fitting.diagnosis.proposal import proposed, require_sparse_regression
    from fitting.report.results import diagnosis_result
    from fitting.report.text.comparison import error_text, worst_text
    from fitting.report.text.diagnosis import diagnosis_report, measurement_text, motion_notes
    from fitting.report.text.instruments import channel_lines
    from fitting.report.text.layout import line, lines, paste_line
    from fitting.report.text.next_step import after_diagnosis
    from fitting.report.text.proposal import proposal_result, proposal_text
    from fitting.report.text.stated_sizes import denied_texts
    from fitting.report.text.warnings import comparison_warnings
    from fitting.study.diagnosing import candidates_of, diagnose_task, following, in_newtons
    from fitting.study.preview import before_and_after

    candidates = candidates_of(run.task, run.request.candidates, run.request.rivals)
    if propose:
        require_sparse_regression()
    with run.progress("diagnosing") as progress:
        found, compared = diagnose_task(run.task, candidates, progress)
        planned = following(run.task, found, progress)
        form = proposed(found, progress) if propose else None
        stages = before_and_after(in_newtons(run.task), compared, found, progress) if run.request.html else ()
    run.print(lines("WARNING", [*denied_texts(compared.fit), *comparison_warnings(compared)], "yellow"))
    run.print(diagnosis_report(found, compared.unit, compared))
    notes = [*of_force(run.task.experiments)[1], *motion_notes(found, run.task.experiments)]
    run.print(lines("NOTE", notes))
    run.print([line("ERROR", error_text(compared)), line("WHERE", worst_text(compared))])
    run.print(lines("CHANNELS", channel_lines(compared.channels)))
    run.print([line("MEASURE", " ".join(measurement_text(planned)))] if planned else [])
    after = after_diagnosis(found, run.request.again, propose)
    run.print([paste_line("NEXT", after.command)] if after else [])
    if form:
        run.print([line("PROPOSAL", proposal_text(form))])
        run.console.print(form.command(run.request.again), soft_wrap=True)  # to be pasted: in one line
    run.write(diagnosis_result(found, compared, planned) | ({"proposal": proposal_result(form)} if form else {}))
    if run.request.html:
        from fitting.report.page.page import write_page

        write_page(
            run.request.html, in_newtons(run.task), compared, found, stages, chosen=0, planned=planned, following=after
        )
        run.print([line("PAGE", run.request.html)])
    run.end(found.baseline.converged)
