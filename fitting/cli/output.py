"""The output of commands that make no study: text on the terminal, `--json`, `--html`."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rich.console import RenderableType

    from fitting.report.page.parts import Section

    Shown = Sequence[RenderableType]

Options = Mapping[str, Any]  # the options of a command: `quiet`, `json` and `html` count here


def output(
    options: Options, title: str, shown: "Shown", result: Any, *, page: "Shown | None" = None,
    pictures: "Sequence[Section]" = (),
) -> None:  # fmt: skip
    """Print what is shown, and write it where `--json` and `--html` ask; `page` is what the page says instead."""
    print_report(options, shown)
    write_files(options, title, shown if page is None else page, result, pictures)


def print_report(options: Options, shown: "Shown") -> None:
    """Print lines and tables; a text is as wide as it is, so that its columns stay in line."""
    from fitting.report.text.layout import console

    out = console(options["quiet"])
    for part in shown:
        out.print(part, soft_wrap=isinstance(part, str))


def write_files(options: Options, title: str, shown: "Shown", result: Any, pictures: "Sequence[Section]" = ()) -> None:
    """Write the result for machines, and the page under its pictures, where they were asked for."""
    from fitting.cli.run import check_results

    check_results(options["json"], options["html"])
    if options["json"]:  # each brings libraries that a text on the terminal does without
        from fitting.report.results import write_json

        write_json(options["json"], result)
    if options["html"]:
        from fitting.report.page.parts import write_text_page

        write_text_page(options["html"], title, shown, pictures)
