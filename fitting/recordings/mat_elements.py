"""The variables of a MATLAB file of version 5 (what -v6 and -v7 write), out of its bytes.

The layout is that of "MAT-File Format", The MathWorks: elements of a kind and a size; a matrix holds further elements,
which are its class, sizes, name and values; a compressed element unpacks to one. scipy reads these files too, but it
trusts the kinds and sizes that a file gives: one damaged file in some hundreds ended the whole program. Here every
number is checked before it is used. The tests compare both on files that MATLAB wrote.
"""

import math
import struct
import zlib
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from fitting.recordings.mat_variables import DamagedError, Struct, Unread, cells_of
from fitting.recordings.settings import TABLES

HEADER = 128  # bytes
TEXT, FLAGS, MATRIX, COMPRESSED = 1, 6, 14, 15  # kinds of elements
SIZES = (5, 6)  # some writers take unsigned numbers for sizes
NUMBERS = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}  # in numpy
LETTERS = {1: "latin-1", 2: "latin-1", 4: "utf-16", 16: "utf-8", 17: "utf-16", 18: "utf-32"}
CELLS, STRUCT, CHARACTERS = 1, 2, 4  # classes of matrices
NUMERIC = range(6, 16)
OTHER = {3: Unread.OBJECT, 5: Unread.SPARSE, 16: Unread.FUNCTION, 17: Unread.OBJECT}
COMPLEX = 0x800  # a flag of a matrix
DEEPEST = 32  # structs and cells within each other: nobody nests recordings so deep
MOST = 2_000_000  # elements; a struct array of 10,000 runs has some hundred thousand
Element = tuple[int, memoryview]


def mat5_variables(raw: bytes) -> Struct:
    """The variables by name; DamagedError, MemoryError where it would unpack to more than a recording can be."""
    try:
        return _Reader("<" if raw[126:128] == b"IM" else ">").variables(memoryview(raw)[HEADER:])
    except (struct.error, zlib.error, UnicodeDecodeError):
        raise DamagedError from None


def _expect(holds: bool) -> None:
    if not holds:
        raise DamagedError


