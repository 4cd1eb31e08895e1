"""What the commands of a study share: start, show progress, print, write files, end with a status."""

import json
import os
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from fitting.cli.waiting import ProgressBar, progress_bar
from fitting.compiled.prepare import prepare
from fitting.errors import InputError
from fitting.showing import own_units, spoken
from fitting.study.request import Request

if TYPE_CHECKING:
    from rich.console import Console, RenderableType

    from fitting.study.task import Task

NOT_CONVERGED = 3
# what people write, and no command hands out where it likes
NO_RESULT = (".csv", ".tsv", ".toml", ".py", ".xlsx", ".xlsm", ".mat", ".mcap", ".tdms")
OTHERS = (".jsonl", ".ipynb", ".svg", ".xml", ".ini")  # begin as results do, and are something else


@dataclass(frozen=True)
class CommandRun:
    """One command on data: what was asked, what is to be done, and where the output goes."""

    request: Request
    task: "Task"
    console: "Console"
    begun: float

    def print(self, shown: Sequence["RenderableType"]) -> None:
        """Print tables and lines; commands to be pasted are not broken, however narrow the terminal is."""
        from rich.text import Text

        for thing in shown:
            self.console.print(thing, soft_wrap=isinstance(thing, Text))

    def write(self, result: dict[str, Any]) -> None:
        """Write `--json`, with what it takes to get the same again."""
        from fitting.report.results import provenance, write_json

        if self.request.json:
            seconds = round(time.monotonic() - self.begun, 2)
            write_json(self.request.json, result | {"provenance": provenance(self.task) | {"seconds": seconds}})

    def end(self, converged: bool, why_not: str = "the search did not converge") -> None:
        """End the command; what did not converge has its own status."""
        if not converged:
            click.echo(f"mckibben: {why_not}; the result is written and marked so.", err=True)
            raise click.exceptions.Exit(NOT_CONVERGED)

    @contextmanager
    def progress(self, text: str) -> "Iterator[ProgressBar]":
        """A progress bar on the error output while something takes its time."""
        with progress_bar(text, self.request.quiet) as told:
            yield told


def start(options: dict[str, Any]) -> CommandRun:
    """Read what was typed; a message for machines too if that fails."""
    request, begun = Request.of(options), time.monotonic()
    prepare()
    from fitting.report.text.layout import console
    from fitting.report.text.names import Names
    from fitting.report.text.study import opening
    from fitting.study.task import task_of

    check_results(request.json, request.html)
    check_place(request.save)
    with errors_for_machines(request.json):
        task = task_of(request)
    click.get_current_context().with_resource(spoken(own_units(u for e in task.experiments for u in e.units)))
    run = CommandRun(request, task, console(request.quiet, Names(task.library)), begun)
    run.print(opening(task))
    return run


def check_results(json_file: str | None, page: str | None = None) -> None:
    """Refuse `--json` and `--html` where they cannot be written, or would replace what is no result."""
    for path in (json_file, page):
        check_places(path)
        if path and (_ends_in(path, OTHERS) or not _is_result(Path(path))):
            raise _left_alone(path)


def check_places(*paths: str | None) -> None:
    """Refuse files that cannot be written, or would replace a measurement, before anything is computed for them."""
    for path in paths:
        check_place(path)
        if path and _ends_in(path, NO_RESULT):
            raise _left_alone(path)


def _left_alone(path: str) -> InputError:
    cure = "name another file, for example result.json"
    return InputError("the file is no result of this program and is left alone", path, cure=cure)


def _ends_in(path: str, endings: tuple[str, ...]) -> bool:
    return Path(path).suffix.lower() in endings and Path(path).is_file()


def _is_result(path: Path) -> bool:
    """Whether a file may be a result of an earlier command: JSON, a page, or nothing yet. A device takes anything."""
    if not path.is_file() or path.is_relative_to("/dev"):
        return True
    try:
        text = path.read_text(encoding="utf-8-sig").strip()
        if text[:15].lower().startswith(("<!doctype html", "<html")):
            return True
        return not text or isinstance(json.loads(text), (dict, list))
    except (OSError, ValueError):  # it may not be read, is no text, or is no JSON
        return False


def check_place(path: str | None) -> None:
    """Refuse a file that cannot be written."""
    if path and (Path(path).is_dir() or not os.access(Path(path).resolve().parent, os.W_OK)):
        cure = "name a file in a folder that exists and may be written to"
        raise InputError("the file cannot be written", path, cure=cure)


@contextmanager
def errors_for_machines(path: str | None) -> Iterator[None]:
    """Bad input also goes to `--json`, field by field."""
    check_results(path)
    try:
        yield
    except InputError as error:
        if path:
            from fitting.report.results import write_json

            write_json(path, {"error": error.as_dict()})
        raise
