"""The compiled programs that a process holds: as many as memory and kernel bear, the least recently used go first.

The large program of a diagnosis takes 1,400 of the 65,530 memory mappings that Linux allows a process (3,300 until it
was compiled as `compiler.py` says). Beyond them LLVM ends the process ("Cannot allocate memory"); fifteen data sets of
seven shapes had taken 27,500. A program that was let go is read from the disk again, in a second or two, when it is
asked for.
"""

import ctypes
import gc
import sys
from collections.abc import Callable, Hashable
from contextlib import suppress
from itertools import count
from pathlib import Path
from threading import RLock
from typing import ClassVar
from weakref import WeakSet

FEWEST = 6  # programs that stay whatever their size is, for two data sets in turn: a diagnosis needs three
# Bytes of all programs of a process as jax writes them, where there are more: thirty of the small ones of single
# models, of which the plan of a next recording needs a dozen. That of a diagnosis has 0.4 MB, of three muscles 0.9.
ROOM = 2_400_000
UNWRITTEN = 400_000  # what a program is counted as that jax does not write, a user's own effect in it: traced anew
SHARE = 0.2  # of the mappings that the kernel allows: where that is passed, programs go though they are fewer
MAPPINGS, ALLOWED = Path("/proc/self/maps"), Path("/proc/sys/vm/max_map_count")

_clock, _lock = count(), RLock()


class Programs:
    """Programs of one function by what they were made for; those of all functions share one room."""

    every: ClassVar["WeakSet[Programs]"] = WeakSet()

    def __init__(self) -> None:
        self._held: dict[Hashable, Callable] = {}
        self._used: dict[Hashable, int] = {}
        self._sizes: dict[Hashable, int] = {}
        with _lock:
            Programs.every.add(self)

    def __len__(self) -> int:
        return len(self._held)

    def get(self, asked: Hashable) -> Callable | None:
        """The program for this; None where there is none any more."""
        with _lock:
            if asked in self._held:
                self._used[asked] = next(_clock)
            return self._held.get(asked)

    def put(self, asked: Hashable, program: Callable, size: int = UNWRITTEN) -> None:
        """Hold one more program of this size, bytes; what has not been used for longest goes."""
        with _lock:
            _make_room(size)
            self._held[asked], self._used[asked], self._sizes[asked] = program, next(_clock), size

    def clear(self) -> None:
        """Hold none."""
        with _lock:
            self._held.clear()
            self._used.clear()
            self._sizes.clear()

    def _drop(self, asked: Hashable) -> None:
        del self._held[asked], self._used[asked], self._sizes[asked]


def _make_room(size: int) -> None:
    """Let programs go until there is room for one more of this size, and give free memory back to the system.

    Objects of a program refer to each other in circles, which only Python's garbage collector finds. It takes half a
    second, so it is called only where mappings are short.
    """
    every = [(used, of, asked) for of in Programs.every for asked, used in of._used.items()]
    oldest_last = sorted(every, key=lambda each: -each[0])
    while len(oldest_last) >= FEWEST and size + sum(of._sizes[asked] for _, of, asked in oldest_last) > ROOM:
        _drop_last(oldest_last)
    if _are_short():
        gc.collect()
    while oldest_last and _are_short():
        _drop_last(oldest_last)
        gc.collect()
    _give_back()


def _drop_last(held: list[tuple[int, Programs, Hashable]]) -> None:
    _, of, asked = held.pop()
    of._drop(asked)


def _are_short() -> bool:
    return mappings() > SHARE * allowed_mappings()


def mappings() -> int:
    """How many mappings this process has; 0 where the system does not say."""
    try:
        return MAPPINGS.read_bytes().count(b"\n")
    except OSError:
        return 0


def allowed_mappings() -> int:
    """How many mappings the system allows a process; as many as one likes where it does not say."""
    try:
        return int(ALLOWED.read_text())
    except (OSError, ValueError):
        return sys.maxsize


def _give_back() -> None:
    """Ask the C library of Linux to give free memory back to the system; others are not asked."""
    with suppress(OSError, AttributeError):
        ctypes.CDLL("libc.so.6").malloc_trim(0)
