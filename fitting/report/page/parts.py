"""What a page is made of, sections and tables, and how it becomes HTML that opens from disk and prints."""

import functools
import io
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from importlib import resources
from typing import Any

from fitting.report.pictures.overview import overview_style
from fitting.report.text.names import Names
from fitting.writing import write_text

Named = Callable[[str], str]  # of a text: the same as HTML, with the names of effects for readers

# what the template may be without
EMPTY: dict[str, Any] = {
    "heads": (), "choices": (), "typed": (), "style": "", "verdict": "", "lead": (), "cards": (), "warnings": (),
    "named": str, "headline": str, "live": None,
}  # fmt: skip


@dataclass(frozen=True)
class Line:
    """One row of a table; a good one stands out."""

    cells: tuple[str, ...]
    good: bool = False


@dataclass(frozen=True)
class Grid:
    """A table: its heads, and which columns are words rather than numbers."""

    heads: tuple[str, ...]
    rows: tuple[Line, ...]
    title: str = ""
    words: tuple[int, ...] = ()


@dataclass(frozen=True)
class Section:
    """A part of the page.

    `said` holds sentences about one model each, with its number; `model` is the number of the model that the whole part
    is about, None where it is about all of them. `rail` is the word that leads here from the rail at the top of the
    page; parts that follow each other with the same word are one place.
    """

    title: str
    sentences: tuple[str, ...] = ()
    picture: str = ""
    caption: str = ""
    tables: tuple[Grid, ...] = ()
    folded: tuple[Grid, ...] = ()
    folded_title: str = ""
    plain: str = ""
    terms: tuple[tuple[str, str], ...] = ()  # words of the tables, explained
    folded_picture: str = ""
    said: tuple[tuple[int, str], ...] = ()
    model: int | None = None
    is_still: bool = False  # a live picture takes its place where a script runs, but not on paper
    rail: str = ""
    stays: bool = False  # it stays in view beside the others where the screen is wide enough


def write_text_page(path: str, title: str, shown: Iterable[Any], pictures: Sequence[Section] = ()) -> None:
    """Write a page that says what the terminal says, under pictures if there are any."""
    words = Section("", plain=as_text(shown))
    write_text(path, render_page(title=title, about="mckibben", verdict=title, sections=[*pictures, words]))


def pictures_style() -> str:
    """Style of the pictures that are HTML."""
    written = resources.files("fitting.report.page").joinpath("pictures.css").read_text(encoding="utf-8")
    return written + overview_style()


def as_sentence(text: str) -> str:
    """The text with a capital letter and a full stop."""
    return text[:1].upper() + text[1:] + "."


def render_page(**content: Any) -> str:
    """A page: `title`, `about`, `verdict`, `sections`, and what else the template knows."""
    rail = tuple(dict.fromkeys(section.rail for section in content["sections"] if section.rail))
    return _template().render(EMPTY | {"rail": rail} | content)


@functools.cache
def _template() -> Any:
    from jinja2 import Environment

    source = resources.files("fitting.report.page").joinpath("page.html").read_text(encoding="utf-8")
    return Environment(autoescape=True, trim_blocks=True, lstrip_blocks=True).from_string(source)


def as_text(shown: Iterable[Any], names: Names | None = None) -> str:
    """What the terminal would show, as plain text."""
    from fitting.report.text.layout import NamingConsole

    console = NamingConsole(names or Names(), record=True, width=100, file=io.StringIO())
    for thing in shown:
        console.print(thing)
    return console.export_text()
