"""`mckibben cite`: whom to thank."""

from typing import Any

import click

from fitting.cli.options import Command, output_options, study_options
from fitting.cli.run import errors_for_machines


@click.command("cite", cls=Command)
@click.argument("data", nargs=-1, metavar="[DATASET]...")
@study_options
@output_options
def command(**options: Any) -> None:
    """Say what to cite: the review, the model's effects, the data, the methods."""
    from fitting.cli.output import output
    from fitting.compiled.prepare import prepare
    from fitting.report.text.citations import citations
    from fitting.report.text.layout import line, lines
    from fitting.study.request import Request
    from fitting.study.task import cited_task

    prepare()
    request = Request.of(options)
    with errors_for_machines(request.json):
        task = cited_task(request)
    found = citations(task.effects, task.experiments)
    shown = [part for label, texts in found.items() for part in lines(label.upper()[:9], texts)]
    output(options, "What to cite", shown or [line("", "nothing to cite")], found)
