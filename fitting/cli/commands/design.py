"""`mckibben design`: the muscle that does the job."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from fitting.cli.options import Command, effect_file_option, output_options
from fitting.cli.run import NOT_CONVERGED, check_place, check_places, check_results, errors_for_machines
from fitting.cli.waiting import progress_bar
from fitting.compiled.prepare import prepare

if TYPE_CHECKING:
    from fitting.designs.answer import Answer
    from fitting.report.page.parts import Section


@click.command("design", cls=Command)
@click.argument("spec", metavar="SPEC.toml")
@effect_file_option
@click.option("--posterior", metavar="FILE", help="Draws of `posterior --netcdf`: design on all of them.")
@click.option(
    "--also", multiple=True, metavar="FILE", help="Another model of the same muscle; give it for each of a tie."
)
@click.option("--picture", metavar="FILE", help="The muscle to scale (or the trade-off): .svg, .pdf or .png.")
@click.option("--save", metavar="FILE", help="The design as a model file; of a trade-off a folder of them.")
@output_options
def command(
    spec: str, effect_file: str | None, posterior: str | None, also: tuple[str, ...], picture: str | None,
    save: str | None, **options: Any,
) -> None:  # fmt: skip
    """Find the muscle that does best what SPEC.toml asks for, within what rubber and braid can bear.

    Where several models explain the data, --also names the others: the limits then hold in all of them, and the
    objective is best on average.
    """
    prepare()
    check_results(options["json"], options["html"])
    check_places(picture)
    from fitting.cli.output import print_report, write_files
    from fitting.designs.answer import answer
    from fitting.designs.order import read_draws, read_order
    from fitting.errors import InputError
    from fitting.library.library import library
    from fitting.report.pictures.design import check_kind, draw
    from fitting.report.text.design import answer_result, answer_text
    from fitting.showing import own_units, spoken

    with errors_for_machines(options["json"]):
        if also and posterior:
            cure = "leave one of them out"
            raise InputError("--also is for several models, --posterior for one that is not known exactly", cure=cure)
        order = read_order(spec, library(effect_file), also)
        click.get_current_context().with_resource(spoken(own_units(order.units)))
        draws = read_draws(posterior, order.task) if posterior else {}
        if save and not (order.second and Path(save).is_dir()):  # a trade-off is saved into a folder
            check_place(save)
            _left_alone(Path(save))
        if picture:
            check_kind(picture)
        with progress_bar("designing", options["quiet"]):
            found = answer(order, draws, options["seed"])
        print_report(options, [answer_text(found)])
        if picture:
            draw(found, picture)
        if save:
            found.save(Path(save))
    write_files(options, "Design", [answer_text(found)], answer_result(found), _pictures(found, options["html"]))
    sys.exit(0 if found.converged else NOT_CONVERGED)


def _pictures(found: "Answer", page: str | None) -> "list[Section]":
    """The muscle to scale, or the trade-off, for the page if there is to be one."""
    if not page:
        return []
    from fitting.report.page.parts import Section
    from fitting.report.pictures.design import figure_of
    from fitting.report.pictures.figures import as_svg

    title, figure = figure_of(found)
    return [Section(title, picture=as_svg(figure, "design"))]


def _left_alone(path: Path) -> None:
    """Refuse to replace what a person has written."""
    from fitting.errors import InputError
    from fitting.model_files.writer import is_edited

    if path.is_file() and is_edited(path):
        raise InputError("the file was written or edited by hand and is left alone", path, cure="name another file")
