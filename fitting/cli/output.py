"""What the commands that make no study hand out: words on the terminal, `--json`, `--html`."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rich.console import RenderableType

    from fitting.report.page.parts import Section

    Shown = Sequence[RenderableType]

Given = Mapping[str, Any]  # the options of a command: `quiet`, `json` and `html` count here


def hand_out(
    given: Given, title: str, shown: "Shown", result: Any, *, page: "Shown | None" = None,
    pictures: "Sequence[Section]" = (),
) -> None:  # fmt: skip
    """Print what is shown, and write it where `--json` and `--html` ask; `page` is what the page says instead."""
    print_out(given, shown)
    write_out(given, title, shown if page is None else page, result, pictures)


def print_out(given: Given, shown: "Shown") -> None:
    """Print lines and tables; a text is as wide as it is, so that its columns stay in line."""
    from fitting.report.text.layout import console

    out = console(given["quiet"])
    for part in shown:
        out.print(part, soft_wrap=isinstance(part, str))


def write_out(given: Given, title: str, shown: "Shown", result: Any, pictures: "Sequence[Section]" = ()) -> None:
    """Write the result for machines, and the page under its pictures, where they were asked for."""
    from fitting.cli.run import check_places
    from fitting.report.page.parts import write_text_page
    from fitting.report.results import write_json

    check_places(given["json"], given["html"])
    if given["json"]:
        write_json(given["json"], result)
    if given["html"]:
        write_text_page(given["html"], title, shown, pictures)
