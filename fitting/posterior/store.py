"""Chains on disk as they grow: a killed run goes on where it was.

One SQLite file holds any number of runs, each under the fingerprint of its data, model, priors and settings, so that
none is mistaken for another and none is lost. What was written is safe from a kill at any moment (a block of steps is
there or is not), which a growing HDF5 file is not. Each block carries the state of the random numbers: a resumed chain
is, number for number, the one that would have grown without the kill.
"""

import io
import sqlite3
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fitting.errors import InputError
from fitting.version import NAME, program_version

TABLES = """
CREATE TABLE IF NOT EXISTS frame (run TEXT PRIMARY KEY, arrays BLOB NOT NULL);
CREATE TABLE IF NOT EXISTS block (run TEXT NOT NULL, number INTEGER NOT NULL, arrays BLOB NOT NULL,
                                  PRIMARY KEY (run, number));
"""
# what reading an archive of arrays ends in where the bytes are not one
DAMAGED = (ValueError, TypeError, KeyError, OSError, EOFError, OverflowError, MemoryError, SyntaxError, RuntimeError,
           zipfile.BadZipFile, zlib.error)  # fmt: skip
FORMAT = 1  # of the file; 0 is that of files written before there was a number, which is the same
Arrays = dict[str, np.ndarray]


@dataclass(frozen=True)
class Store:
    """The file, and the run in it that is meant."""

    path: Path
    run: str

    def at(self, stage: str) -> "Store":
        """A part of the run with blocks of its own."""
        return Store(self.path, f"{self.run}/{stage}")

    def frame(self) -> Arrays | None:
        """The coordinates of this run, if it was begun before."""
        with self._open() as file:
            found = file.execute("SELECT arrays FROM frame WHERE run = ?", (self.run,)).fetchone()
        return None if found is None else self._arrays(found[0])

    def begin(self, frame: Arrays) -> None:
        """Keep the coordinates of this run, and nothing that was kept of it before."""
        with self._open() as file, file:
            file.execute("DELETE FROM block WHERE run = ?", (self.run,))
            file.execute("INSERT OR REPLACE INTO frame VALUES (?, ?)", (self.run, _bytes(frame)))

    def blocks(self) -> list[Arrays]:
        """All that was kept of this run, in order."""
        with self._open() as file:
            found = file.execute("SELECT arrays FROM block WHERE run = ? ORDER BY number", (self.run,)).fetchall()
        return [self._arrays(row[0]) for row in found]

    def append(self, number: int, arrays: Arrays) -> None:
        """Keep one more block; once this returns a kill cannot lose it."""
        with self._open() as file, file:
            file.execute("INSERT INTO block VALUES (?, ?, ?)", (self.run, number, _bytes(arrays)))

    def forget(self) -> None:
        """Begin this run anew, all its parts."""
        with self._open() as file, file:
            for table in ("frame", "block"):
                file.execute(f"DELETE FROM {table} WHERE run = ? OR run LIKE ?", (self.run, f"{self.run}/%"))

    @contextmanager
    def _open(self) -> Iterator[sqlite3.Connection]:
        try:
            file = sqlite3.connect(self.path)
            try:
                self._check_format(file.execute("PRAGMA user_version").fetchone()[0])
                file.executescript(f"{TABLES} PRAGMA user_version = {FORMAT};")
                yield file
            finally:
                file.close()
        except sqlite3.Error as error:
            raise self._explained(error) from None
        except UnicodeDecodeError:  # in a message of the library's about a damaged file
            raise self._damaged() from None

    def _check_format(self, found: int) -> None:
        if found > FORMAT:
            problem = f"these chains are of format {found}, and this is program {program_version()}, of format {FORMAT}"
            cure = f"pip install --upgrade {NAME}, or name another file by --chains"
            raise InputError(problem, self.path, cure=cure)

    def _arrays(self, raw: bytes) -> Arrays:
        """What was kept; each array has a checksum, so that damage is noticed."""
        try:
            with np.load(io.BytesIO(raw), allow_pickle=False) as found:
                return dict(found)
        except DAMAGED:
            raise self._damaged() from None

    def _damaged(self) -> InputError:
        return InputError("the chains in this file are damaged", self.path, cure="name another file by --chains")

    def _explained(self, error: sqlite3.Error) -> InputError:
        said = str(error)
        if "full" in said or "disk I/O" in said:
            cure = "make room and give the same command again: it goes on from there; or name another place by --chains"
            return InputError(f"the disk took no more; the chains up to here are kept ({said})", self.path, cure=cure)
        if "locked" in said or "UNIQUE" in said:
            cure = "wait for the other run, or name another file by --chains"
            return InputError("another run is writing these chains", self.path, cure=cure)
        if "not a database" in said or "malformed" in said:
            return InputError("this is no file of chains", self.path, cure="name another file by --chains")
        cure = "name a file in a folder that may be written to by --chains, or add --no-chains"
        return InputError(f"the chains cannot be kept here ({said})", self.path, cure=cure)


def copy_store(kept: Path, folder: Path) -> Path:
    """Chains as they were after their last whole block: somebody may be writing them, or was killed at it.

    The copy lies in `folder`. sqlite3.Error where `kept` is no file of chains.
    """
    copy = folder / kept.name
    with closing(sqlite3.connect(kept)) as source, closing(sqlite3.connect(copy)) as target:
        source.backup(target)
    return copy


def _bytes(arrays: Arrays) -> bytes:
    out = io.BytesIO()
    np.savez(out, allow_pickle=False, **arrays)  # type: ignore[arg-type]
    return out.getvalue()
