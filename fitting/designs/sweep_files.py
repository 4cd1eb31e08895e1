"""How a sweep's designs lie on disk: as Parquet, a file for each piece, or as Zarr, an array for each column.

Of both holds that a piece is there or is not, whatever happens while it is written: a Parquet file appears whole; in
Zarr a piece is one chunk of each array, and counts once the small file with its counts is there, which comes last.
"""

import errno
import json
import os
import secrets
import shutil
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from fitting.writing import refused, write_replacing, write_text, write_whole

Columns = Mapping[str, np.ndarray]
Counts = dict[str, Any]  # of a piece: feasible, undefined, histogram
PARQUET, ZARR = KINDS = ("parquet", "zarr")
END = b"PAR1"  # of a Parquet file
OCCUPIED = (errno.ENOTEMPTY, errno.EEXIST)  # a folder is there, which no other can be moved onto
NO_ROOM = "make room, or name another folder with --out; the same command then goes on"


class Writer(Protocol):
    """A folder that takes pieces in any order, each as often as it likes."""

    def done(self) -> set[int]:
        """The numbers of the pieces that are there."""
        ...

    def write(self, number: int, columns: Columns, counts: Counts) -> None:
        """Write a piece."""
        ...

    def counts(self, number: int) -> Counts:
        """What was counted in a piece that is there."""
        ...

    def files(self) -> tuple[str, ...]:
        """The names of all that was written, in order."""
        ...


def writer(kind: str, folder: Path, kinds: Mapping[str, type], designs: int, piece: int) -> Writer:
    """What writes a sweep into a folder. `kinds` says of each column whether its values are numbers or truths."""
    return (_Parquet if kind == PARQUET else _Zarr)(folder, kinds, designs, piece)


# Parquet -------------------------------------------------------------------------------------------------------------


class _Parquet:
    """A file for each piece, its counts among the file's own metadata."""

    def __init__(self, folder: Path, kinds: Mapping[str, type], designs: int, piece: int):
        self.folder, self.pieces = folder, -(-designs // piece)

    def done(self) -> set[int]:
        return {number for number in range(self.pieces) if _is_whole(self._path(number))}

    def write(self, number: int, columns: Columns, counts: Counts) -> None:
        _write_parquet(self._path(number), columns, {name: json.dumps(value) for name, value in counts.items()})

    def counts(self, number: int) -> Counts:
        import pyarrow.parquet as pq

        told = pq.read_schema(self._path(number)).metadata
        return {name: json.loads(told[name.encode()]) for name in ("feasible", "undefined", "histogram")
                if name.encode() in told}  # fmt: skip

    def files(self) -> tuple[str, ...]:
        return tuple(self._path(number).name for number in range(self.pieces))

    def _path(self, number: int) -> Path:
        return self.folder / f"part-{number:06d}.parquet"


def _is_whole(path: Path) -> bool:
    """Whether a file is there to its end: one that a power cut left empty is not."""
    try:
        with path.open("rb") as file:
            file.seek(-len(END), os.SEEK_END)
            return file.read() == END
    except OSError:
        return False


def _write_parquet(path: Path, columns: Columns, told: Mapping[str, str]) -> None:
    """Computed numbers hardly compress: they are not."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    table = pa.table(dict(columns)).replace_schema_metadata(dict(told))
    write_whole(path, lambda new: pq.write_table(table, new, compression="none", use_dictionary=False), NO_ROOM)


# Zarr ----------------------------------------------------------------------------------------------------------------


class _Zarr:
    """A group with an array for each column, a chunk for each piece; and a file of counts for each piece."""

    NAME = "designs.zarr"

    def __init__(self, folder: Path, kinds: Mapping[str, type], designs: int, piece: int):
        import zarr

        self.folder, self.size, self.piece = folder, designs, piece
        place = folder / self.NAME
        if not place.exists():
            _new_group(place, kinds, designs, piece)
        group = zarr.open_group(place, mode="r+")
        self.arrays: dict[str, Any] = {name: group[name] for name in kinds}

    def done(self) -> set[int]:
        return {number for number in range(-(-self.size // self.piece)) if self._told(number).exists()}

    def write(self, number: int, columns: Columns, counts: Counts) -> None:
        start = number * self.piece
        try:
            for name, column in columns.items():
                self.arrays[name][start : start + len(column)] = column
        except OSError as error:
            raise refused(self.folder / self.NAME, error, NO_ROOM) from None
        write_text(self._told(number), json.dumps(counts), NO_ROOM)

    def counts(self, number: int) -> Counts:
        return json.loads(self._told(number).read_text())

    def files(self) -> tuple[str, ...]:
        return (self.NAME,)

    def _told(self, number: int) -> Path:
        return self.folder / f"part-{number:06d}.json"


def _new_group(place: Path, kinds: Mapping[str, type], designs: int, piece: int) -> None:
    """A group of empty arrays that stands there with all of them or not at all; another sweep may be the faster."""

    def write(new: Path) -> None:
        _arrays(new, {name: ((designs,), np.dtype(kind)) for name, kind in kinds.items()}, piece)

    _moved_in(place, write)


def _arrays(place: Path, columns: Mapping[str, tuple[tuple[int, ...], np.dtype]], chunk: int) -> dict[str, Any]:
    """Empty arrays in a new group, of these shapes and kinds. Computed numbers hardly compress: they are not."""
    import zarr

    group = zarr.create_group(place, zarr_format=3, overwrite=True)
    return {
        name: group.create_array(name, shape=shape, chunks=(chunk,), dtype=kind, compressors=None,
                                 dimension_names=("design",))
        for name, (shape, kind) in columns.items()
    }  # fmt: skip


def _moved_in(place: Path, write: Callable[[Path], Any]) -> bool:
    """Write a folder beside its place and move it there; False where another program's was there first."""
    try:
        write_replacing(place, write)
    except OSError as error:
        if error.errno in OCCUPIED:
            return False
        raise refused(place, error, NO_ROOM) from None
    return True


def _made_free(place: Path) -> None:
    """Take a folder away in one step. Deleted where it stands it would take another program's with it, or a part."""
    aside = place.with_name(f".{place.name}.{secrets.token_hex(4)}")
    with suppress(FileNotFoundError):
        place.rename(aside)
    shutil.rmtree(aside, ignore_errors=True)


# Both ----------------------------------------------------------------------------------------------------------------


def write_table(kind: str, folder: Path, name: str, columns: Columns) -> str:
    """Write a table that fits into memory, in place of one of that name; the file's name is returned.

    Of two programs that write it at once, one's is there, whole.
    """
    path = folder / f"{name}.{kind}"
    if kind == PARQUET:
        _write_parquet(path, columns, {})
        return path.name

    def write(new: Path) -> None:
        count = max((len(values) for values in columns.values()), default=1)
        arrays = _arrays(new, {name: (values.shape, values.dtype) for name, values in columns.items()}, max(count, 1))
        for name, values in columns.items():
            arrays[name][:] = values
        _made_free(path)  # not before: so long the old one is there

    while not _moved_in(path, write):  # another program's was there first: it makes way like the old one
        pass
    return path.name
