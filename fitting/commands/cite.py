"""`mckibben cite`: whom to thank."""

from typing import Any

import click

from fitting.console.options import Command, output_options, study_options
from fitting.console.study import errors_for_machines


@click.command("cite", cls=Command)
@click.argument("data", nargs=-1, metavar="[DATASET]...")
@study_options
@output_options
def command(**given: Any) -> None:
    """Say what to cite: the review, the model's effects, the data, the methods."""
    from fitting.console.handing import hand_out
    from fitting.console.options import Asked
    from fitting.console.prepare import prepare
    from fitting.console.task import cited_task
    from fitting.report import headed, lines
    from fitting.showing.citations import citations

    prepare()
    asked = Asked.of(given)
    with errors_for_machines(asked.json):
        task = cited_task(asked)
    found = citations(task.effects, task.experiments)
    shown = [part for label, texts in found.items() for part in lines(label.upper()[:9], texts)]
    hand_out(given, "What to cite", shown or [headed("", "nothing to cite")], found)
