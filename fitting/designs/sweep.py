"""A sweep over designs: pieces of work, wherever they are done, become files that survive a kill at any moment.

Every design has a number, and a piece is a range of numbers. A piece counts once however often it was begun
(`sweep_store`), and the same command goes on where it was stopped.
"""

import math
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import jax
import numpy as np

from fitting.designs.settings import SWEEP
from fitting.designs.sweep_file import Order
from fitting.designs.sweep_files import PARQUET
from fitting.designs.sweep_store import open_store
from fitting.progress import Progress, unwatched
from mckibben_jax.design.batch import Batch, Engine, Histogram, Picked, Tally

Work = Callable[[Order, Iterable[int], int, Callable[[], float]], Iterator[tuple[int, Any]]]


@dataclass(frozen=True)
class Swept:
    """What a sweep has found, and where its files are. `rows` are the kept designs, best first: a column for each."""

    folder: Path
    files: tuple[str, ...]
    designs: int
    tally: Tally
    rows: dict[str, np.ndarray]
    batch: Batch
    computed: int  # designs evaluated by this call; the rest was there already
    seconds: float


def sweep(
    order: Order, folder: Path | str, work: Work | None = None, progress: Progress = unwatched,
    piece: int = SWEEP.piece, kind: str = PARQUET,
) -> Swept:  # fmt: skip
    """Do a sweep, or what is left of it, and write its files, Parquet or Zarr (`kind`), into a folder."""
    folder, begun = Path(folder), time.monotonic()
    with jax.enable_x64(True):
        picked = Picked(order.batch)
        store = open_store(_with_range(order, picked), folder, min(piece, order.batch.space.size), kind)
        left = [number for number in range(store.pieces) if number not in store.done]
        computed = 0
        for number, found in (work or here)(store.order, left, store.piece, store.floor):
            store.add(number, found)
            computed += min(store.piece, order.batch.space.size - number * store.piece)
            done = len(store.done) / store.pieces
            rate = computed / max(time.monotonic() - begun, 1e-9)
            progress(f"{done * order.batch.space.size:,.0f} designs, {rate:,.0f} a second", done)
        files, rows = store.finish(picked)
    return Swept(folder, files, order.batch.space.size, store.tally, rows, store.order.batch, computed,
                 time.monotonic() - begun)  # fmt: skip


def here(order: Order, numbers: Iterable[int], piece: int, floor: Callable[[], float]) -> Iterator[tuple[int, Any]]:
    """Do the pieces on the devices of this machine; the next one is computed while one is written."""
    engine = Engine(order.batch, piece)
    if not order.everything:
        for number in numbers:
            yield number, engine.tally(number, floor())
        return
    ahead: tuple[int, Any] | None = None
    for number in numbers:
        begun = engine.begin_rows(number)
        if ahead is not None:
            yield ahead[0], engine.rows(*ahead)
        ahead = number, begun
    if ahead is not None:
        yield ahead[0], engine.rows(*ahead)


def _with_range(order: Order, picked: Picked) -> Order:
    """The histogram's range, where it is left open, from a first look at designs all over the space."""
    histogram = order.batch.histogram
    if histogram is None or not math.isnan(histogram.low):
        return order
    count = min(SWEEP.look, order.batch.space.size)
    numbers = np.unique(np.linspace(0, order.batch.space.size - 1, count).astype(np.uint64))
    values = picked(numbers)[1][:, histogram.output]
    known = values[np.isfinite(values)]
    low, high = (float(known.min()), float(known.max())) if len(known) else (0.0, 1.0)
    high = high if high > low else low + max(abs(low), 1.0)
    return replace(order, batch=replace(order.batch, histogram=Histogram(histogram.output, low, high, histogram.bins)))
