"""`mckibben design`: the muscle that does the job."""

import sys
from typing import Any

import click

from fitting.options import Command, output_options
from fitting.prepare import prepare
from fitting.study import check_places, errors_for_machines, progress_bar


@click.command("design", cls=Command)
@click.argument("spec", metavar="SPEC.toml")
@click.option("--effect-file", metavar="FILE", help="Python file with effects of your own.")
@output_options
def command(spec: str, effect_file: str | None, quiet: bool, **given: Any) -> None:
    """Find the muscle that does best what SPEC.toml asks for, within what rubber and braid can bear."""
    prepare()
    check_places(given["json"], given["html"])
    from fitting.design_file import describe, design, read_design, to_json
    from fitting.own_effects import library
    from fitting.report import console
    from fitting.results import write_json

    with errors_for_machines(given["json"]):
        task = read_design(spec, library(effect_file))
    with progress_bar("designing", quiet):
        found = design(task)
    words = describe(found)
    console(quiet).print(words, markup=False, highlight=False)
    if given["json"]:
        write_json(given["json"], to_json(found))
    if given["html"]:
        from fitting.page import write_words

        write_words(given["html"], "Design", [words])
    sys.exit(3 if found.outcome == "not converged" else 0)
