"""A sweep over designs: pieces of work, wherever they are done, become files that survive a kill at any moment.

Every design has a number, and a piece is a range of numbers. Writing everything, a piece is a Parquet file that appears
whole or not at all; keeping only the best, what is known so far is one small file that says which pieces are in it and
is replaced as a whole. So a piece counts once however often it was begun, and the same command goes on where it was
stopped.
"""

import hashlib
import json
import math
import os
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import jax
import numpy as np

from fitting.console.program import program_version
from fitting.designs.sweep_file import Order, with_unit
from fitting.errors import InputError
from mckibben_jax.batch import Batch, Engine, Histogram, Picked, Tally, joined, nothing
from mckibben_jax.effect import name_of
from mckibben_jax.muscle import quantities as muscle_quantities
from mckibben_jax.parameter import parameters

PIECE = 2**20  # designs of a file, or of one step of progress
LOOK = 4096  # designs that the range of a histogram is taken from
SAVE_EVERY = 2.0  # s
FORMAT = 1

Progress = Callable[[str, float], None]
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
    order: Order, folder: Path | str, work: Work | None = None, progress: Progress = lambda *_: None,
    piece: int = PIECE,
) -> Swept:  # fmt: skip
    """Do a sweep, or what is left of it, and write its files into a folder."""
    folder, begun = Path(folder), time.monotonic()
    with jax.enable_x64(True):
        picked = Picked(order.batch)
        store = _store(_with_range(order, picked), folder, min(piece, order.batch.space.size))
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
    count = min(LOOK, order.batch.space.size)
    numbers = np.unique(np.linspace(0, order.batch.space.size - 1, count).astype(np.uint64))
    values = picked(numbers)[1][:, histogram.output]
    known = values[np.isfinite(values)]
    low, high = (float(known.min()), float(known.max())) if len(known) else (0.0, 1.0)
    high = high if high > low else low + max(abs(low), 1.0)
    return replace(order, batch=replace(order.batch, histogram=Histogram(histogram.output, low, high, histogram.bins)))


# What is on disk -----------------------------------------------------------------------------------------------------


