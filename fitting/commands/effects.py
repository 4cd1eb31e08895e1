"""`mckibben effects`: the library, and one effect in full."""

from typing import TYPE_CHECKING, Any

import click

from fitting.console.options import Command, output_options
from fitting.console.prepare import prepare
from fitting.console.study import errors_for_machines

if TYPE_CHECKING:
    from collections.abc import Sequence

    from fitting.showing.page import Section
    from mckibben_jax.effect import Effect


@click.command("effects", cls=Command)
@click.argument("names", nargs=-1, metavar="[NAME]...")
@click.option("--effect-file", metavar="FILE", help="Python file with effects of your own.")
@output_options
def command(names: tuple[str, ...], effect_file: str | None, quiet: bool, **given: Any) -> None:
    """List the effects that a model may have, or explain some of them."""
    prepare()
    from fitting.reading.own_effects import library, named
    from fitting.report import console
    from fitting.results import write_json
    from fitting.showing.catalogue import effect_report, effects_report, effects_result

    with errors_for_machines(given["json"]):
        known = library(effect_file)
        chosen = named(names, known) if names else tuple(known.values())
    if names:
        from fitting.showing.effect_picture import in_characters

        shown = [part for kind in chosen for part in (*effect_report(kind), *in_characters(kind), "")]
    else:
        shown = effects_report(chosen)
    out = console(quiet)
    for part in shown:
        out.print(part)
    if given["json"]:
        write_json(given["json"], effects_result(chosen))
    if given["html"]:
        from fitting.showing.page import write_words

        words = [part for kind in chosen for part in effect_report(kind)] if names else shown
        write_words(given["html"], "Effects", words, _pictures(chosen) if names else [])


def _pictures(kinds: "Sequence[type[Effect]]") -> "list[Section]":
    """What each effect leaves in the data, for the page."""
    from fitting.figures import as_svg
    from fitting.showing.effect_picture import fingerprint
    from fitting.showing.page import Section
    from mckibben_jax.effect import name_of

    found = ((name_of(kind), fingerprint(kind)) for kind in kinds)
    return [Section(f"{name}: {caption}", picture=as_svg(figure, name)) for name, (caption, figure) in found if figure]
