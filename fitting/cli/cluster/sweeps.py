"""Pieces of a sweep on the workers of a running Dask scheduler: each result is counted once, where the sweep is."""

import functools
from collections.abc import Callable, Iterable, Iterator
from typing import Any

from fitting.cli.cluster.scheduler import GO_ON, connect, pack, spread, unpack
from fitting.cli.settings import WORK
from fitting.designs.sweep import Work
from fitting.designs.sweep_file import Order
from fitting.errors import InputError


def on(address: str) -> Work:
    """How pieces are done on the workers of the scheduler at this address."""
    return functools.partial(_pieces, connect(address))


def _pieces(
    client: Any, order: Order, numbers: Iterable[int], piece: int, floor: Callable[[], float]
) -> Iterator[tuple[int, Any]]:
    sent = pack(order)
    asked = ((number, (sent, number, piece, floor())) for number in numbers)
    for number, found, error in spread(client, do_piece, asked, retries=WORK.patience):
        if error is not None:
            cure = f"look at the log of the workers; {GO_ON}"
            raise InputError(f"the workers could not do a piece: {error}", cure=cure) from error
        yield number, found


def do_piece(sent: bytes, number: int, piece: int, floor: float) -> Any:
    """One piece, on a worker."""
    import jax

    with jax.enable_x64(True):
        order: Order = unpack(sent)
        engine = _engine(order, piece)
        return engine.rows(number) if order.everything else engine.tally(number, floor)


_COMPILED: dict[str, Any] = {}  # a worker gets many pieces of the same sweep


def _engine(order: Order, piece: int) -> Any:
    from fitting.designs.sweep_store import fingerprint
    from mckibben_jax.design.batch import Engine

    mark = f"{fingerprint(order)}-{piece}"
    if mark not in _COMPILED:
        _COMPILED.clear()
        _COMPILED[mark] = Engine(order.batch, piece)
    return _COMPILED[mark]
