"""Ctrl-C, or a scheduler that ends a job, stops a command wherever it falls."""

import atexit
import os
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Timer, current_thread, main_thread
from typing import NoReturn

import click

GRACE = 30.0  # s that a command has to keep what it found once it is told to end: schedulers wait as long; chosen
AGAIN = 0.05  # s, after which a lost Ctrl-C is sent again: the callback that lost it has returned; chosen


class SaidStopped(KeyboardInterrupt):
    """Ctrl-C of which the user has been told what is kept."""


def stopped(kept: str) -> NoReturn:
    """Tell whoever typed Ctrl-C what is `kept`, and end."""
    click.echo(f"\nStopped. {kept}".rstrip(), err=True)
    raise SaidStopped


def end_at_once() -> None:
    """Let a signal to terminate end this command where it stands.

    For a server: it has nothing to keep, and the threads of its visitors would be waited for.
    """
    if current_thread() is main_thread():
        signal.signal(signal.SIGTERM, signal.SIG_DFL)


@contextmanager
def interruptible() -> Iterator[None]:
    """A command that Ctrl-C stops, though it fall into a callback of compiled code.

    Python reports what is raised in such a callback and goes on: the command would run to its end. When all is written,
    Ctrl-C comes too late to stop anything, and the end of the program is not interrupted. `timeout` and schedulers send
    a signal to terminate first: it stops a command as Ctrl-C does, or what was found so far would be lost.
    """
    before, came = sys.unraisablehook, signal.SIGINT

    def terminated(number: int, _frame: object) -> NoReturn:
        nonlocal came
        came = signal.Signals(number)
        if not last.is_alive():
            last.start()
        raise KeyboardInterrupt

    last = Timer(GRACE, os._exit, (1,))  # threads that are at work would else be waited for
    last.daemon = True

    in_main_thread = current_thread() is main_thread()
    ended = signal.signal(signal.SIGTERM, terminated) if in_main_thread else None

    def raised(found: "sys.UnraisableHookArgs") -> None:
        if issubclass(found.exc_type, KeyboardInterrupt):
            Timer(AGAIN, os.kill, (os.getpid(), came)).start()
        else:
            before(found)

    sys.unraisablehook = raised
    try:
        yield
    finally:
        sys.unraisablehook = before
        last.cancel()
        if in_main_thread:
            signal.signal(signal.SIGTERM, ended or signal.SIG_DFL)  # None where it was not set from Python
    atexit.register(signal.signal, signal.SIGINT, signal.SIG_IGN)  # the last to be registered is called first
