"""`mckibben init`: a muscle.toml to fill in."""

from typing import Any

import click

from fitting.cli.options import Command, output_options
from fitting.cli.run import errors_for_machines

ACCURACY = (
    "what the data sheets of your instruments say belongs below [recording.accuracy], or below [accuracy] if it holds "
    "for all recordings; what is not stated is presumed as it stands there, and compare and diagnose print it"
)


@click.command("init", cls=Command)
@click.argument("folder")
@output_options
def command(folder: str, **options: Any) -> None:
    """Look at the recordings of a folder (CSV, Excel, MATLAB, LabVIEW, ROS 2) and write a muscle.toml to fill in."""
    with errors_for_machines(options["json"]):
        from fitting.cli.output import output
        from fitting.recordings.template import write_guessed
        from fitting.report.text.guesses import guess_result, said_of_guess
        from fitting.report.text.layout import line, lines
        from fitting.report.text.next_step import shell_words

        path, guesses = write_guessed(folder)
    shown = [
        *lines("READ", [said_of_guess(guess) for guess in guesses]),
        line("WRITTEN", str(path)),
        line("NOW", "write a value for every '?' in it, and check what READ says and what is called a guess"),
        line("ALSO", ACCURACY),
        line("NEXT", f"mckibben compare {shell_words([folder])}"),
    ]
    output(options, "mckibben init", shown, {"written": str(path), "recordings": list(map(guess_result, guesses))})
