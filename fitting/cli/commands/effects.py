"""`mckibben effects`: the library, and one effect in full."""

from typing import TYPE_CHECKING, Any

import click

from fitting.cli.options import Command, effect_file_option, output_options
from fitting.cli.run import errors_for_machines
from fitting.compiled.prepare import prepare

if TYPE_CHECKING:
    from collections.abc import Sequence

    from fitting.report.page.parts import Section
    from mckibben_jax.effect import Effect


@click.command("effects", cls=Command)
@click.argument("names", nargs=-1, metavar="[NAME]...")
@effect_file_option
@output_options
def command(names: tuple[str, ...], effect_file: str | None, **options: Any) -> None:
    """List the effects that a model may have, or explain some of them."""
    prepare()
    from fitting.cli.output import output
    from fitting.library.library import effects_named, library
    from fitting.report.text.catalogue import effect_report, effects_report, effects_result

    with errors_for_machines(options["json"]):
        known = library(effect_file)
        chosen = effects_named(names, known) if names else tuple(known.values())
    if not names:
        output(options, "Effects", effects_report(chosen), effects_result(chosen))
        return
    from fitting.report.pictures.effect import in_characters

    shown = [part for kind in chosen for part in (*effect_report(kind), *in_characters(kind), "")]
    page = [part for kind in chosen for part in effect_report(kind)]
    output(options, "Effects", shown, effects_result(chosen), page=page, pictures=_pictures(chosen, options["html"]))


def _pictures(kinds: "Sequence[type[Effect]]", page: str | None) -> "list[Section]":
    """What each effect leaves in the data, for the page if there is to be one."""
    if not page:
        return []
    from fitting.report.page.parts import Section
    from fitting.report.pictures.effect import fingerprint
    from fitting.report.pictures.figures import as_svg
    from mckibben_jax.effect import name_of

    found = ((name_of(kind), fingerprint(kind)) for kind in kinds)
    return [Section(f"{name}: {caption}", picture=as_svg(figure, name)) for name, (caption, figure) in found if figure]
