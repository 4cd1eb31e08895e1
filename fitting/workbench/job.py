"""Work in the background that tells how far it is and can be called off."""

import sys
import threading
import traceback
from collections.abc import Callable
from typing import Any

from fitting.errors import InputError


class Cancelled(Exception):
    """The work was called off."""


class Job:
    """One piece of work in a thread of its own: `work` is called with a function that takes words and a share.

    Called off, it is given up at once: what it computes at that moment runs to its end and is thrown away.
    """

    def __init__(self, words: str, work: Callable[[Callable[[str, float], None]], Any]):
        self.words, self.share = words, 0.0
        self.result: Any = None
        self.problem: str | None = None
        self.error: InputError | None = None  # where the problem is one of what the user gave
        self.off = threading.Event()
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, args=(work,), daemon=True)
        self._thread.start()

    @property
    def done(self) -> bool:
        """Whether there is nothing more to wait for."""
        return self.off.is_set() or self._ended.is_set()

    def cancel(self) -> None:
        """Call the work off."""
        self.problem = "Called off; nothing was changed."
        self.off.set()

    def wait(self, seconds: float | None = None) -> "Job":
        """Wait for the end."""
        self._ended.wait(seconds)
        return self

    def _told(self, words: str, share: float) -> None:
        if self.off.is_set():
            raise Cancelled
        self.words, self.share = words, share

    def _run(self, work: Callable[[Callable[[str, float], None]], Any]) -> None:
        try:
            result = work(self._told)
            if not self.off.is_set():
                self.result = result
        except Cancelled:
            pass
        except InputError as error:
            self.problem, self.error = self.problem or str(error), error
        except Exception as error:
            traceback.print_exc(file=sys.stderr)
            self.problem = self.problem or f"This failed: {type(error).__name__}: {error}"
        finally:
            self._ended.set()
