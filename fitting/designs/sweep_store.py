"""The folder of a sweep: which pieces are done, and what is known from them, whatever moment it was stopped at.

Writing everything, a piece is there whole or not at all (`sweep_files`); keeping only the best, what is known so far is
one small file that says which pieces are in it and is replaced as a whole. So a piece counts once however often it was
begun.
"""

import hashlib
import json
import math
import time
import zlib
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np

from fitting.designs.settings import SWEEP
from fitting.designs.sweep_file import Order, with_unit
from fitting.designs.sweep_files import NO_ROOM, PARQUET, write_table, writer
from fitting.errors import InputError
from fitting.version import NAME, program_version
from fitting.writing import refused, write_text, write_whole
from mckibben_jax.design.batch import Batch, Histogram, Picked, Tally, joined, nothing
from mckibben_jax.effect import name_of
from mckibben_jax.muscle import quantities as muscle_quantities
from mckibben_jax.parameter import parameters

FORMAT = 1


class Store:
    """The folder of a sweep. `kind` is the format of its files."""

    def __init__(self, order: Order, folder: Path, piece: int, kind: str):
        self.order, self.folder, self.piece, self.kind = order, folder, piece, kind
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


class _Everything(Store):
    """Every design."""

    def __init__(self, order: Order, folder: Path, piece: int, kind: str):
        super().__init__(order, folder, piece, kind)
        kinds = {name: bool if name == FEASIBLE else float for name in names(order.batch)}
        self._writer = writer(kind, folder, kinds, order.batch.space.size, piece)
        self.done = self._writer.done()

    def add(self, number: int, found: Any) -> None:
        place, outputs, feasible = found
        columns = dict(zip(names(self.order.batch), [*place, *outputs, feasible], strict=True))
        counts: dict[str, Any] = {"feasible": int(feasible.sum()), "undefined": int(_undefined(outputs))}
        if self.order.batch.histogram:
            counts["histogram"] = histogram_of(self.order.batch.histogram, outputs).tolist()
        self._writer.write(number, columns, counts)
        self.done.add(number)

    def finish(self, picked: Picked) -> tuple[tuple[str, ...], dict[str, np.ndarray]]:
        for number in range(self.pieces):
            told = self._writer.counts(number)
            one = nothing(self.order.batch)._replace(feasible=told["feasible"], undefined=told["undefined"])
            if "histogram" in told:
                one = one._replace(counts=np.array(told["histogram"], int))
            self.tally = joined(self.tally, one, self.order.batch)
        return self._writer.files(), {}


class _Best(Store):
    """The best designs, a histogram and a count: one file, replaced as a whole."""

    def __init__(self, order: Order, folder: Path, piece: int, kind: str):
        super().__init__(order, folder, piece, kind)
        self._saved = time.monotonic()
        path = folder / "state.npz"
        try:
            with np.load(path) as state:
                self.done = set(state["done"].tolist())
                self.tally = Tally(*(state[name] for name in Tally._fields))
        except FileNotFoundError:
            return
        except (OSError, ValueError, TypeError, KeyError, EOFError, BadZipFile, zlib.error):
            raise InputError("what is known so far is damaged", path, cure="delete it: the sweep begins anew") from None

    def add(self, number: int, found: Any) -> None:
        if number in self.done:
            return
        self.tally = joined(self.tally, found, self.order.batch)
        self.done.add(number)
        if time.monotonic() - self._saved > SWEEP.save_every:
            self._save()

    def _save(self) -> None:
        def write(path: Path) -> None:
            with path.open("wb") as file:
                done = np.array(sorted(self.done), int)
                np.savez(file, allow_pickle=False, done=done, **self.tally._asdict())

        write_whole(self.folder / "state.npz", write, NO_ROOM)
        self._saved = time.monotonic()

    def finish(self, picked: Picked) -> tuple[tuple[str, ...], dict[str, np.ndarray]]:
        self._save()
        place, outputs, feasible = picked(self.tally.numbers)
        columns = [self.tally.numbers, *place.T, *outputs.T, feasible]
        rows = dict(zip(("number", *names(self.order.batch)), columns, strict=True))
        return (write_table(self.kind, self.folder, "best", rows),), rows


def open_store(order: Order, folder: Path, piece: int, kind: str = PARQUET) -> Store:
    """The folder, new or begun; one of another sweep is refused. The size of its pieces is that of its beginning."""
    mark, path = fingerprint(order), folder / "sweep.json"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        told = json.loads(path.read_text(encoding="utf-8")) if path.exists() else None
        if told is not None:
            piece = int(told["designs_in_a_piece"])
    except OSError as error:
        raise refused(folder, error, "name another folder with --out") from None
    except (ValueError, KeyError, TypeError):
        cure = "name another folder with --out, or delete this one"
        raise InputError("this is no file of a sweep, or a damaged one", path, cure=cure) from None
    if told is None:
        if any(folder.glob("part-*")):
            raise InputError("the folder holds files of another program", folder, cure="name another folder with --out")
        head = {"format": FORMAT, "program": program_version(), "sweep": mark, "designs": order.batch.space.size,
                "designs_in_a_piece": piece, "columns": list(names(order.batch)), "files": kind}  # fmt: skip
        write_text(path, json.dumps(head, indent=1) + "\n", NO_ROOM)
    else:
        _check_same(told, mark, kind, folder)
    return (_Everything if order.everything else _Best)(order, folder, piece, kind)


def _check_same(told: dict[str, Any], mark: str, kind: str, folder: Path) -> None:
    cure = "name another folder with --out, or delete this one"
    if not told.get("format", FORMAT) <= FORMAT:
        problem = f"the sweep was begun by program {told.get('program', 'unknown')}; this is {program_version()}"
        raise InputError(problem, folder, cure=f"pip install --upgrade {NAME}, or {cure}")
    if told.get("sweep") != mark:
        raise InputError("the folder holds a sweep that was ordered otherwise", folder, cure=cure)
    begun = told.get("files", PARQUET)
    if begun != kind:
        raise InputError(f"the folder holds this sweep as {begun}", folder, cure=f"add --to {begun}, or {cure}")


def fingerprint(order: Order) -> str:
    """What makes two orders the same sweep."""
    batch = order.batch
    muscle = {name: None if (v := getattr(batch.muscle, name)) is None else float(v) for name in muscle_quantities()}
    effects = {name_of(e): {p.name: float(getattr(e, p.name)) for p in parameters(e)} for e in batch.effects}
    wanted = [batch.outputs, batch.columns, [vars(limit) for limit in batch.limits]]
    kept = [order.everything, batch.by, batch.largest, batch.best, batch.histogram and vars(batch.histogram)]
    parts = [muscle, effects, vars(batch.space), wanted, kept]
    return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()


FEASIBLE = "feasible"


def names(batch: Batch) -> tuple[str, ...]:
    """The columns of a sweep: variables, outputs, feasible."""
    known = muscle_quantities()
    return (*(with_unit(name, known[name][0]) for name in batch.space.ranges), *batch.columns, FEASIBLE)


def _undefined(outputs: list[np.ndarray]) -> int:
    return np.sum(~np.all(np.isfinite(outputs), axis=0))


def histogram_of(histogram: Histogram, outputs: list[np.ndarray]) -> np.ndarray:
    """Counts below, in the bins, and beyond, of designs whose outputs are all numbers."""
    values = outputs[histogram.output][np.all(np.isfinite(outputs), axis=0)]
    place = np.floor((values - histogram.low) / (histogram.high - histogram.low) * histogram.bins) + 1
    return np.bincount(np.clip(place, 0, histogram.bins + 1).astype(int), minlength=histogram.bins + 2)
