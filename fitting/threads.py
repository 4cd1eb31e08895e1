"""Work on several items at once: compiled code and LAPACK leave the lock of Python's interpreter."""

from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from typing import Any, TypeVar

import jax

Result = TypeVar("Result")


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