class _Store:
    """The folder of a sweep: which pieces are done, and what is known from them."""

    def __init__(self, order: Order, folder: Path, piece: int):
        self.order, self.folder, self.piece = order, folder, piece
        self.pieces = -(-order.batch.space.size // piece)
        self.done: set[int] = set()
        self.tally = nothing(order.batch)

    def floor(self) -> float:
        """The score below which no design can be among the best any more."""
        batch = self.order.batch
        full = batch.best and len(self.tally.scores) == batch.best
        return float(self.tally.scores[-1]) if full else -math.inf

    def add(self, number: int, found: Any) -> None:
        """Take in a piece; one that is known already changes nothing."""
        raise NotImplementedError

    def finish(self, picked: Picked) -> tuple[tuple[str, ...], dict[str, np.ndarray]]:
        """Write what is only known at the end: names of files, kept designs."""
        raise NotImplementedError


class _Everything(_Store):
    """Every design: a Parquet file for each piece."""

    def __init__(self, order: Order, folder: Path, piece: int):
        super().__init__(order, folder, piece)
        self.done = {n for n in range(self.pieces) if self._path(n).exists()}

    def _path(self, number: int) -> Path:
        return self.folder / f"part-{number:06d}.parquet"

    def add(self, number: int, found: Any) -> None:
        import pyarrow as pa

        place, outputs, feasible = found
        columns = dict(zip(names(self.order.batch), [*place, *outputs, feasible], strict=True))
        counts = {"feasible": str(int(feasible.sum())), "undefined": str(int(_undefined(outputs)))}
        if self.order.batch.histogram:
            counts["histogram"] = json.dumps(histogram_of(self.order.batch.histogram, outputs).tolist())
        write_parquet(self._path(number), pa.table(columns).replace_schema_metadata(counts))
        self.done.add(number)

    def finish(self, picked: Picked) -> tuple[tuple[str, ...], dict[str, np.ndarray]]:
        import pyarrow.parquet as pq

        for number in range(self.pieces):
            told = pq.read_schema(self._path(number)).metadata
            counts = np.array(json.loads(told.get(b"histogram", b"[]")), int)
            one = nothing(self.order.batch)._replace(feasible=int(told[b"feasible"]), undefined=int(told[b"undefined"]))
            one = one._replace(counts=counts if len(counts) else one.counts)
            self.tally = joined(self.tally, one, self.order.batch)
        return tuple(self._path(number).name for number in range(self.pieces)), {}


class _Best(_Store):
    """The best designs, a histogram and a count: one file, replaced as a whole."""

    def __init__(self, order: Order, folder: Path, piece: int):
        super().__init__(order, folder, piece)
        self._saved = time.monotonic()
        with suppress(FileNotFoundError), np.load(folder / "state.npz") as state:
            self.done = set(state["done"].tolist())
            self.tally = Tally(*(state[name] for name in Tally._fields))

    def add(self, number: int, found: Any) -> None:
        if number in self.done:
            return
        self.tally = joined(self.tally, found, self.order.batch)
        self.done.add(number)
        if time.monotonic() - self._saved > SAVE_EVERY:
            self._save()

    def _save(self) -> None:
        def write(path: Path) -> None:
            with path.open("wb") as file:
                done = np.array(sorted(self.done), int)
                np.savez(file, allow_pickle=False, done=done, **self.tally._asdict())

        replaced(self.folder / "state.npz", write)
        self._saved = time.monotonic()

    def finish(self, picked: Picked) -> tuple[tuple[str, ...], dict[str, np.ndarray]]:
        import pyarrow as pa

        self._save()
        batch = self.order.batch
        place, outputs, feasible = picked(self.tally.numbers)
        columns = [self.tally.numbers, *place.T, *outputs.T, feasible]
        rows = dict(zip(("number", *names(batch)), columns, strict=True))
        write_parquet(self.folder / "best.parquet", pa.table(rows))
        return ("best.parquet",), rows


def _store(order: Order, folder: Path, piece: int) -> _Store:
    """The folder, new or begun; one of another sweep is refused. The size of its pieces is that of its beginning."""
    mark, path = fingerprint(order), folder / "sweep.json"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        told = json.loads(path.read_text()) if path.exists() else None
    except (OSError, json.JSONDecodeError) as error:
        cure = "name another folder with --out"
        raise InputError(f"the folder of the sweep cannot be used: {error}", folder, cure=cure) from None
    if told is None:
        if any(folder.glob("part-*.parquet")):
            raise InputError("the folder holds files of another program", folder, cure="name another folder with --out")
        head = {"format": FORMAT, "program": program_version(), "sweep": mark, "designs": order.batch.space.size,
                "designs_in_a_piece": piece, "columns": list(names(order.batch))}  # fmt: skip
        replaced(path, lambda new: new.write_text(json.dumps(head, indent=1) + "\n"))
    elif told.get("sweep") != mark:
        cure = "name another folder with --out, or delete this one"
        raise InputError("the folder holds a sweep that was ordered otherwise", folder, cure=cure)
    piece = piece if told is None else int(told["designs_in_a_piece"])
    return (_Everything if order.everything else _Best)(order, folder, piece)


def fingerprint(order: Order) -> str:
    """What makes two orders the same sweep."""
    batch = order.batch
    muscle = {name: None if (v := getattr(batch.muscle, name)) is None else float(v) for name in muscle_quantities()}
    effects = {name_of(e): {p.name: float(getattr(e, p.name)) for p in parameters(e)} for e in batch.effects}
    wanted = [batch.outputs, batch.columns, [vars(limit) for limit in batch.limits]]
    kept = [order.everything, batch.by, batch.largest, batch.best, batch.histogram and vars(batch.histogram)]
    parts = [muscle, effects, vars(batch.space), wanted, kept]
    return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()


def names(batch: Batch) -> tuple[str, ...]:
    """The columns of a sweep: variables, outputs, feasible."""
    known = muscle_quantities()
    return (*(with_unit(name, known[name][0]) for name in batch.space.ranges), *batch.columns, "feasible")


def _undefined(outputs: list[np.ndarray]) -> int:
    return np.sum(~np.all(np.isfinite(outputs), axis=0))


def histogram_of(histogram: Histogram, outputs: list[np.ndarray]) -> np.ndarray:
    """Counts below, in the bins, and beyond, of designs whose outputs are all numbers."""
    values = outputs[histogram.output][np.all(np.isfinite(outputs), axis=0)]
    place = np.floor((values - histogram.low) / (histogram.high - histogram.low) * histogram.bins) + 1
    return np.bincount(np.clip(place, 0, histogram.bins + 1).astype(int), minlength=histogram.bins + 2)


def write_parquet(path: Path, table: Any) -> None:
    """Write a table so that it is there whole or not at all. Measured numbers hardly compress: they are not."""
    import pyarrow.parquet as pq

    replaced(path, lambda new: pq.write_table(table, new, compression="none", use_dictionary=False))


def replaced(path: Path, write: Callable[[Path], Any]) -> None:
    """Write a file beside its place, then move it there in one step."""
    new = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        write(new)
        os.replace(new, path)
    except OSError as error:
        new.unlink(missing_ok=True)
        cure = "make room, or name another folder with --out; the same command then goes on"
        raise InputError(f"the file cannot be written: {error.strerror or error}", path, cure=cure) from None
