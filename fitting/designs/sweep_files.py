"""How a sweep's designs lie on disk: as Parquet, a file for each piece, or as Zarr, an array for each column.

Of both holds that a piece is there or is not, whatever happens while it is written: a Parquet file appears whole; in
Zarr a piece is one chunk of each array, and counts once the small file with its counts is there, which comes last.
"""

import json
import os
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from fitting.writing import refused, write_text, write_whole

Columns = Mapping[str, np.ndarray]
Counts = dict[str, Any]  # of a piece: feasible, undefined, histogram
PARQUET, ZARR = KINDS = ("parquet", "zarr")
END = b"PAR1"  # of a Parquet file
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
    """A group of empty arrays that stands there with all of them or not at all."""
    import zarr

    def write(new: Path) -> None:
        group = zarr.create_group(new, zarr_format=3, overwrite=True)
        for name, kind in kinds.items():
            group.create_array(name, shape=(designs,), chunks=(piece,), dtype=np.dtype(kind), compressors=None,
                               dimension_names=("design",))  # fmt: skip

    write_whole(place, write, NO_ROOM)


# Both ----------------------------------------------------------------------------------------------------------------


def write_table(kind: str, folder: Path, name: str, columns: Columns) -> str:
    """Write a table that fits into memory, in place of one of that name; the file's name is returned."""
    path = folder / f"{name}.{kind}"
    if kind == PARQUET:
        _write_parquet(path, columns, {})
        return path.name

    def write(new: Path) -> None:
        import zarr

        group = zarr.create_group(new, zarr_format=3, overwrite=True)
        for column, values in columns.items():
            size = max(len(values), 1)
            array = group.create_array(column, shape=values.shape, chunks=(size,), dtype=values.dtype, compressors=None,
                                       dimension_names=("design",))  # fmt: skip
            array[:] = values

    shutil.rmtree(path, ignore_errors=True)  # a folder is not replaced by another in one step
    write_whole(path, write, NO_ROOM)
    return path.name
