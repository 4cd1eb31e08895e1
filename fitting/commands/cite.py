"""`mckibben cite`: whom to thank."""

from typing import Any

import click

from fitting.options import Command, output_options, study_options
from fitting.study import errors_for_machines


@click.command("cite", cls=Command)
@click.argument("data", nargs=-1, metavar="[DATASET]...")
@study_options
@output_options
def command(**given: Any) -> None:
    """Say what to cite: the review, the model's effects, the data, the methods."""
    from fitting.citations import citations
    from fitting.options import Asked
    from fitting.prepare import prepare
    from fitting.report import console, headed, lines
    from fitting.results import write_json
    from fitting.task import cited_task

    prepare()
    asked = Asked.of(given)
    with errors_for_machines(asked.json):
        task = cited_task(asked)
    found = citations(task.effects, task.experiments)
    shown = [part for label, texts in found.items() for part in lines(label.upper()[:9], texts)]
    out = console(asked.quiet)
    for part in shown or [headed("", "nothing to cite")]:
        out.print(part)
    if asked.json:
        write_json(asked.json, found)
    if asked.html:
        from fitting.page import write_words

        write_words(asked.html, "What to cite", shown)
