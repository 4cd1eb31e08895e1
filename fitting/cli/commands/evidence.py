"""`mckibben evidence`: what sessions recorded one after another say together."""

from typing import Any

import click

from fitting.cli.options import Command, candidate_options, data_argument, output_options, study_options
from fitting.cli.run import start


@click.command("evidence", cls=Command)
@data_argument
@study_options
@candidate_options
@output_options
def command(**options: Any) -> None:
    """Weigh the model by sessions of one muscle, each a data set, in the order in which they were recorded.

    The evidence against the model, and against it with each effect of the library, is multiplied from session to
    session. It may be looked at after every session: record until it is enough.
    """
    run = start(options)
    from fitting.evidence.sessions import weigh
    from fitting.report.text.sessions import headline, sessions_report, sessions_result
    from fitting.study.diagnosing import all_candidates, candidates_of

    task = run.task
    candidates = candidates_of(task, run.request.candidates, run.request.rivals) or all_candidates(task)
    with run.progress("weighing") as progress:
        found = weigh(
            task.experiments, task.effects, candidates=candidates, fix=task.varying.fix, free=task.varying.free,
            seed=task.seed, start=task.known, progress=progress,
        )  # fmt: skip
    report = sessions_report(found, run.request.data)
    run.print(report)
    run.write(sessions_result(found))
    if run.request.html:
        from fitting.report.page.parts import Section, write_text_page
        from fitting.report.pictures.figures import as_svg
        from fitting.report.pictures.sessions import evidence_picture
        from fitting.report.text.names import Names

        names = Names(task.library)
        drawn = as_svg(evidence_picture(found, names.called), "evidence")
        caption = "One line a model; a model whose line has crossed the dashed one is excluded for good."
        picture = Section("Evidence by session", picture=drawn, caption=caption)
        write_text_page(run.request.html, names.plain(headline(found)), report, [picture])