class _Reader:
    """One file of one byte order; `bytes` and `elements` are what it may still have."""

    def __init__(self, order: str) -> None:
        self.order, self.bytes, self.elements = order, TABLES.unpacked_bytes, MOST

    def variables(self, view: memoryview) -> Struct:
        found = {}
        for kind, content in self._elements(view):
            inner = [*self._elements(self._unpacked(content))] if kind == COMPRESSED else [(kind, content)]
            for name, value in (self._matrix(part, 0) for part_kind, part in inner if self._is_matrix(part_kind)):
                if name:  # what has none is MATLAB's own
                    found[name] = value
        return found

    def _is_matrix(self, kind: int) -> bool:
        _expect(kind == MATRIX)
        return True

    def _elements(self, view: memoryview) -> Iterator[Element]:
        """Kind and content of each element; a short one keeps its content within the eight bytes of its head."""
        at = 0
        while at < len(view):
            self.elements -= 1
            (word,) = struct.unpack_from(f"{self.order}I", view, at)
            kind, size, is_short = word & 0xFFFF, word >> 16, bool(word >> 16)
            if not is_short:
                (size,) = struct.unpack_from(f"{self.order}I", view, at + 4)
            first = at + (4 if is_short else 8)
            _expect(first + size <= len(view) and self.elements >= 0 and not (is_short and size > 4))
            yield kind, view[first : first + size]
            at = at + 8 if is_short else first + size + (0 if kind == COMPRESSED else -size % 8)

    def _unpacked(self, content: memoryview) -> memoryview:
        machine = zlib.decompressobj()
        found = machine.decompress(content, max(self.bytes, 1))
        self.bytes -= len(found)
        if machine.unconsumed_tail or self.bytes <= 0:
            raise MemoryError
        _expect(machine.eof)
        return memoryview(found)

    def _matrix(self, content: memoryview, depth: int) -> tuple[str, Any]:
        """Name and value of a matrix; an empty one is an empty place of a cell array."""
        if not len(content):
            return "", np.zeros((0, 0))
        (kind, flags), *rest = self._elements(content)
        _expect(kind == FLAGS and len(flags) == 8 and depth < DEEPEST)
        (word,) = struct.unpack_from(f"{self.order}I", flags)
        form = word & 0xFF
        if form == 17:  # an object of MATLAB's newer kind: its name, and no sizes
            _expect(len(rest) > 0)
            return self._text(rest[0]), Unread.OBJECT
        _expect(len(rest) > 1 and rest[0][0] in SIZES)
        sizes = self._numbers(rest[0]).astype(int).tolist()
        _expect(len(sizes) > 1 and min(sizes) >= 0)
        if word & COMPLEX:
            return self._text(rest[1]), Unread.COMPLEX
        return self._text(rest[1]), self._value(form, sizes, rest[2:], depth)

    def _value(self, form: int, sizes: list[int], parts: Sequence[Element], depth: int) -> Any:
        if form in OTHER:
            return OTHER[form]
        if form == CELLS:
            return cells_of(self._inside(parts, math.prod(sizes), depth))
        if form == STRUCT:
            return self._structs(sizes, parts, depth)
        _expect(form == CHARACTERS or form in NUMERIC)
        if not math.prod(sizes):
            return np.zeros((0, 0))
        _expect(len(parts) == 1)
        return self._texts(parts[0], sizes) if form == CHARACTERS else self._array(parts[0], sizes)

    def _array(self, part: Element, sizes: list[int]) -> np.ndarray:
        numbers = self._numbers(part)
        _expect(len(numbers) == math.prod(sizes) and len(sizes) <= 32)
        return numbers.reshape(sizes, order="F")

    def _numbers(self, part: Element) -> np.ndarray:
        kind, content = part
        _expect(kind in NUMBERS)
        dtype = np.dtype(self.order + NUMBERS[kind])
        _expect(len(content) % dtype.itemsize == 0)
        return np.frombuffer(content, dtype)

    def _text(self, part: Element) -> str:
        kind, content = part
        _expect(kind in LETTERS)
        order = "" if kind in (1, 2, 16) else "-le" if self.order == "<" else "-be"
        return bytes(content).decode(LETTERS[kind] + order, "replace")

    def _texts(self, part: Element, sizes: list[int]) -> list[str]:
        """The rows of a matrix of letters, which stand column by column."""
        letters = self._text(part)
        _expect(len(sizes) == 2)
        if sizes[0] == 1:
            return [letters.strip()]
        _expect(len(letters) == math.prod(sizes))
        return [letters[row :: sizes[0]].strip() for row in range(sizes[0])]

    def _inside(self, parts: Sequence[Element], count: int, depth: int) -> list[Any]:
        """The values of matrices within a matrix, which has to hold so many."""
        _expect(len(parts) == count and all(kind == MATRIX for kind, _ in parts))
        return [self._matrix(content, depth + 1)[1] for _, content in parts]

    def _structs(self, sizes: list[int], parts: Sequence[Element], depth: int) -> Any:
        """A struct, or a list of them: the length of a field's name, all names, then the fields of each."""
        _expect(len(parts) > 1 and parts[1][0] == TEXT)
        length = self._numbers(parts[0]).astype(int).tolist()
        _expect(len(length) == 1 and length[0] > 0)
        joined = bytes(parts[1][1])
        starts = range(0, len(joined), length[0])
        names = [joined[at : at + length[0]].split(b"\0")[0].decode("latin-1") for at in starts]
        _expect(math.prod(sizes) <= MOST)
        values = self._inside(parts[2:], math.prod(sizes) * len(names), depth)
        firsts = range(0, len(values), len(names) or 1)
        each = [dict(zip(names, values[first : first + len(names)], strict=True)) for first in firsts]
        return each[0] if len(each) == 1 else each
