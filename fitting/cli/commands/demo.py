"""`mckibben demo`: the whole story on data that come with the program."""

from typing import Any

import click

from fitting.cli.options import Command, output_options
from fitting.cli.run import start

PAGE = "mckibben_demo.html"


@click.command("demo", cls=Command)
@click.argument("name", default="muscle_a", metavar="[NAME]")
@click.option("--reveal", is_flag=True, help="Print what was really put into the simulated data.")
@output_options
def command(name: str, reveal: bool, **options: Any) -> None:
    """Compare, diagnose, add, watch the error fall, write a report; NAME is a shipped data set (muscle_a)."""
    from fitting.shipped import example_data

    folder = example_data(name)
    if reveal:
        _reveal(name, options)
        return
    run = start({**options, "data": (str(folder),), "baseline": True, "html": options["html"] or PAGE})
    from fitting.cli.demonstration import demonstrate

    demonstrate(run)


def _reveal(name: str, options: dict[str, Any]) -> None:
    from fitting.cli.output import print_report
    from fitting.report.results import write_json
    from fitting.report.text.layout import lines
    from fitting.report.text.names import mark, marked
    from fitting.shipped import sealed_truth

    truth = sealed_truth(name)
    hidden = truth.get("hidden")
    told = [marked(hidden) if hidden else "nothing is missing"] if truth else [f"{name} was measured: nobody knows"]
    told += [f"{mark(key)} = {value:g} (SI)" for key, value in truth.get("parameters", {}).items()]
    print_report(options, lines("TRUTH", told))
    if options["json"]:
        write_json(options["json"], truth)
