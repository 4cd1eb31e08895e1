"""`mckibben equations`: the review's equations by number."""

from typing import Any

import click

from fitting.cli.options import Command, output_options
from fitting.cli.run import errors_for_machines


@click.command("equations", cls=Command)
@click.argument("numbers", nargs=-1, metavar="[NUMBER]...")
@output_options
def command(numbers: tuple[str, ...], **options: Any) -> None:
    """List the equations of Tondu 2012, or explain some: formula, symbols, what is wrong in print, what to call."""
    from fitting.cli.output import output
    from fitting.report.text.equations import equation_report, equations_numbered, equations_report, equations_result

    with errors_for_machines(options["json"]):
        found = equations_numbered(numbers)
    shown = [part for equation in found for part in equation_report(equation)] if numbers else equations_report(found)
    output(options, "Equations of Tondu 2012", shown, equations_result(found))
