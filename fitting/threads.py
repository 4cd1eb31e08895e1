"""Work on several items at once: compiled code and LAPACK leave the lock of Python's interpreter."""

import os
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from typing import Any, TypeVar

import jax

Result = TypeVar("Result")
MOST = 8  # threads: each search holds its own slopes, and Python's interpreter goes from one to the next; chosen


def cores() -> int:
    """The cores that this process may use."""
    mine = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    return mine or 1


def worker_count() -> int:
    """How many threads share the searches of a diagnosis and the batches of a posterior: one a core, 2 to 8.

    On one core two of them wait for each other, which costs nothing.
    """
    return min(max(cores(), 2), MOST)


def at_once(count: int, work: Callable[..., Result], *items: Iterable[Any]) -> list[Result]:
    """`work` on each item (or on one of each of several lists), so many at a time; results in the order of the items.

    Threads count in 64 bits where their caller does: whether JAX does may be the matter of one thread, as in the tasks
    of a cluster.
    """
    wanted = jax.config.read("jax_enable_x64")

    def one(*each: Any) -> Result:
        if jax.config.read("jax_enable_x64") == wanted:
            return work(*each)
        with jax.enable_x64(wanted):
            return work(*each)

    with ThreadPoolExecutor(count) as threads:
        return list(threads.map(one, *items))
