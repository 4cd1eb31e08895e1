"""Pieces of a sweep on the workers of a running Dask scheduler (`pip install mckibben-jax[dask]`).

The scheduler does a piece again whose worker died; results come back here, where each is counted once.
"""

import functools
from collections.abc import Callable, Iterable, Iterator
from typing import Any

from fitting.designs.sweep import Work
from fitting.designs.sweep_file import Order
from fitting.errors import InputError

AHEAD = 2  # pieces in flight for each thread of the workers
PATIENCE = 20  # failures of one piece before it is given up


def on(address: str) -> Work:
    """How pieces are done on the workers of the scheduler at this address."""
    try:
        import distributed
    except ImportError:
        raise InputError("--scheduler needs Dask", cure="pip install 'mckibben-jax[dask]'") from None
    try:
        client = distributed.Client(address, timeout="10s", set_as_default=False)
    except (OSError, ValueError) as error:
        cure = "start one with 'dask scheduler', and workers with 'dask worker ADDRESS'"
        raise InputError(f"no Dask scheduler answers: {error}", value=address, cure=cure) from None
    return functools.partial(_pieces, client)


def _pieces(
    client: Any, order: Order, numbers: Iterable[int], piece: int, floor: Callable[[], float]
) -> Iterator[tuple[int, Any]]:
    import cloudpickle
    from distributed import as_completed

    left, packed = iter(numbers), cloudpickle.dumps(order)

    def submit(number: int) -> Any:
        return client.submit(do_piece, packed, number, piece, floor(), pure=False, retries=PATIENCE)

    threads = max(1, sum(client.nthreads().values()))
    begun = [submit(number) for _, number in zip(range(AHEAD * threads), left, strict=False)]
    waiting = as_completed(begun, loop=client.loop)
    for future in waiting:
        yield _result(future)
        following = next(left, None)
        if following is not None:
            waiting.add(submit(following))
    client.close()


def _result(future: Any) -> tuple[int, Any]:
    try:
        return future.result()
    except Exception as error:  # of whatever kind a worker met
        cure = "look at the log of the workers; the same command then goes on where it stopped"
        raise InputError(f"the workers could not do a piece: {error}", cure=cure) from error


def do_piece(packed: bytes, number: int, piece: int, floor: float) -> tuple[int, Any]:
    """One piece, on a worker. The order is unpacked here: outside, its numbers would be cut to 32 bits."""
    import cloudpickle
    import jax

    with jax.enable_x64(True):
        order: Order = cloudpickle.loads(packed)
        engine = _engine(order, piece)
        return number, engine.rows(number) if order.everything else engine.tally(number, floor)


_COMPILED: dict[str, Any] = {}  # a worker gets many pieces of the same sweep


def _engine(order: Order, piece: int) -> Any:
    from fitting.designs.sweep import fingerprint
    from mckibben_jax.batch import Engine

    mark = f"{fingerprint(order)}-{piece}"
    if mark not in _COMPILED:
        _COMPILED.clear()
        _COMPILED[mark] = Engine(order.batch, piece)
    return _COMPILED[mark]
