"""`mckibben add`: put effects into the model and fit all of it again."""

from typing import Any

import click

from fitting.cli.options import (
    Command,
    fit_options,
    output_options,
    save_options,
    shooting_option,
    study_options,
)
from fitting.cli.run import start


@click.command("add", cls=Command)
@click.argument("arguments", nargs=-1, required=True, metavar="DATASET... EFFECT...")
@study_options
@fit_options
@shooting_option
@save_options
@output_options
def command(arguments: tuple[str, ...], **options: Any) -> None:
    """Add effects to the model, fit all of it together, and say how far the error falls.

    An argument that is an existing path is data, the others are effects. A rival of the same family is replaced.
    """
    from fitting.cli.arguments import split

    data, names = split(arguments)
    run = start({**options, "data": data})
    from fitting.cli.changing import change_model
    from fitting.study.changing import with_added

    change_model(run, names, with_added)
