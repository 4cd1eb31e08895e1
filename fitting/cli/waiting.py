"""How far a command is: a bar on a terminal, a line now and then where the error output goes elsewhere."""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Event, Lock, Thread
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from rich.progress import Progress as Bars
    from rich.progress import TaskID

A_WHILE = 60.0  # s without a word
A_LOOK = 5.0  # s, after which it is looked again whether there was a word; chosen


class ProgressBar:
    """A bar on the error output: called with words and the share that is done.

    Where there is no terminal (a file, a notebook, a scheduler's log), the words are a line of their own, one a minute,
    whether they are new or not: a discovery of many readings, or a sampler that is being compiled, took minutes without
    a sign of life.
    """

    def __init__(self, bar: "Bars", number: "TaskID", quiet: bool, text: str):
        self.bar, self.number, self.text = bar, number, text
        self.speaking = Lock()
        self.says_lines = bar.disable and not quiet
        self.begun = self.last = time.monotonic()

    def __call__(self, text: str, share: float) -> None:
        """What is being done, and the share that is done."""
        self.bar.update(self.number, description=text, completed=share, total=1.0)
        self.text = text
        self.break_silence()

    def break_silence(self) -> None:
        """Say on a line what is being done, if nothing was said for a while."""
        with self.speaking:
            now = time.monotonic()
            if self.says_lines and now - self.last >= A_WHILE:
                self.last = now
                click.echo(f"mckibben: {(now - self.begun) / 60:.0f} min, {self.text}", err=True)

    @contextmanager
    def aside(self) -> Iterator[None]:
        """The bar makes room while something is printed."""
        self.last = time.monotonic()  # what is printed is a sign of life
        if self.bar.disable:
            yield
            return
        self.bar.stop()
        yield
        self.bar.start()


@contextmanager
def progress_bar(text: str, quiet: bool) -> Iterator[ProgressBar]:
    """A bar that is gone when the work is done."""
    from rich.console import Console
    from rich.progress import BarColumn, SpinnerColumn, TextColumn, TimeElapsedColumn
    from rich.progress import Progress as Bars

    shown = Console(stderr=True, quiet=quiet)
    columns = (SpinnerColumn(), TextColumn("{task.description}", markup=False), BarColumn(), TimeElapsedColumn())
    with Bars(*columns, console=shown, transient=True, disable=quiet or not shown.is_terminal) as bar:
        told = ProgressBar(bar, bar.add_task(text, total=None), quiet, text)
        with _breaking_silence(told):
            yield told


@contextmanager
def _breaking_silence(told: ProgressBar) -> Iterator[None]:
    """Look now and then, beside the work, whether a line is due."""
    done = Event()

    def look() -> None:
        while not done.wait(A_LOOK):
            told.break_silence()

    watcher = Thread(target=look, daemon=True)
    watcher.start()
    try:
        yield
    finally:
        done.set()
        watcher.join()
