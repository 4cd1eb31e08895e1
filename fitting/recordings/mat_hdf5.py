"""MATLAB files of version 7.3, which are HDF5: what is linked from other files is not followed."""

import io
from typing import Any

import h5py
import numpy as np

from fitting.recordings.mat_variables import DamagedError, Struct, Unread, cells_of
from fitting.recordings.settings import TABLES

NUMBERS = ("double", "single", "logical", *(f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64)))
DEEPEST = 16  # structs within each other: nobody nests recordings so deep, and a damaged file may hold itself


def hdf5_variables(raw: bytes) -> Struct:
    """The variables of a file, as `mat_variables` has them.

    DamagedError, MemoryError where it would unpack to more than a recording can be.
    """
    try:
        with h5py.File(io.BytesIO(raw), "r") as file:
            return _Reader(file).struct(file, 0)
    except MemoryError:
        raise
    except Exception:  # HDF5 says what is wrong with a damaged file by exceptions of many kinds
        raise DamagedError from None


class _Reader:
    """One file while it is open; `left` is what it may still unpack, in bytes."""

    def __init__(self, file: h5py.File) -> None:
        self.file, self.left = file, TABLES.unpacked_bytes

    def struct(self, group: h5py.Group, depth: int) -> Struct:
        """The members of a group; those whose names begin with '#' are MATLAB's own."""
        return {name: self._member(group, name, depth) for name in map(str, group) if not name.startswith("#")}

    def _member(self, group: h5py.Group, name: str, depth: int) -> Any:
        if not _is_own(group, name):
            return Unread.ELSEWHERE
        member = group[name]
        if isinstance(member, h5py.Group):
            return Unread.DEEP if depth >= DEEPEST else self._group(member, depth + 1)
        return self._dataset(member) if isinstance(member, h5py.Dataset) else Unread.OBJECT

    def _group(self, group: h5py.Group, depth: int) -> Any:
        kind = _kind(group)
        if "MATLAB_sparse" in group.attrs:
            return Unread.SPARSE
        if kind not in ("struct", ""):
            return Unread.OBJECT
        fields = {str(name): group[name] for name in group if _is_own(group, name)}
        array = fields and all(_is_reference(field) and not _kind(field) for field in fields.values())
        return self._structs(fields) if array else self.struct(group, depth)

    def _structs(self, fields: dict[str, Any]) -> Any:
        """An array of structs: every field holds one reference for each element."""
        columns = {name: [self._referred(one) for one in np.ravel(self._read(field))] for name, field in fields.items()}
        return [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]

    def _dataset(self, data: h5py.Dataset) -> Any:
        kind = _kind(data)
        if data.is_virtual or data.external:
            return Unread.ELSEWHERE
        if "MATLAB_empty" in data.attrs:
            return np.zeros((0, 0))
        if _is_reference(data):
            return self._cells(data) if kind == "cell" else Unread.OBJECT
        if kind == "char":
            return ["".join(map(chr, row)) for row in np.atleast_2d(self._read(data).T).astype(int)]
        if kind not in (*NUMBERS, "") or data.dtype.kind not in "biuf":
            return Unread.COMPLEX if data.dtype.names == ("real", "imag") else Unread.OBJECT
        return self._read(data).T  # MATLAB counts the first index fastest

    def _cells(self, data: h5py.Dataset) -> Any:
        return cells_of([self._referred(one) for one in np.ravel(self._read(data).T)])

    def _referred(self, reference: Any) -> Any:
        found = self.file[reference]
        return self._dataset(found) if isinstance(found, h5py.Dataset) and not _is_reference(found) else Unread.DEEP

    def _read(self, data: h5py.Dataset) -> np.ndarray:
        self.left -= int(data.size or 0) * max(data.dtype.itemsize, 1)
        if self.left < 0:
            raise MemoryError
        return np.asarray(data[()])


def _kind(member: Any) -> str:
    """The class that MATLAB gave it; empty where another program wrote the file."""
    kind = member.attrs.get("MATLAB_class", b"")
    return kind.decode("ascii", "replace") if isinstance(kind, bytes) else str(kind)


def _is_own(group: h5py.Group, name: Any) -> bool:
    """Whether a member lies in this file, and is not a link to another place."""
    return isinstance(group.get(name, getlink=True), h5py.HardLink)


def _is_reference(member: Any) -> bool:
    return isinstance(member, h5py.Dataset) and h5py.check_ref_dtype(member.dtype) is not None
