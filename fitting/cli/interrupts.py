"""Ctrl-C, or a scheduler that ends a job, stops a command wherever it falls."""

import atexit
import os
import signal
import socket
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, nullcontext
from threading import Thread, Timer, current_thread, main_thread
from typing import NoReturn

import click

GRACE = 30.0  # s that a command has to keep what it found once it is told to end: schedulers wait as long; chosen
OVERDUE = "\nmckibben: it did not stop within {:.0f} s and is ended; what was not yet kept is lost\n"
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
        raise KeyboardInterrupt

    in_main_thread = current_thread() is main_thread()
    ended = signal.signal(signal.SIGTERM, terminated) if in_main_thread else None

    again = list[int]()  # signals that are sent again here, which nobody has sent twice

    def raised(found: "sys.UnraisableHookArgs") -> None:
        if issubclass(found.exc_type, KeyboardInterrupt):
            again.append(came)
            Timer(AGAIN, os.kill, (os.getpid(), came)).start()
        else:
            before(found)

    sys.unraisablehook = raised
    try:
        with _ended_at_last(again) if in_main_thread else nullcontext():
            yield
    finally:
        sys.unraisablehook = before
        if in_main_thread:
            signal.signal(signal.SIGTERM, ended or signal.SIG_DFL)  # None where it was not set from Python
    atexit.register(signal.signal, signal.SIGINT, signal.SIG_IGN)  # the last to be registered is called first


@contextmanager
def _ended_at_last(again: Sequence[int]) -> Iterator[None]:
    """End a command that was told to, `GRACE` after a signal to terminate or a second Ctrl-C, wherever it stands.

    Python calls what handles a signal between two of its own steps: never, while compiled code does not return. A byte
    is written here at once, and a thread of its own reads it. Signals that were sent `again` do not count.
    """
    heard, told = socket.socketpair()
    told.setblocking(False)
    before = signal.set_wakeup_fd(told.fileno(), warn_on_full_buffer=False)
    last = Timer(GRACE, _end)
    last.daemon = True
    Thread(target=_wait_for_the_end, args=(heard, last, again), daemon=True).start()
    try:
        yield
    finally:
        signal.set_wakeup_fd(before)
        told.close()  # ends the thread
        last.cancel()


def _wait_for_the_end(heard: socket.socket, last: Timer, again: Sequence[int]) -> None:
    """Start `last` with the first signal to terminate or the second Ctrl-C."""
    ends, interrupted = False, 0
    while number := heard.recv(1):
        interrupted += number[0] == signal.SIGINT
        if not ends and (number[0] == signal.SIGTERM or interrupted - len(again) > 1):
            ends = True
            last.start()
    heard.close()


def _end() -> None:
    """End this program, whose threads may be at work and would else be waited for."""
    os.write(sys.__stderr__.fileno() if sys.__stderr__ else 2, OVERDUE.format(GRACE).encode())
    os._exit(1)
