"""Pieces of work on the workers of a running Dask scheduler (`pip install mckibben-jax[dask]`).

The scheduler does a piece again whose worker died; every piece comes back here once, as what it gave or what it failed
with.
"""

import io
import pickle
from collections.abc import Callable, Iterable, Iterator
from typing import Any

import jax

from fitting.cli.settings import WORK
from fitting.errors import InputError
from fitting.library.line import Defined, effect_from_line

ANSWERS = "10s"  # how long a scheduler may take to answer
GO_ON = "the same command then goes on where it stopped"

Piece = tuple[Any, tuple]  # a piece's name, and what it is called with
Done = tuple[Any, Any, Exception | None]  # its name, what it gave, and what it failed with


def connect(address: str) -> Any:
    """The client of the scheduler at this address."""
    try:
        import distributed
    except ImportError:
        raise InputError("--scheduler needs Dask", cure="pip install 'mckibben-jax[dask]'") from None
    try:
        return distributed.Client(address, timeout=ANSWERS, set_as_default=False)
    except (OSError, ValueError) as error:
        cure = "start one with 'dask scheduler', and workers with 'dask worker ADDRESS'"
        raise InputError(f"no Dask scheduler answers: {error}", value=address, cure=cure) from None


def spread(client: Any, function: Callable, pieces: Iterable[Piece], retries: int = 0) -> Iterator[Done]:
    """Do a function on the workers, piece by piece, in whatever order they end; then part from the scheduler.

    A piece is taken from `pieces` when there is room for it, so that there may be any number of them. `retries` are for
    those that fail with an error; those of a dead worker are done again in any case, as often as the scheduler allows.
    It blames a death on all that the worker had before it: who is blamed is done once more, with nothing beside it.
    """
    from distributed import KilledWorker

    try:
        blamed = []
        for piece, value, error in _together(client, function, iter(pieces), retries):
            if isinstance(error, KilledWorker):
                blamed.append(piece)
            else:
                yield piece[0], value, error
        for piece in blamed:
            for _, value, error in _together(client, function, iter([piece]), retries):
                yield piece[0], value, error
    finally:
        client.close()


def _together(
    client: Any, function: Callable, pieces: Iterator[Piece], retries: int
) -> Iterator[tuple[Piece, Any, Exception | None]]:
    """Do pieces, as many at once as keep all workers busy."""
    from distributed import as_completed

    begun: dict[str, Piece] = {}

    def submit(count: int) -> list[Any]:
        """Hand over the next pieces."""
        new = [(client.submit(function, *piece[1], pure=False, retries=retries), piece)
               for _, piece in zip(range(count), pieces, strict=False)]  # fmt: skip
        begun.update((future.key, piece) for future, piece in new)
        return [future for future, _ in new]

    waiting = as_completed(submit(WORK.ahead * max(1, sum(client.nthreads().values()))), loop=client.loop)
    for future in waiting:
        value, error = outcome(client, future)
        waiting.update(submit(1))
        yield begun.pop(future.key), value, error


def outcome(client: Any, future: Any) -> tuple[Any, Exception | None]:
    """What a piece gave, or failed with; a lost scheduler is no failure of the piece.

    A result that a worker took along when it died is computed anew, and waited for.
    """
    from distributed import CancelledError

    if future.status == "cancelled" or client.status != "running":
        raise _lost()
    try:
        return future.result(), None
    except CancelledError:
        raise _lost() from None
    except Exception as error:
        return None, error


def _lost() -> InputError:
    return InputError("the Dask scheduler was lost", cure=f"start it again; {GO_ON}")


# What goes along -----------------------------------------------------------------------------------------------------


class _Pickler(pickle.Pickler):
    """An effect that a line defines travels as its line: a class that is taken apart forgets what its fields are."""

    def reducer_override(self, obj: Any) -> Any:
        """How a thing is to be made again; for all but those classes as ever."""
        if isinstance(obj, type) and issubclass(obj, Defined) and obj is not Defined:
            return effect_from_line, (obj.line,)
        return NotImplemented


def pack(thing: Any) -> bytes:
    """Something with models in it, to be sent to a worker."""
    file = io.BytesIO()
    _Pickler(file, protocol=pickle.HIGHEST_PROTOCOL).dump(thing)
    return file.getvalue()


def unpack(data: bytes) -> Any:
    """What was sent. Dask would unpack it outside, and cut its numbers to 32 bits."""
    with jax.enable_x64(True):
        return pickle.loads(data)
