"""`mckibben workbench`: look, click, and watch the error fall."""

import click

from fitting.cli.interrupts import end_at_once
from fitting.cli.options import Command, request_options


@click.command("workbench", cls=Command)
@click.argument("dataset", required=False, metavar="[DATASET]")
@click.option("--port", type=click.IntRange(1, 65535), metavar="N", help="Port; default: 8642, or the next free one.")
@click.option("--host", default="127.0.0.1", show_default=True, help="Address to listen at; others ask for a token.")
@click.option("--token", help="The token that another --host asks for; without it one is made up and printed.")
@request_options("candidates")
@click.option("--no-browser", is_flag=True, help="Only print the address.")
def command(
    dataset: str | None, port: int | None, host: str, token: str | None, candidates: tuple[str, ...], no_browser: bool
) -> None:
    """Serve the workbench on this machine and open it in the browser.

    DATASET is a folder with a muscle.toml, or the name of a data set that comes with the program (muscle_a).
    """
    from fitting.workbench.serving import serve

    end_at_once()
    serve(dataset, port, host, token, candidates, browse=not no_browser)
